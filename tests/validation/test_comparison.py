"""The scored samples of a trajectory and the true error of an estimate, by explicit loops."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slide_fmu.core.scaling import LogError
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import Window
from slide_fmu.cosim.whole_run import run_fmu
from slide_fmu.data.draws import TEST, Draw, Stream, draw
from slide_fmu.features.differences import Differences
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.fmu.export import export_fmu
from slide_fmu.importer.file import unpacked
from slide_fmu.network.feed_forward.network import FeedForward, Layer
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.surrogate.error_estimator import ErrorEstimator
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.simulation import simulate
from slide_fmu.validation.comparison import Comparison, compare_with_truth
from slide_fmu.validation.task import Task
from slide_fmu.validation.validate import validate
from tests.bounded import bounded_surrogate
from tests.fmu.samples import CellShape, Shape, sum_surrogate
from tests.libraries import build_libraries
from tests.recipes import tiny_recipe

SAMPLES, SPAN = 20, 3
"""Inputs that the network needs, and samples that an estimate is about."""

EXACT = 1e-12
"""Relative: the same sums in another order."""


def recipe_of(burn_in: int) -> Recipe:
    """The tiny recipe with so many samples of burn-in."""
    return tiny_recipe(data={"burn_in": burn_in / 64, "duration": 1.0})


def surrogate_of(recipe: Recipe) -> Surrogate:
    """The sum of the last inputs, with an estimator that answers the same everywhere."""
    system, features = case_of(recipe).system, FeatureMap(Differences(1))
    flat = Layer(np.zeros((1, 1), np.float32), np.zeros(1, np.float32), "identity")
    ranges = np.array([[-1e9], [1e9]], np.float32)
    estimator = ErrorEstimator(FeedForward((flat,), 1, features), LogError(-3, 1), SPAN, ranges)
    return replace(
        sum_surrogate(SAMPLES),
        name="tiny",
        window=Window(recipe.window.step, SAMPLES, 1),
        inputs=system.inputs,
        outputs=system.outputs,
        estimator=estimator,
    )


@pytest.fixture(scope="module", params=[0, 16, 25], ids="burn_in_{}".format)
def measured(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Recipe, Surrogate, Comparison]:
    """One trajectory: its burn-in is nothing, shorter and longer than what the network needs."""
    build_libraries()
    recipe = recipe_of(request.param)
    surrogate = surrogate_of(recipe)
    fmu = export_fmu(surrogate, tmp_path_factory.mktemp("fmu") / "tiny.fmu")
    found = validate(
        fmu, surrogate, case_of(recipe), Task(3, trajectories=1), lambda done, total: None
    )
    return recipe, surrogate, found.comparisons[0]


Measured = tuple[Recipe, Surrogate, Comparison]


def first_scored(recipe: Recipe) -> int:
    """Index of the first sample after the burn-in whose inputs were all set."""
    return max(round(recipe.data.burn_in / recipe.window.step) + 1, SAMPLES)


def test_scores_begin_after_the_burn_in_where_all_inputs_were_set(measured: Measured) -> None:
    recipe, _, found = measured
    system, first = case_of(recipe).system, first_scored(recipe)
    drawn = draw(recipe, system, Stream(TEST, 3, (1.0, 1.0), recipe.data.duration), 0)
    true = simulate(system, drawn.inputs, drawn.initial).outputs
    assert found.time[0] == pytest.approx(first * recipe.window.step)
    assert np.diff(found.time) == pytest.approx(recipe.window.step)
    assert len(found.time) == len(true) - first
    assert found.reference == pytest.approx(true[first:], abs=EXACT)
    np.testing.assert_array_equal(found.inputs, drawn.inputs[first - 1 :])
    for row in range(len(found.time)):
        newest = first + row  # an output rests on the inputs before it
        expected = np.sum(drawn.inputs[newest - SAMPLES : newest])
        assert found.surrogate[row, 0] == pytest.approx(expected, rel=1e-5, abs=1e-2)


def test_true_error_is_that_of_the_span_which_ends_at_the_sample(measured: Measured) -> None:
    found = measured[2]
    error = found.surrogate - found.reference
    assert np.isnan(found.true_error[: SPAN - 1]).all()
    for row in range(SPAN - 1, len(error)):
        squares = [error[row - back, 0] ** 2 for back in range(SPAN)]
        expected = math.sqrt(sum(squares) / SPAN)
        assert found.true_error[row, 0] == pytest.approx(expected, rel=1e-9)
    assert len(np.unique(found.true_error[SPAN - 1 :])) > 10  # a shift would be seen


def test_fmu_that_is_as_short_as_its_span_still_has_one_true_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The shortest trajectory that a recipe allows scores one estimate; a shorter one, none."""
    recipe = recipe_of(16)
    surrogate, shortest = surrogate_of(recipe), (SAMPLES + SPAN - 1 - 16) * recipe.window.step
    fmu = export_fmu(surrogate, tmp_path / "tiny.fmu")
    monkeypatch.setattr(Recipe, "shortest_validation", lambda self: 0.0)

    def run(duration: float) -> Comparison:
        task = Task(3, trajectories=1, duration=duration)
        return validate(fmu, surrogate, case_of(recipe), task, lambda *numbers: None).comparisons[
            0
        ]

    assert np.isfinite(run(shortest).true_error).sum() == 1
    assert np.isnan(run(shortest - recipe.window.step).true_error).all()


def test_estimates_are_those_of_the_fmu_at_the_scored_samples(measured: Measured) -> None:
    _, surrogate, found = measured
    assert found.estimate is not None
    middle = 10**-1.0 * surrogate.output_scaling.scale[0]
    assert found.estimate.shape == found.reference.shape
    assert found.estimate == pytest.approx(middle, rel=1e-5)


ROUNDED = 1e-3
"""Relative: the head sees logarithms of differences in single precision."""
ERROR = 0.25
"""The truth is the surrogate's output minus this."""

HELD = Shape(
    n_in=9, n_out=4, n_inputs=2, n_outputs=2, differences=1, cell=CellShape(contraction=0.9)
)
MOVING = replace(HELD, hold="first_order", forecasts=True)


def known_inputs() -> FloatArray:
    return np.random.default_rng(4).uniform(-1, 1, (120, 2))


def compared(surrogate: Surrogate, fmu: Path, burn_in: int) -> Comparison:
    """Compare an FMU with a truth from which its outputs differ by ``ERROR`` everywhere."""
    build_libraries()
    inputs = known_inputs()
    outputs = surrogate.predict_newest(inputs) - ERROR
    truth = np.concatenate([outputs[:1], outputs])
    drawn = Draw(kind=3, factor=1.0, initial=None, inputs=inputs, burn_in=burn_in)
    with unpacked(export_fmu(surrogate, fmu)) as opened:
        return compare_with_truth(opened, surrogate, drawn, truth, np.zeros(0))


@pytest.mark.parametrize("burn_in", [0, 30, 100])
def test_bounds_count_from_the_sample_on_that_fills_them(burn_in: int, tmp_path: Path) -> None:
    surrogate, inputs = bounded_surrogate(HELD), known_inputs()
    found = compared(surrogate, tmp_path / "bounded.fmu", burn_in)
    assert surrogate.bound is not None
    first = max(burn_in + 1, surrogate.network.memory_length)
    assert found.first_trusted == max(0, surrogate.bound.filling_length - first)
    assert (found.first_trusted == 0) == (burn_in == 100)
    assert found.trust is not None
    trust = surrogate.trust(inputs)
    bounds = trust.bounds(0.95)[first - 1 :]
    np.testing.assert_allclose(found.trust.bounds, bounds, rtol=ROUNDED)
    novelty = trust.novelty[first - 1 :]
    np.testing.assert_allclose(found.trust.novelty, novelty, rtol=ROUNDED)
    np.testing.assert_allclose(found.error, ERROR, rtol=ROUNDED)
    assert found.plain is None  # held inputs have one way to be set


def test_moving_inputs_are_set_to_both_ends_of_a_step(tmp_path: Path) -> None:
    surrogate, inputs = bounded_surrogate(MOVING), known_inputs()
    found = compared(surrogate, tmp_path / "moving.fmu", 30)
    np.testing.assert_allclose(found.error, ERROR, rtol=ROUNDED)
    names = [signal.name for signal in surrogate.outputs]
    now = np.concatenate([inputs[:1], inputs[:-1]])
    values = {signal.name: now[:, i] for i, signal in enumerate(surrogate.inputs)}
    with unpacked(tmp_path / "moving.fmu") as opened:
        expected = run_fmu(opened, values, names, {}, surrogate.window.step).values[31:]
    assert found.plain is not None
    np.testing.assert_array_equal(found.plain.surrogate, expected)
    assert np.abs(found.plain.surrogate - found.surrogate).max() > ROUNDED
    assert found.plain.trust is not None
