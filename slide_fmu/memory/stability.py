"""A state-space network must forget its state and stay bounded, also beyond its trained amplitude.

Fading memory (contraction in the recipe and in the figures): runs from different states under the
same inputs meet within one window; otherwise the window does not cover the response.
Boundedness (growth): an output grows at most by a given factor faster than the inputs, or than the
same output of the model where that grows faster, as by a spring that hardens. Both are tested on
sequences of the recipe's excitation at several amplitudes; this is not a proof.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from slide_fmu.core.parameters import corners_of
from slide_fmu.core.signals import FloatArray
from slide_fmu.data.answers import asked_of_sources
from slide_fmu.data.draws import STABILITY, Stream, draw_inputs
from slide_fmu.data.parameter_draws import case_at
from slide_fmu.memory.decay_figures import finite
from slide_fmu.network.base import Float32Array
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.recipe.case import Case
from slide_fmu.recipe.model_rules import rules_of
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import Source, System
from slide_fmu.systems.errors import SimulationError
from slide_fmu.systems.simulation import simulate

SEQUENCES = 32
"""Number of input sequences for the test at every amplitude."""
MODEL_SEQUENCES = 8
"""Number of them that a model simulates, where its own growth is asked for."""
WINDOWS = 3
"""Length of a sequence in input windows: in the first a usual state is reached, in the second two
runs must meet, and in the third the run continues."""
GROWTH = 10.0
"""Boundedness: the largest allowed deviation of an output from its mean, relative to the largest
one at the trained amplitude times the factor."""
BESIDE_MODEL = 3.0
"""Boundedness: an output that grows faster may have this many times the model's deviation at the
same amplitude. So far beyond its range no network is right; it must only stay finite and
sensible."""
CONTRACTION = 0.02
"""Fading memory: the largest allowed difference of two runs from different states after the inputs
of one window, relative to the output's standard deviation."""
NEWEST = 8
"""Number of last samples in the RMS of a difference: a single one may be zero by chance."""


class UnstableSurrogateError(ValueError):
    """A network grows without bound, or does not forget its state within its window."""


@dataclass(frozen=True, eq=False)
class AmplitudeTest:
    """An AmplitudeTest has the results at one amplitude.

    Attributes:
        amplitude: factor on the excitation's amplitude.
        growth: largest deviation of an output from its mean at amplitude 1, relative to the
            largest deviation there times the factor, of the output that is nearest to its limit or
            farthest beyond it; 1 is proportional growth, infinite stands for outputs that are not
            finite.
        differences: difference of two runs at the end of a window, relative to the output's
            standard deviation, of the worst output, one for each sequence, shape (R,); infinite if
            a run is not finite.
        pair: outputs of the two runs of the worst sequence along the window, in scaled units,
            shape (2, n_in, n_outputs).
        problem: the fault, as text; None if the test has passed.
    """

    amplitude: float
    growth: float
    differences: FloatArray
    pair: FloatArray
    problem: str | None


@dataclass(frozen=True, kw_only=True)
class StabilityFigures:
    """StabilityFigures are the figures of an amplitude test for JSON files: None is infinity."""

    amplitude: float
    growth: float | None
    median_difference: float | None
    largest_difference: float | None
    passed: bool


def check_stability(surrogate: Surrogate, case: Case) -> tuple[AmplitudeTest, ...]:
    """Test a state-space surrogate at all amplitudes of the case's recipe, one test each.

    With physical parameters it is the worst test at the corners of their box, with inputs of the
    system at their start values. Other networks are not tested, since their memory is their
    window.
    """
    if not isinstance(surrogate.network, StateSpace):
        return ()
    source, recipe = case.source, case.recipe
    features = {
        factor: excited_features(surrogate, recipe, source, factor)
        for factor in {1.0, *recipe.stability.amplitudes}
    }
    corners = tested_corners(source, surrogate, recipe) if surrogate.parameters else [{}]
    of_corners = [_tests_at(corner, surrogate, features, case) for corner in corners]
    return tuple(max(tests, key=_badness) for tests in zip(*of_corners, strict=True))


def _tests_at(
    corner: dict[str, float],
    surrogate: Surrogate,
    features: Mapping[float, Float32Array],
    case: Case,
) -> list[AmplitudeTest]:
    """Test a surrogate with values of its parameters, and features by their amplitude."""
    network, recipe = surrogate.at(corner).network, case.recipe
    assert isinstance(network, StateSpace)
    names = [signal.name for signal in surrogate.outputs]
    count = WINDOWS * surrogate.window.n_in

    def model_growth(factor: float) -> FloatArray:
        return simulated_growth(case.source, case, corner, count, factor)

    # a network that diverges overflows: the test reports it, so numpy need not warn
    with np.errstate(over="ignore", invalid="ignore"):
        unit, _ = network.run(features[1.0])
    tests = [
        _test(network, features[factor], (factor, unit), recipe, names, model_growth)
        for factor in recipe.stability.amplitudes
    ]
    where = ", ".join(f"{name} = {value:g}" for name, value in corner.items())
    return [
        replace(test, problem=f"with {where}, {test.problem}") if where and test.problem else test
        for test in tests
    ]


def _badness(test: AmplitudeTest) -> tuple[bool, float]:
    """Return a sort key: failed tests last, then by the largest difference."""
    return test.problem is not None, float(np.max(test.differences))


def require_stability(tests: tuple[AmplitudeTest, ...], recipe: Recipe, picture: str) -> None:
    """Refuse a network that failed a test, unless the recipe sets ``allow_unstable``.

    Raises:
        UnstableSurrogateError: a test failed; the message has all failures, the remedy, and the
            picture of the tests (``picture``).
    """
    problems = [test.problem for test in tests if test.problem is not None]
    if problems and not recipe.stability.allow_unstable:
        # beyond records nothing is known
        more = "trajectories beyond the range (data.beyond) " if recipe.data.excitation else ""
        raise UnstableSurrogateError(
            f"surrogate {recipe.name!r} is not exported: {'; '.join(problems)}; see {picture}. "
            "Train with another training.seed, fewer units, tanh units (network.units), "
            f"{more}or a longer window, or set stability.allow_unstable = true"
        )


def stability_figures(tests: tuple[AmplitudeTest, ...]) -> tuple[StabilityFigures, ...]:
    """Return the figures of the tests."""
    return tuple(
        StabilityFigures(
            amplitude=test.amplitude,
            growth=finite(test.growth),
            median_difference=finite(float(np.median(test.differences))),
            largest_difference=finite(float(np.max(test.differences))),
            passed=test.problem is None,
        )
        for test in tests
    )


def _test(
    network: StateSpace,
    features: Float32Array,
    reference: tuple[float, Float32Array],
    recipe: Recipe,
    names: Sequence[str],
    model_growth: Callable[[float], FloatArray],
) -> AmplitudeTest:
    """Test boundedness along whole sequences, and fading memory in their second window.

    Features have the shape (R, WINDOWS n_in, n_features). The reference has the factor on the
    amplitude and the outputs at amplitude 1. ``names`` are those of the outputs, and
    ``model_growth`` gives the growth of each output of the model, (n_outputs,), at an amplitude.
    """
    (factor, unit), n = reference, network.n_samples
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        first, states = network.run(features[:, :n])
        inputs = features[:, n : 2 * n]
        own, ends = network.run(inputs, states)
        # the other run of a pair starts from the state of the next sequence
        other, _ = network.run(inputs, np.roll(states, 1, axis=0))
        last, _ = network.run(features[:, 2 * n :], ends)
        middle = unit.mean(axis=(0, 1), dtype=np.float64)
        peak = np.abs(np.concatenate([first, own, last], axis=1) - middle).max(axis=(0, 1))
        largest = _at_least_tiny(np.abs(unit - middle).max(axis=(0, 1)))
        gap = np.square((own - other)[:, -NEWEST:], dtype=np.float64).mean(axis=1)
        ratio = np.sqrt(gap) / _at_least_tiny(own.std(axis=(0, 1), dtype=np.float64))
        differences = np.nan_to_num(ratio, nan=np.inf, posinf=np.inf).max(axis=1)
        growths = np.nan_to_num(peak / (factor * largest), nan=np.inf, posinf=np.inf)
    limits = np.full(len(growths), GROWTH)
    # no model makes outputs that are not finite right, so that it need not be simulated
    if growths.max() > GROWTH and np.isfinite(growths).all():
        limits = np.maximum(limits, BESIDE_MODEL * model_growth(factor))
    output = int(np.argmax(growths / limits))
    growth, limit = float(growths[output]), float(limits[output])
    worst = int(np.argmax(differences))
    pair = np.stack([own[worst], other[worst]]).astype(np.float64)
    problem = _problem(factor, names[output], (growth, limit), differences, recipe)
    return AmplitudeTest(factor, growth, differences, pair, problem)


def _at_least_tiny(values: FloatArray) -> FloatArray:
    """Return values to divide by: an output that never moves must not move later either."""
    return np.maximum(values, np.finfo(np.float32).tiny)


def _problem(
    factor: float, output: str, grown: tuple[float, float], gaps: FloatArray, recipe: Recipe
) -> str | None:
    """Describe the limit that a test exceeds; None if it passes.

    ``grown`` has the growth of an output and its limit.
    """
    growth, most = grown
    if not growth <= most:
        return (
            f"at {factor:g} times the trained amplitude output {output!r} grows {growth:.3g} "
            f"times as fast as the inputs; expected at most {most:.3g} times"
        )
    # beyond the trained amplitude single pairs may stay apart, so the median pair decides
    beyond = factor > 1
    gap = float(np.median(gaps) if beyond else np.max(gaps))
    limit = recipe.stability.contraction_beyond if beyond else CONTRACTION
    if not gap <= limit:
        cause = rules_of(recipe).words.lasting_memory
        which = "the median pair" if beyond else "the worst pair"
        return (
            f"at {factor:g} times the trained amplitude two runs from different states still "
            f"differ by {gap:.3g} of the output's standard deviation after one window ({which}); "
            f"expected at most {limit:g}{'' if beyond else cause}"
        )
    return None


def excited_features(
    surrogate: Surrogate, recipe: Recipe, source: Source, factor: float
) -> Float32Array:
    """Return inputs of the recipe's motions as features.

    The shape is (SEQUENCES, WINDOWS n_in, n_features); the factor multiplies the amplitude.
    """
    assert isinstance(surrogate.network, StateSpace)
    count = WINDOWS * surrogate.window.n_in
    inputs = excited_inputs(source, recipe, count, factor)
    return surrogate.network.features.along(surrogate.input_scaling.apply(inputs))


@asked_of_sources
def excited_inputs(system: System, recipe: Recipe, count: int, factor: float) -> FloatArray:
    """Draw inputs of the recipe's excitation, shape (SEQUENCES, count, n_inputs).

    The factor is that on the amplitude.
    """
    stream = Stream(STABILITY, recipe.data.seed, (factor, factor), count * recipe.window.step)
    return np.array(
        [draw_inputs(recipe, system, stream, i).inputs[-count:] for i in range(SEQUENCES)]
    )


@asked_of_sources
def simulated_growth(
    system: System, case: Case, values: dict[str, float], count: int, factor: float
) -> FloatArray:
    """Return the growth of each output of the model, (n_outputs,), defined as that of a network.

    The model has ``values`` of its physical parameters, as the network beside it has. The growth
    is 0, so that it allows nothing, where the model cannot be made or simulated with them at this
    factor on the amplitude.
    """
    try:
        own = case_at(case, values).system
        unit, large = (
            np.array([simulate(own, inputs).outputs[1:] for inputs in sequences])
            for sequences in (
                excited_inputs(system, case.recipe, count, amplitude)[:MODEL_SEQUENCES]
                for amplitude in (1.0, factor)
            )
        )
    except SimulationError:
        return np.zeros(len(system.outputs))
    middle = unit.mean(axis=(0, 1))
    largest = _at_least_tiny(np.abs(unit - middle).max(axis=(0, 1)))
    growth: FloatArray = np.abs(large - middle).max(axis=(0, 1)) / (factor * largest)
    return growth


@asked_of_sources
def tested_corners(system: System, surrogate: Surrogate, recipe: Recipe) -> list[dict[str, float]]:
    """Return values of the physical parameters at which a surrogate is tested."""
    return corners_of(surrogate.parameters)
