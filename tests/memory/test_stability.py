"""Networks that explode or do not forget are refused, in words; others pass."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from slide_fmu.core.figures import plain
from slide_fmu.core.parameter_basis import ParameterBasis
from slide_fmu.core.scaling import Affine
from slide_fmu.core.signals import Signal
from slide_fmu.core.window import Window
from slide_fmu.data.draws import STABILITY, Stream, draw
from slide_fmu.features.differences import Differences
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.memory import stability
from slide_fmu.memory.stability import (
    SEQUENCES,
    AmplitudeTest,
    UnstableSurrogateError,
    check_stability,
    require_stability,
    stability_figures,
)
from slide_fmu.network.feed_forward.network import FeedForward, Layer
from slide_fmu.network.state_space.cell import Cell, Roles
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.network.state_space.polynomial import CellPolynomial
from slide_fmu.recipe.case import Case, case_of
from slide_fmu.recipe.recipe import ParameterRecipe, Recipe
from slide_fmu.recipe.system import SystemRecipe
from slide_fmu.report.learning_charts import stability_charts
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.samples import CellShape, random_cell
from tests.memory.small_cells import (
    CASE,
    INPUTS,
    RECIPE,
    SYSTEM,
    network_of,
    recipe_of,
    scalar_cell,
    surrogate_of,
)
from tests.recipes import tiny_recipe

MEAN_OF_RECORDS = 0.02
"""Of the outputs, relative to the largest: deviations from it are what grows."""
ROUNDED = 1e-3
"""Float32 in outputs a hundred times as large as their motion."""
AMPLITUDES = (1.0, 2.0, 4.0, 10.0)


def examine(cell: Cell, recipe: Recipe = RECIPE) -> tuple[AmplitudeTest, ...]:
    return check_stability(surrogate_of(network_of(cell)), CASE.with_recipe(recipe))


def refusal(tests: tuple[AmplitudeTest, ...], recipe: Recipe = RECIPE) -> str:
    with pytest.raises(UnstableSurrogateError) as caught:
        require_stability(tests, recipe, "runs/tiny/stability.html")
    return str(caught.value)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("shape", [CellShape(), CellShape(units=0), CellShape(6, 20)])
def test_random_network_that_contracts_passes(seed: int, shape: CellShape) -> None:
    tests = examine(random_cell(shape, 1, 1, seed))
    assert [test.amplitude for test in tests] == list(AMPLITUDES)
    assert all(test.problem is None for test in tests)
    assert tests[0].growth == pytest.approx(1.0)
    assert all(test.differences.shape == (SEQUENCES,) for test in tests)
    assert all(test.pair.shape == (2, RECIPE.window.n_in, 1) for test in tests)
    require_stability(tests, RECIPE, "nowhere.png")


def test_growth_and_differences_are_those_of_explicit_loops() -> None:
    """32 records of three windows: one to begin with, one in which two runs meet, and a third."""
    pole, gain, n = 0.97, 0.3, RECIPE.window.n_in
    scale, gaps = SYSTEM.inputs[0].high, []
    stream = Stream(STABILITY, RECIPE.data.seed, (1.0, 1.0), 3 * n * RECIPE.window.step)
    records = [draw(RECIPE, SYSTEM, stream, k).inputs[-3 * n :, 0] / scale for k in range(32)]

    def run(inputs: np.ndarray, state: float) -> list[float]:
        """x -> pole x + gain u, y = x; the output is that of the new state."""
        states = []
        for value in inputs:
            state = pole * state + gain * value
            states.append(state)
        return states

    runs = [run(record, 0.0) for record in records]
    own = [states[n : 2 * n] for states in runs]
    for k, record in enumerate(records):
        other = run(record[n : 2 * n], runs[k - 1][n - 1])
        last = [one - two for one, two in zip(own[k], other, strict=True)][-8:]
        gaps.append(math.sqrt(sum(gap**2 for gap in last) / 8) / np.std(own))
    mean = np.mean(runs)
    largest = np.max(np.abs(np.array(runs) - mean))
    first, second = examine(scalar_cell(pole, gain))[:2]
    assert first.differences == pytest.approx(gaps, rel=1e-3)
    assert first.growth == pytest.approx(1.0)
    deviations = 2 * np.array(runs) - mean  # twice the amplitude, about the mean of the first
    assert second.growth == pytest.approx(np.max(np.abs(deviations)) / (2 * largest), rel=1e-3)


@pytest.mark.parametrize(
    ("factor", "growth", "gaps", "limit"),
    [
        (1.0, 10.0, [0.02, 0.0, 0.0], None),  # at the limits of growth and of the worst pair
        (1.0, 10.01, [0.0, 0.0, 0.0], "at most 10 times"),
        (1.0, 1.0, [0.021, 0.0, 0.0], "at most 0.02"),
        (2.0, 1.0, [0.0, 0.5, 9.0], None),  # beyond the range the median pair counts
        (2.0, 1.0, [0.0, 0.51, 0.6], "at most 0.5"),
    ],
)
def test_limit_is_allowed_and_more_is_not(
    factor: float, growth: float, gaps: list[float], limit: str | None
) -> None:
    found = stability._problem(factor, "x", (growth, 10.0), np.array(gaps), RECIPE)
    assert (found is None) == (limit is None)
    assert found is None or found.endswith(limit or "")


@pytest.mark.parametrize("factor", [1.5, 3.0, 1e3])
def test_network_that_explodes_is_refused(factor: float) -> None:
    """Scaled so that it grows at once, with and without an overflow."""
    cell = random_cell(CellShape(), 1, 1, 0)
    scale = np.float32(factor / np.max(np.abs(np.linalg.eigvals(cell.a))))
    tests = examine(replace(cell, a=cell.a * scale))
    assert all(test.problem is not None for test in tests)
    message = refusal(tests)
    assert message.startswith("surrogate 'tiny' is not exported: at 1 times the trained amplitude")
    assert "see runs/tiny/stability.html" in message
    assert "stability.allow_unstable = true" in message
    assert ("grows inf times as fast" in message) == (factor > 2)
    assert ("still differ by" in message) == (factor < 2)
    assert_drawn(tests)


def test_cubic_units_that_blow_up_beyond_the_range_are_refused() -> None:
    tests = examine(scalar_cell(0.5, 0.3, 0.05, "cubic"))
    assert [test.problem is None for test in tests][:2] == [True, True]
    assert tests[-1].problem is not None
    message = refusal(tests)
    assert "at 1 times" not in message
    assert "at 10 times the trained amplitude output 'position' grows inf times as fast" in message
    assert "expected at most 10 times" in message
    assert "tanh units" in message
    assert_drawn(tests)
    bounded = examine(scalar_cell(0.5, 0.3, 0.05, "tanh"))
    assert all(test.problem is None for test in bounded)


def hardening_case(
    values: dict[str, float], parameters: dict[str, ParameterRecipe] | None = None
) -> Case:
    """The recipe's motions of ``Hardening`` with values of its arguments."""
    system = SystemRecipe(model="tests.memory.plain_systems:Hardening", parameters=dict(values))
    changes = {"system": system, "parameters": parameters or {}}
    return case_of(RECIPE.model_copy(update=changes))


def two_at_once(hard: float, soft: float) -> Cell:
    """Two states without memory, u + hard u^3 and u + soft u^3, and an output of each."""
    return Cell(
        np.zeros((2, 2), np.float32), np.ones((2, 1), np.float32),
        np.diag([hard, soft]).astype(np.float32),
        np.tile(np.array([0.0, 0.0, 1.0, 0.0], np.float32), (2, 1)), np.eye(2, dtype=np.float32),
        np.zeros((2, 1), np.float32), np.zeros(2, np.float32), "cubic",
    )  # fmt: skip


def examine_beside(cell: Cell | CellPolynomial, case: Case) -> AmplitudeTest:
    """Test a cell of two outputs at ten times the amplitude, beside the model of a case."""
    signals = case.system.outputs, case.system.inputs
    return check_stability(surrogate_of(network_of(cell), *signals), case)[-1]


def test_output_may_grow_as_that_of_a_model_that_hardens() -> None:
    cube = two_at_once(1.0, 0.0)
    soft, hard = (examine_beside(cube, hardening_case({"cube": value})) for value in (0.0, 1.0))
    assert soft.growth == hard.growth > stability.GROWTH
    assert "output 'hard' grows" in str(soft.problem)
    assert "expected at most 10 times" in str(soft.problem)
    assert hard.problem is None
    beyond = examine_beside(cube, hardening_case({"cube": 1.0, "most": 5.0}))
    assert "expected at most 10 times" in str(beyond.problem)  # nothing shows that it is right


def test_output_may_not_grow_as_another_output_of_the_model() -> None:
    """Both outputs of the network harden; of the model, one does."""
    test = examine_beside(two_at_once(1.0, 0.5), hardening_case({"cube": 1.0}))
    alone = examine_beside(two_at_once(0.0, 0.5), hardening_case({"cube": 1.0}))
    assert test.growth == alone.growth
    for one in (test, alone):
        assert "output 'soft' grows" in str(one.problem)
        assert "expected at most 10 times" in str(one.problem)


def test_model_beside_a_corner_has_the_values_of_the_corner() -> None:
    """Only at the end of the range, and not at its start value, the model hardens."""
    cubes = ParameterRecipe(range=(0.0, 1.0), start=0.0)
    basis = ParameterBasis.of_degree((cubes.parameter("cube"),), 1)
    middle, zero = two_at_once(0.5, 0.0), two_at_once(0.0, 0.0)
    slope = zero.with_arrays({name: 0 * part for name, part in zero.arrays().items()})
    slope = replace(slope, e=middle.e)  # 0.5 + 0.5 p, of p from -1 to 1
    known = CellPolynomial(basis, (middle, slope))
    assert np.array_equal(known.at(np.array([1.0])).e, two_at_once(1.0, 0.0).e)
    alike = examine_beside(known, hardening_case({}, {"cube": cubes}))
    assert alike.problem is None
    # where the model cannot be made at a corner, nothing shows that the network is right there
    other = examine_beside(known, hardening_case({"made": 0.5}, {"cube": cubes}))
    assert str(other.problem).startswith("with cube = 1, at 10 times the trained amplitude output")
    assert "output 'hard' grows" in str(other.problem)


def test_network_that_does_not_forget_is_refused() -> None:
    tests = examine(scalar_cell(0.9999))
    assert tests[0].problem is not None
    largest = float(np.max(tests[0].differences))
    assert largest > stability.CONTRACTION
    message = refusal(tests)
    assert (
        f"at 1 times the trained amplitude two runs from different states still differ by "
        f"{largest:.3g} of the output's standard deviation after one window (the worst pair); "
        "expected at most 0.02"
    ) in message
    remedies = "another training.seed, fewer units, tanh units (network.units), trajectories"
    assert (
        f"Train with {remedies} beyond the range (data.beyond) or a longer window, or" in message
    )


def constant_too(cell: Cell, value: float) -> Cell:
    """The cell with a constant in its output."""
    return replace(cell, d0=np.full_like(cell.d0, value))


@pytest.mark.parametrize("value", [-100.0, 3.0, 100.0])
def test_large_constant_output_hides_nothing(value: float) -> None:
    """Neither that a network does not forget, nor its growth; nor does it make a fault."""
    for pole in (0.8, 0.9999):
        plain, tests = examine(scalar_cell(pole)), examine(constant_too(scalar_cell(pole), value))
        for one, other in zip(plain, tests, strict=True):
            assert other.growth == pytest.approx(one.growth, rel=ROUNDED)
            assert other.differences == pytest.approx(one.differences, rel=ROUNDED, abs=1e-3)
        assert all((test.problem is None) == (pole == 0.8) for test in tests)
    bounded, cubic = (
        examine(constant_too(scalar_cell(0.5, 0.3, 0.05, units), value))
        for units in ("tanh", "cubic")
    )
    assert all(test.problem is None for test in bounded)
    assert "output 'position' grows inf times as fast" in str(cubic[-1].problem)


def two_outputs(poles: tuple[float, float], sizes: tuple[float, float]) -> Cell:
    """Two states side by side, and an output of each."""
    zero = np.zeros((2, 0), np.float32)
    return Cell(
        np.diag(poles).astype(np.float32), np.ones((2, 1), np.float32), zero,
        np.zeros((0, 4), np.float32), np.diag(sizes).astype(np.float32),
        np.zeros((2, 1), np.float32), np.zeros(2, np.float32),
    )  # fmt: skip


@pytest.mark.parametrize("sizes", [(1e3, 1e-3), (1.0, 1.0), (1e-3, 1e3)])
def test_worst_output_counts_however_small_it_is(sizes: tuple[float, float]) -> None:
    """The second output does not forget; what the first does, which forgets, hides nothing."""
    (position,) = SYSTEM.outputs
    outputs = (position, replace(position, name="other"))

    def examine_two(poles: tuple[float, float]) -> tuple[AmplitudeTest, ...]:
        surrogate = surrogate_of(network_of(two_outputs(poles, sizes)), outputs)
        return check_stability(surrogate, CASE)

    alone = examine(scalar_cell(0.9999))
    for one, both in zip(alone, examine_two((0.5, 0.9999)), strict=True):
        assert both.problem is not None
        assert both.differences == pytest.approx(one.differences, rel=ROUNDED)
        assert both.growth == pytest.approx(max(one.growth, 1.0), rel=MEAN_OF_RECORDS)
    assert all(test.problem is None for test in examine_two((0.5, 0.8)))


def test_problem_names_the_parameters_and_none_stays_none() -> None:
    class AtAny:
        """It stands for a surrogate with a parameter, whose network is the same at all values."""

        def __init__(self, cell: Cell) -> None:
            self._of = surrogate_of(network_of(cell))

        def at(self, corner: object) -> Surrogate:
            return self._of

        @property
        def outputs(self) -> tuple[Signal, ...]:
            return self._of.outputs

        @property
        def window(self) -> Window:
            return self._of.window

    known, factors = surrogate_of(network_of(scalar_cell(0.5))), {1.0, *AMPLITUDES}
    features = {f: stability.excited_features(known, RECIPE, SYSTEM, f) for f in factors}
    for pole, wanted in ((0.5, None), (1.5, "with mass = 2, ")):
        any_value: Any = AtAny(scalar_cell(pole))
        found = stability._tests_at({"mass": 2.0}, any_value, features, CASE)
        assert [test.problem and test.problem[:15] for test in found] == [wanted] * len(found)


@pytest.mark.parametrize("constant", [0.0, 3.0])
def test_network_that_answers_nothing_forgets_and_does_not_grow(constant: float) -> None:
    """No quotient of zeros; that it is wrong, its error tells."""
    for cell in (scalar_cell(0.0, 0.0), scalar_cell(0.5, 0.0)):
        tests = examine(constant_too(cell, constant))
        assert all(test.problem is None for test in tests)
        assert all(test.growth == 0 and not test.differences.any() for test in tests)
        json.dumps(plain(stability_figures(tests)), allow_nan=False)
        assert_drawn(tests)


def test_two_lasting_responses_are_judged_by_the_worst_pair_in_range_the_median_beyond() -> None:
    """x -> 0.5 x + 0.6 tanh(x) + u: left and right of zero; large inputs drive it across."""
    tests = examine(scalar_cell(0.5, 0.03, 0.6))
    assert "(the worst pair); expected at most 0.02" in str(tests[0].problem)
    assert "(the median pair); expected at most 0.5" in str(tests[1].problem)
    assert np.median(tests[1].differences) > 0.5
    # at ten times the amplitude most pairs meet, and some do not
    assert np.median(tests[3].differences) < 0.5 < np.max(tests[3].differences)
    assert tests[3].problem is None


def assert_drawn(tests: Sequence[AmplitudeTest]) -> None:
    """All amplitudes have a chart with the verdict; what is not a number makes a gap."""
    charts = stability_charts(tests, 0.1)
    assert [chart.title.endswith(": passed") for chart in charts] == [
        test.problem is None for test in tests
    ]
    for chart in charts:
        for line in chart.panels[0].lines:
            assert not np.isinf(line.y).any()


def gated_cell(pole: float, effect: float, factor: float = 0.0) -> StateSpace:
    """x -> (pole + effect tanh(u)) x + u, y = (1 + factor u) x."""
    one, zero = np.ones((1, 1), np.float32), np.zeros((1, 1), np.float32)
    cell = Cell(
        pole * one, one, effect * one, np.array([[1.0, 0.0]], np.float32),
        np.array([[1.0], [factor]], np.float32), np.zeros((2, 1), np.float32),
        np.zeros(2, np.float32), "gated", np.concatenate([one, zero], 1),
    )  # fmt: skip
    roles = Roles((0,), (0,), (0,), (0,), (0,))
    return StateSpace(cell, RECIPE.window.n_in, RECIPE.window.n_out, INPUTS, roles)


def test_gated_units_that_open_too_far_beyond_the_range_are_refused() -> None:
    """Half open they contract; wide open, as large inputs hold them, they grow without bound."""
    fine, wild = (
        check_stability(surrogate_of(gated_cell(0.5, effect)), CASE) for effect in (0.3, 1.2)
    )
    assert all(test.problem is None for test in fine)
    assert "output 'position' grows" in str(wild[-1].problem)
    assert_drawn(wild)


def test_factors_let_outputs_grow_faster_than_the_inputs() -> None:
    """With a factor that follows the input, as its square."""
    tests = check_stability(surrogate_of(gated_cell(0.5, 0.0, factor=1e3)), CASE)
    for test in tests:
        assert test.growth == pytest.approx(test.amplitude, rel=0.3)


def test_records_are_seen_through_the_features() -> None:
    """A network that sees changes alone, divided by a scale, answers as one that forms them."""
    cell = scalar_cell(0.8)
    window = RECIPE.window
    changes = FeatureMap(Differences(1, 1), (1,), scaling=Affine.of_channels([0], [0.25]))
    network = StateSpace(cell, window.n_in, window.n_out, changes)
    both = FeatureMap(Differences(1, 1))
    column = np.zeros((1, 1), np.float32)
    wide = replace(
        cell,
        b=np.concatenate([column, 4 * cell.b], 1),
        w=np.insert(cell.w, 2, 0, axis=1),
        d=np.concatenate([cell.d, column], 1),
    )
    other = StateSpace(wide, window.n_in, window.n_out, both)
    found, expected = (check_stability(surrogate_of(one), CASE) for one in (network, other))
    for one, two in zip(found, expected, strict=True):
        assert one.growth == pytest.approx(two.growth, rel=ROUNDED)
        assert one.differences == pytest.approx(two.differences, rel=ROUNDED, abs=1e-6)


def test_unstable_network_may_be_allowed() -> None:
    recipe = recipe_of(allow_unstable=True)
    tests = examine(scalar_cell(1.5), recipe)
    assert all(test.problem is not None for test in tests)
    require_stability(tests, recipe, "nowhere.png")


def test_limits_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    cell = scalar_cell(0.97)
    monkeypatch.setattr(stability, "CONTRACTION", 0.9)
    recipe = recipe_of(amplitudes=(1.0, 3.0), contraction_beyond=0.95)
    assert [test.amplitude for test in examine(cell, recipe)] == [1.0, 3.0]
    assert all(test.problem is None for test in examine(cell, recipe))
    monkeypatch.setattr(stability, "CONTRACTION", 1e-4)
    strict = recipe_of(contraction_beyond=1e-4)
    assert all(test.problem is not None for test in examine(cell, strict))
    monkeypatch.setattr(stability, "GROWTH", 0.5)
    monkeypatch.setattr(stability, "BESIDE_MODEL", 0.0)
    for test in examine(cell, RECIPE):
        grown = rf"'position' grows {test.growth:.3g} times as fast .* at most 0\.5 times"
        assert re.search(grown, str(test.problem))
        assert test.growth == pytest.approx(1.0, rel=2 * MEAN_OF_RECORDS)


def test_stability_figures_are_plain_numbers() -> None:
    fine, wild = (stability_figures(examine(scalar_cell(pole))) for pole in (0.8, 1e3))
    json.dumps(plain([fine, wild]), allow_nan=False)
    assert [row.amplitude for row in fine] == list(AMPLITUDES)
    assert all(row.passed and row.largest_difference >= row.median_difference >= 0
               for row in fine)  # fmt: skip
    assert all(not row.passed and row.growth is None for row in wild)


def test_stability_figures_are_those_of_the_median_and_of_the_worst_pair() -> None:
    test = AmplitudeTest(2.0, 1.5, np.array([0.25, 0.0, 4.0]), np.zeros((2, 1, 1)), None)
    (found,) = stability_figures((test,))
    assert (found.median_difference, found.largest_difference) == (0.25, 4.0)


def test_networks_with_a_window_for_their_memory_are_not_tested() -> None:
    layer = Layer(np.ones((8, 48), np.float32), np.zeros(8, np.float32), "identity")
    surrogate = surrogate_of(FeedForward((layer,), 48, INPUTS))
    assert check_stability(surrogate, case_of(tiny_recipe())) == ()
    require_stability((), tiny_recipe(), "nowhere.png")
