"""Does a state-space network forget its state, and stay bounded, beyond its trained amplitude too?

Contraction: runs from different states under the same inputs meet within one window; else the
window does not hold the response. Growth: outputs stay bounded when the inputs grow.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.data.draws import STABILITY, Stream, draw
from slide_fmu.network.base import Float32Array
from slide_fmu.network.state_space import StateSpace
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import System

RECORDS = 32
"""Records of inputs at every amplitude."""
WINDOWS = 3
"""Length of a record in input windows: until a state is usual, until two have met, and more."""
NEWEST = 8
"""Last samples over which a difference is taken: at a single one it may be zero by chance."""


class UnstableSurrogateError(ValueError):
    """A network grows without bound, or does not forget its state within its window."""


@dataclass(frozen=True, eq=False)
class AmplitudeTest:
    """The test at one amplitude.

    Attributes:
        amplitude: factor on the excitation's amplitude.
        growth: largest deviation of an output from its mean at amplitude 1, relative to the
            largest there times the factor; of the worst output.
        differences: of two runs at the end of a window, relative to the output's standard
            deviation, of the worst output, one per record, shape (R,); infinite where a run is
            not finite.
        pair: outputs of two runs along the window, of the worst record, scaled,
            shape (2, n_in, n_outputs).
        problem: what is wrong, in words; None if nothing.
    """

    amplitude: float
    growth: float
    differences: FloatArray
    pair: FloatArray
    problem: str | None


def check_stability(
    surrogate: Surrogate, recipe: Recipe, system: System
) -> tuple[AmplitudeTest, ...]:
    """Test a state-space surrogate at all amplitudes of its recipe.

    Returns:
        One test per amplitude; none for other networks, whose memory is their window.
    """
    network = surrogate.network
    if not isinstance(network, StateSpace):
        return ()
    with np.errstate(over="ignore", invalid="ignore"):
        unit, _ = network.run(_records(surrogate, recipe, system, 1.0))
    return tuple(
        _test(network, _records(surrogate, recipe, system, factor), (factor, unit), recipe)
        for factor in recipe.stability.amplitudes
    )


def require_stability(tests: tuple[AmplitudeTest, ...], recipe: Recipe, picture: str) -> None:
    """Refuse a network that failed a test, unless the recipe says ``allow_unstable``.

    Args:
        picture: where the tests can be seen.

    Raises:
        UnstableSurrogateError: with every failure and the remedy.
    """
    problems = [test.problem for test in tests if test.problem is not None]
    if problems and not recipe.stability.allow_unstable:
        raise UnstableSurrogateError(
            f"surrogate {recipe.name!r} is not exported: {'; '.join(problems)}; see {picture}. "
            "Train with another training.seed, fewer units, tanh units (network.units), "
            "trajectories beyond the range (data.beyond) or a longer window, or set "
            "stability.allow_unstable = true"
        )


def stability_figures(tests: tuple[AmplitudeTest, ...]) -> list[dict[str, Any]]:
    """The figures as plain values, as written to JSON."""
    return [
        {
            "amplitude": test.amplitude,
            "growth": _finite(test.growth),
            "median_difference": _finite(float(np.median(test.differences))),
            "largest_difference": _finite(float(np.max(test.differences))),
            "passed": test.problem is None,
        }
        for test in tests
    ]


def _test(
    network: StateSpace,
    features: Float32Array,
    reference: tuple[float, Float32Array],
    recipe: Recipe,
) -> AmplitudeTest:
    """Growth along records, and contraction of pairs of runs in their second window.

    Args:
        reference: factor on the amplitude, and outputs at amplitude 1.
    """
    (factor, unit), n = reference, network.n_samples
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        first, states = network.run(features[:, :n])
        inputs = features[:, n : 2 * n]
        own, ends = network.run(inputs, states)
        other, _ = network.run(inputs, np.roll(states, 1, axis=0))
        last, _ = network.run(features[:, 2 * n :], ends)
        middle = unit.mean(axis=(0, 1), dtype=np.float64)
        peak = np.abs(np.concatenate([first, own, last], axis=1) - middle).max(axis=(0, 1))
        largest = _at_least_tiny(np.abs(unit - middle).max(axis=(0, 1)))
        gap = np.square((own - other)[:, -NEWEST:], dtype=np.float64).mean(axis=1)
        ratio = np.sqrt(gap) / _at_least_tiny(own.std(axis=(0, 1), dtype=np.float64))
        differences = np.nan_to_num(ratio, nan=np.inf, posinf=np.inf).max(axis=1)
        growth = np.nan_to_num(peak / (factor * largest), nan=np.inf, posinf=np.inf).max()
    worst = int(np.argmax(differences))
    pair = np.stack([own[worst], other[worst]]).astype(np.float64)
    problem = _problem(factor, float(growth), differences, recipe)
    return AmplitudeTest(factor, float(growth), differences, pair, problem)


def _at_least_tiny(values: FloatArray) -> FloatArray:
    """Values to divide by: an output that never moves shall not move later either."""
    return np.maximum(values, np.finfo(np.float32).tiny)


def _problem(factor: float, growth: float, gaps: FloatArray, recipe: Recipe) -> str | None:
    limits = recipe.stability
    if not growth <= limits.growth:
        return (
            f"at {factor:g} times the trained amplitude outputs grow {growth:.3g} times as fast "
            f"as the inputs; expected at most {limits.growth:g} times"
        )
    beyond = factor > 1
    gap = float(np.median(gaps) if beyond else np.max(gaps))
    limit = limits.contraction_beyond if beyond else limits.contraction
    if not gap <= limit:
        which = "the median pair" if beyond else "the worst pair"
        return (
            f"at {factor:g} times the trained amplitude two runs from different states still "
            f"differ by {gap:.3g} of the output's standard deviation after one window ({which}); "
            f"expected at most {limit:g}"
        )
    return None


def _records(surrogate: Surrogate, recipe: Recipe, system: System, factor: float) -> Float32Array:
    """Features of records of the recipe's excitation, (RECORDS, WINDOWS n_in, q)."""
    assert isinstance(surrogate.network, StateSpace)
    count = WINDOWS * surrogate.window.n_in
    duration = count * surrogate.window.step
    stream = Stream(STABILITY, recipe.data.seed, (factor, factor), duration)
    drawn = [draw(recipe, system, stream, index).inputs[-count:] for index in range(RECORDS)]
    return surrogate.network.features.along(surrogate.input_scaling.apply(np.array(drawn)))


def _finite(value: float) -> float | None:
    """A number for JSON, which knows no infinity."""
    return value if np.isfinite(value) else None
