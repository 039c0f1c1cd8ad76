"""The unprepared models and kinds of input are what their judge takes them for."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.declared import SignalTable
from slide_fmu.systems.loading import kind_module, load_system
from slide_fmu.systems.simulation import simulate
from slide_fmu.systems.specification import Specification
from tests.benchmarks.unprepared.fmu_calls import Answer
from tests.benchmarks.unprepared.judge import Case, figures_of, row_of
from tests.benchmarks.unprepared.kinds import KINDS, Band, Drawn, Motion, after_a_past
from tests.benchmarks.unprepared.models import MODELS, Wanted
from tests.benchmarks.unprepared.truths import truths_of

BAND = Band(0.2, 20.0, 0.001, 5.7, (4.3, 18.0))
RANGES = np.array([[-4.0, 4.0], [10.0, 25.0]])
STEPS = {"drive": 1e-3, "beam": 2e-3, "thermal": 0.5, "bearing": 2e-4, "two_mass": 5e-3}
"""Sample steps in s, as ``slide-fmu init`` proposes them."""
APART = {"function": 1e-6, "exudyn": 0.02, "fmu": 1e-6}
"""Largest deviation from the truth in parts of the outputs' spans; exudyn takes coarser steps."""


@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # of a function of exudyn
@pytest.mark.parametrize("name", MODELS)
def test_model_loads_as_a_system_that_moves_as_its_truth(name: str, tmp_path: Path) -> None:
    model, step = MODELS[name], STEPS[name]
    path = str(model.write(tmp_path))
    offered = kind_module(model.kind).describe(path)
    inputs = {key: SignalTable(range=model.ranges.get(key)) for key in offered.inputs}
    outputs = {key: SignalTable(range=(-1e3, 1e3)) for key in offered.outputs}
    system = load_system(Specification(path, {}, step, model.kind, inputs, outputs))
    limits = np.array([(signal.low, signal.high) for signal in system.inputs])
    jump = np.array([4 * step])

    def parts(times: FloatArray) -> FloatArray:
        return np.where(times[:, None] < jump - 1e-9, 0.0, np.full(len(limits), 0.5))

    motion, times = Motion(Drawn(parts, jump), limits), np.linspace(0, 40 * step, 161)
    wanted = Wanted(tuple(offered.inputs), tuple(offered.outputs), times)
    truth = truths_of(model, wanted, [motion], None, None)[0][::4]
    found = simulate(system, motion(times[:-1:4])).outputs
    assert np.all(np.abs(found - truth) < APART[model.kind] * np.ptp(truth, axis=0))


def test_fmu_of_another_model_is_refused() -> None:
    wanted = Wanted(("F_bed", "force"), ("x_bed",), np.linspace(0, 1, 3))
    with pytest.raises(ValueError, match="expected the inputs"):
        truths_of(MODELS["two_mass"], wanted, [], None, None)


@pytest.mark.parametrize("name", KINDS)
def test_kind_stays_within_the_ranges_of_its_inputs(name: str) -> None:
    for index in range(4):
        band = replace(BAND, index=index)
        motion = KINDS[name].motion(RANGES, np.random.default_rng(index), band)
        values = motion(np.linspace(0, BAND.duration, 2001))
        assert np.all((values >= RANGES[:, 0]) & (values <= RANGES[:, 1]))
        assert np.any(np.ptp(values, axis=0) > 0.01 * np.ptp(RANGES, axis=1))
        assert np.all(np.diff(motion.drawn.breaks, prepend=0.0, append=BAND.duration) > 0)


def test_figures_of_a_call_are_those_worked_out_by_hand() -> None:
    truth = np.array([[9.0], [1.0], [3.0], [1.0], [3.0]])  # the first does not count
    outputs = truth + np.array([[99.0], [0.1], [-0.1], [0.5], [-0.7]])
    counted = np.arange(5) > 0
    bounds, trusted = np.full((5, 1), 0.2), np.array([True, True, True, True, False])
    found = figures_of([Answer(outputs, counted, bounds, trusted)], [truth], np.array([2.0]))
    error = np.sqrt((0.01 + 0.01 + 0.25 + 0.49) / 4)
    assert found.samples == 4
    assert found.rmse == pytest.approx([error])
    assert found.rmse_all == pytest.approx([error / 2])
    assert found.covered == [0.5]
    assert (found.trusted, found.silent) == (0.75, 0.25)
    assert found.over_bound == pytest.approx(2.5)


def test_call_without_a_counted_sample_is_refused() -> None:
    nothing = Answer(np.zeros((3, 1)), np.zeros(3, dtype=bool))
    with pytest.raises(ValueError, match="0 samples count"):
        figures_of([nothing], [np.zeros((3, 1))], np.ones(1))


def test_samples_with_several_responses_do_not_count_and_are_told() -> None:
    truth, other = np.array([[0.0], [1.0], [2.0], [3.0]]), np.array([[9.0], [1.1], [2.0], [3.0]])
    case = Case("steps", [], [truth], [np.stack([truth, other])])
    single = case.one_response(np.array([1.0]))
    assert single[0].tolist() == [False, False, True, True]
    answer = Answer(truth + 0.5, np.arange(4) > 0)
    found = row_of([answer], [truth], single, np.array([1.0]))
    assert found["several"] == pytest.approx(1 / 3)
    assert found["samples"] == 2
    assert row_of([answer], [truth], [np.zeros(4, dtype=bool)], np.ones(1)) == {
        "samples": 0,
        "several": 1.0,
    }


@pytest.mark.parametrize("name", ["steps", "chirps"])
def test_motion_after_a_past_is_the_same_but_later(name: str) -> None:
    motion = KINDS[name].motion(RANGES, np.random.default_rng(0), BAND)
    later = after_a_past(motion, 2.0, np.random.default_rng(1), BAND)
    times = np.linspace(0.001, BAND.duration, 400)
    assert np.array_equal(later(times + 2.0), motion(times + 2.0 - 2.0))
    assert np.all(np.ptp(later(times[times < 2.0]), axis=0) > 0.9 * np.ptp(RANGES, axis=1))
    assert later.drawn.breaks[0] == 2.0
    assert len(later.drawn.breaks) == len(motion.drawn.breaks) + 1
