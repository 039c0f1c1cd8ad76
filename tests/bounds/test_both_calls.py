"""One bound holds for known inputs, and for those that are forecast over steps of any length."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from slide_fmu.bounds.fit import fit_surrogate
from slide_fmu.core.signals import FloatArray
from slide_fmu.cosim.whole_run import run_fmu
from slide_fmu.data.draws import TEST, Stream, draw, simulate_draw
from slide_fmu.data.generation import generate
from slide_fmu.fitting.preparation import Work
from slide_fmu.fmu.export import export_fmu
from slide_fmu.importer.file import unpacked
from slide_fmu.recipe.case import case_of
from slide_fmu.surrogate.surrogate import Surrogate
from tests.bounds.learnt_soon import LEARNT_SOON
from tests.libraries import build_libraries
from tests.progress import no_stages, silent
from tests.recipes import tiny_state_space_recipe

pytestmark = pytest.mark.extended

LONGER = {
    "starts": 1,
    "iterations": 20,
    "expert": {"start_iterations": 10, "kept": 1, "kept_iterations": 10},
}
"""Half of the iterations leave some networks with four times the error of others, so that what
forecasts add would not stand out."""
RECIPE = tiny_state_space_recipe(
    system={
        "model": "mbs_models.oscillators:DuffingBaseMotion",
        "parameters": {"damping": 40.0, "substeps": 6},
    },
    window={"planned": True},
    data={
        "train": 6,
        "duration": 2.5,
        "bound": 40,
        "calibration": 60,
        "excitation": [
            {
                "kind": "multisine",
                "weight": 1.0,
                "amplitude": [0.1, 0.6],
                "angular_frequency": [2.0, 30.0],
                "components": [2, 6],
            }
        ],
    },
    **{**LEARNT_SOON, "training": LONGER},
)
FRESH = 40
"""Trajectories that nothing has seen."""
SLACK = 0.03
"""What chance does to the covered share of as many trajectories, with some margin."""


@pytest.fixture(scope="module")
def surrogate(tmp_path_factory: pytest.TempPathFactory) -> Surrogate:
    folder = tmp_path_factory.mktemp("calls")
    with ThreadPoolExecutor(1) as pool:
        generate(case_of(RECIPE), folder / "trajectories", pool, silent)
    build_libraries()
    work = Work(case_of(RECIPE), folder / "trajectories", folder / "checkpoints", no_stages)
    return fit_surrogate(work).surrogate


CALLS = ("known", 1), ("plain", 1), ("plain", 2), ("plain", 5), ("plain", 8)
"""What is known of the inputs in a step, and how many steps make one of the FMU's own."""


Found = dict[tuple[str, int], tuple[FloatArray, FloatArray, FloatArray]]


@pytest.fixture(scope="module")
def found(surrogate: Surrogate, tmp_path_factory: pytest.TempPathFactory) -> Found:
    """Errors, bounds and the flag of all trajectories at samples after the start, by the call."""
    system = case_of(RECIPE).system
    stream = Stream(TEST, 92, (1.0, 1.0), RECIPE.data.duration)
    runs = [simulate_draw(system, draw(RECIPE, system, stream, i)) for i in range(FRESH)]
    path = export_fmu(surrogate, tmp_path_factory.mktemp("fmu") / "tiny.fmu")
    assert surrogate.bound is not None
    first = max(surrogate.window.n_in, surrogate.bound.filling_length)
    step, calls = surrogate.window.step, {}
    names = "position", "position_error_bound", "trusted"
    with unpacked(path) as fmu:
        for call, parts in CALLS:
            rows = []
            for run in runs:
                base, known = run.inputs[:, 0], {"inputs_at_step_end": float(call == "known")}
                given = base if call == "known" else between(base, parts)
                found = run_fmu(fmu, {"base": given}, names, known, step / parts)
                values = found.values[parts::parts]
                error = np.abs(values[:, 0] - run.outputs[1:, 0])
                rows.append(np.stack([error, *values[:, 1:].T])[:, first:])
            calls[call, parts] = tuple(np.stack(part) for part in zip(*rows, strict=True))
    return calls


def between(reached: FloatArray, parts: int) -> FloatArray:
    """An input at the begin of each step, by a smooth curve through what samples reach."""
    curve = CubicSpline(np.arange(len(reached) + 1), np.concatenate([reached[:1], reached]))
    return np.asarray(curve(np.arange(len(reached) * parts) / parts))


@pytest.mark.parametrize("call", CALLS)
def test_bound_covers_what_it_promises_in_each_call_and_step(
    found: Found, call: tuple[str, int]
) -> None:
    errors, bounds, _ = found[call]
    assert np.mean(errors <= bounds) > 0.95 - SLACK
    assert np.mean(bounds) < 5 * np.mean(errors)


def test_bound_has_what_forecasts_of_the_inputs_add_at_long_steps(found: Found) -> None:
    (own, own_bounds, _), (known, known_bounds, _) = found["plain", 1], found["known", 1]
    ratio = np.quantile(own, 0.95) / np.quantile(known, 0.95)
    assert ratio > 10
    assert 0.5 * ratio < np.median(own_bounds) / np.median(known_bounds) < 3 * ratio
    short, short_bounds, _ = found["plain", 8]
    assert np.quantile(short, 0.95) < 1.1 * np.quantile(known, 0.95)
    assert np.median(short_bounds) < 1.1 * np.median(known_bounds)


def test_tolerances_are_those_of_known_motions(found: Found) -> None:
    """The plain call is trusted like known motions as soon as steps are short enough."""
    assert RECIPE.bound is not None
    untrusted = {call: 1 - np.mean(trusted) for call, (*_, trusted) in found.items()}
    assert untrusted["known", 1] < 2 * RECIPE.bound.false_alarms
    assert untrusted["plain", 8] < 2 * RECIPE.bound.false_alarms
    assert untrusted["plain", 1] > untrusted["plain", 2] > 2 * untrusted["plain", 5]
