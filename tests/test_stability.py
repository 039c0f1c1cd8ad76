"""Networks that explode or do not forget are refused, in words; others pass."""

from __future__ import annotations

import json
import tomllib
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from fmu.samples import CellShape, random_cell
from recipes import TINY, merged, tiny_recipe

from slide_fmu.data.sampling import recipe_system
from slide_fmu.figures import stability_tests
from slide_fmu.learn.fit import range_scaling
from slide_fmu.network import FeedForward, Layer, Network
from slide_fmu.recipe import Recipe
from slide_fmu.stability import (
    NEWEST,
    RECORDS,
    AmplitudeTest,
    UnstableSurrogateError,
    check_stability,
    require_stability,
    stability_figures,
)
from slide_fmu.state_space import Cell, StateSpace
from slide_fmu.surrogate import Surrogate
from slide_fmu.window import Window

LINEAR_IS_LINEAR = 1e-3
"""Float32 roundings relative to the largest output, of which the growth is a quotient."""
AMPLITUDES = (1.0, 2.0, 4.0, 10.0)


def recipe_of(**stability: Any) -> Recipe:
    """The tiny recipe with a state-space network and limits of its own."""
    tables = tomllib.loads(TINY)
    del tables["network"], tables["training"]
    return Recipe.model_validate(merged(tables, {"stability": stability}))


RECIPE = recipe_of()
SYSTEM = recipe_system(RECIPE)


def surrogate_of(network: Network) -> Surrogate:
    window = Window(*(getattr(RECIPE.window, name) for name in ("step", "n_in", "n_out")))
    return Surrogate(
        "tiny", window, SYSTEM.inputs, SYSTEM.outputs, SYSTEM.hold,
        range_scaling(SYSTEM.inputs), range_scaling(SYSTEM.outputs), network,
    )  # fmt: skip


def network_of(cell: Cell) -> StateSpace:
    return StateSpace(cell, RECIPE.window.n_in, RECIPE.window.n_out, 1)


def scalar_cell(
    pole: float, gain: float = 1.0, effect: float = 0.0, units: str = "tanh", weight: float = 1.0
) -> Cell:
    """x -> pole x + gain u + effect act(weight x), y = x."""

    def matrix(*values: float) -> np.ndarray:
        return np.array([values], np.float32)

    zero = np.zeros(1, np.float32)
    row = matrix(weight, 0.0, 0.0)
    return Cell(
        matrix(pole), matrix(gain), matrix(effect), row, matrix(1.0), matrix(0.0), zero, units
    )


def examine(cell: Cell, recipe: Recipe = RECIPE) -> tuple[AmplitudeTest, ...]:
    return check_stability(surrogate_of(network_of(cell)), recipe, SYSTEM)


def refusal(tests: tuple[AmplitudeTest, ...], recipe: Recipe = RECIPE) -> str:
    with pytest.raises(UnstableSurrogateError) as caught:
        require_stability(tests, recipe, "runs/tiny/stability.png")
    return str(caught.value)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("shape", [CellShape(), CellShape(units=0), CellShape(6, 20)])
def test_random_network_that_contracts_passes(seed: int, shape: CellShape) -> None:
    tests = examine(random_cell(shape, 1, 1, seed))
    assert [test.amplitude for test in tests] == list(AMPLITUDES)
    assert all(test.problem is None for test in tests)
    assert tests[0].growth == pytest.approx(1.0)
    assert all(test.differences.shape == (RECORDS,) for test in tests)
    assert all(test.pair.shape == (2, RECIPE.window.n_in, 1) for test in tests)
    require_stability(tests, RECIPE, "nowhere.png")


def test_linear_network_grows_as_its_inputs_do() -> None:
    for test in examine(scalar_cell(0.8)):
        assert test.growth == pytest.approx(1.0, rel=LINEAR_IS_LINEAR)


def test_difference_is_what_a_pole_leaves() -> None:
    """Two runs of a linear cell differ by pole^n of what they differed before."""
    first, other = (examine(scalar_cell(pole))[0].differences for pole in (0.95, 0.9))
    n = RECIPE.window.n_in - (NEWEST - 1) / 2
    assert np.max(first) / np.max(other) == pytest.approx((0.95 / 0.9) ** n, rel=1.0)
    assert 0.1 * 0.95**n < np.median(first) < 10 * 0.95**n


@pytest.mark.parametrize("factor", [1.5, 3.0, 1e3])
def test_network_that_explodes_is_refused(factor: float) -> None:
    """Scaled so that it grows at once, with and without an overflow."""
    cell = random_cell(CellShape(), 1, 1, 0)
    scale = np.float32(factor / np.max(np.abs(np.linalg.eigvals(cell.a))))
    tests = examine(replace(cell, a=cell.a * scale))
    assert all(test.problem is not None for test in tests)
    message = refusal(tests)
    assert message.startswith("surrogate 'tiny' is not exported: at 1 times the trained amplitude")
    assert "see runs/tiny/stability.png" in message
    assert "stability.allow_unstable = true" in message
    assert ("grow inf times as fast" in message) == (factor > 2)
    assert ("still differ by" in message) == (factor < 2)
    assert stability_tests(tests, 0.1).startswith(b"\x89PNG")


def test_cubic_units_that_blow_up_beyond_the_range_are_refused() -> None:
    tests = examine(scalar_cell(0.5, 0.3, 0.05, "cubic"))
    assert [test.problem is None for test in tests][:2] == [True, True]
    assert tests[-1].problem is not None
    message = refusal(tests)
    assert "at 1 times" not in message
    assert "at 10 times the trained amplitude outputs grow inf times as fast" in message
    assert "expected at most 10 times" in message
    assert "tanh units" in message
    assert stability_tests(tests, 0.1).startswith(b"\x89PNG")
    bounded = examine(scalar_cell(0.5, 0.3, 0.05, "tanh"))
    assert all(test.problem is None for test in bounded)


def test_network_that_does_not_forget_is_refused() -> None:
    tests = examine(scalar_cell(0.9999))
    assert tests[0].problem is not None
    largest = float(np.max(tests[0].differences))
    assert largest > RECIPE.stability.contraction
    message = refusal(tests)
    assert (
        f"at 1 times the trained amplitude two runs from different states still differ by "
        f"{largest:.3g} of the outputs' RMS after one window (the worst pair); expected at most "
        "0.02"
    ) in message


def test_two_lasting_responses_are_judged_by_the_worst_pair_in_range_the_median_beyond() -> None:
    """x -> 0.5 x + 0.6 tanh(x) + u: left and right of zero; large inputs drive it across."""
    tests = examine(scalar_cell(0.5, 0.03, 0.6))
    assert "(the worst pair); expected at most 0.02" in str(tests[0].problem)
    assert "(the median pair); expected at most 0.5" in str(tests[1].problem)
    assert np.median(tests[1].differences) > 0.5
    # at ten times the amplitude most pairs meet, and some do not
    assert np.median(tests[3].differences) < 0.5 < np.max(tests[3].differences)
    assert tests[3].problem is None


def test_unstable_network_may_be_allowed() -> None:
    recipe = recipe_of(allow_unstable=True)
    tests = examine(scalar_cell(1.5), recipe)
    assert all(test.problem is not None for test in tests)
    require_stability(tests, recipe, "nowhere.png")


def test_limits_are_those_of_the_recipe() -> None:
    cell = scalar_cell(0.97)
    recipe = recipe_of(amplitudes=(1.0, 3.0), contraction=0.9, contraction_beyond=0.95)
    assert [test.amplitude for test in examine(cell, recipe)] == [1.0, 3.0]
    assert all(test.problem is None for test in examine(cell, recipe))
    strict = recipe_of(contraction=1e-4, contraction_beyond=1e-4)
    assert all(test.problem is not None for test in examine(cell, strict))
    narrow = recipe_of(growth=0.5)
    assert all("grow 1 times as fast" in str(test.problem) for test in examine(cell, narrow))


def test_figures_are_plain_numbers() -> None:
    fine, wild = (stability_figures(examine(scalar_cell(pole))) for pole in (0.8, 1e3))
    json.dumps([fine, wild], allow_nan=False)
    assert [row["amplitude"] for row in fine] == list(AMPLITUDES)
    assert all(row["passed"] and row["largest_difference"] >= row["median_difference"] >= 0
               for row in fine)  # fmt: skip
    assert all(not row["passed"] and row["growth"] is None for row in wild)


def test_tests_repeat_themselves() -> None:
    one, other = (examine(scalar_cell(0.9)) for _ in range(2))
    for a, b in zip(one, other, strict=True):
        assert np.array_equal(a.differences, b.differences)
        assert a.growth == b.growth


def test_networks_with_a_window_for_their_memory_are_not_tested() -> None:
    layer = Layer(np.ones((8, 48), np.float32), np.zeros(8, np.float32), "identity")
    surrogate = surrogate_of(FeedForward((layer,), 48, 1))
    assert check_stability(surrogate, tiny_recipe(), SYSTEM) == ()
    require_stability((), tiny_recipe(), "nowhere.png")
