"""Whether functions of a user accept many states at once is tried, and compared.

No one declares it, and nothing is assumed: what they give for many lanes must be what they give
for each alone, at states along a motion and around it.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.systems.declared import Parameters
from slide_fmu.systems.function.lanes import WIDTH, of_lanes
from slide_fmu.systems.function.user_function import FunctionError, UserFunction

MOST_LANES = 256
"""Largest number of lanes: more gain little."""
FIXED = 64
"""Number of lanes of a function whose results have other last digits for other numbers of them, as
products of matrices may have. It is then called with this number alone."""
ONE_BY_ONE = 64
"""Number of lanes of functions that accept one state alone, and are called for each: more gain
nothing."""
AGREES = 1e-12
"""Numbers for many lanes differ from those for each alone by at most this part of the largest."""
AROUND = 1.5
"""Random states lie within this multiple of the sizes that were seen."""
PACE = 0.1
"""Random rates of inputs go through at most this part of the range in a sample step."""
VARIED = 0.2
"""Parameters that vary are tried within this part of their values."""


@dataclass(frozen=True)
class Trial:
    """A Trial says whether functions accept many lanes.

    Attributes:
        refusal: why they do not; None if they do.
        width: number of lanes with which they are always called; None where any multiple of
            ``WIDTH`` gives the same numbers.
        sizes: the largest number of each function's results, (count,) each, in their order.
    """

    refusal: str | None
    width: int | None = None
    sizes: tuple[FloatArray, ...] = ()

    @property
    def most(self) -> int:
        """The largest number of lanes."""
        return ONE_BY_ONE if self.refusal else self.width or MOST_LANES


@dataclass(frozen=True, eq=False)
class Points:
    """Points are where functions are tried, one in each lane.

    Attributes:
        x: states, (n, B).
        u, du: inputs and their rates, (n_inputs, B).
        each: parameters of every lane.
        varied: names of those that vary.
    """

    x: FloatArray
    u: FloatArray
    du: FloatArray
    each: Sequence[Parameters]
    varied: Collection[str]

    def at(self, lanes: NDArray[np.int64]) -> Points:
        """Return those of some lanes, (K,), perhaps in another order."""
        x, u, du = (np.ascontiguousarray(each[:, lanes]) for each in (self.x, self.u, self.du))
        return Points(x, u, du, [self.each[lane] for lane in lanes], self.varied)

    def together(self, function: UserFunction) -> FloatArray:
        """Give what a function gives for all of them at once, (count, B)."""
        values = np.full((function.count, self.x.shape[1]), np.nan)
        with np.errstate(all="ignore"):
            function.of_lanes(self.x, self.u, of_lanes(self.each, self.varied), self.du, values)
        return values

    def alone(self, function: UserFunction) -> FloatArray:
        """Give what a function gives for each; where it fails, this is not finite."""
        values = np.full((function.count, self.x.shape[1]), np.nan)
        for lane, p in enumerate(self.each):
            x, u, du = (each[:, lane].copy() for each in (self.x, self.u, self.du))
            try:
                with np.errstate(all="ignore"):
                    values[:, lane] = function(x, u, p, du)
            except FunctionError:
                continue
        return values


def points_around(
    states: FloatArray,
    sizes: FloatArray,
    inputs: Sequence[Signal],
    step: float,
    p: Parameters,
    varied: Collection[str],
) -> Points:
    """Draw points at states along a motion, (K, n), and at random ones of the sizes, (n,)."""
    rng = np.random.default_rng(FIXED)
    half = FIXED // 2
    along = states[np.linspace(0, len(states) - 1, half).astype(np.int64)]
    random = AROUND * sizes * rng.uniform(-1.0, 1.0, (FIXED - half, len(sizes)))
    low, high = (np.array([getattr(one, end) for one in inputs]) for end in ("low", "high"))
    u = rng.uniform(low, high, (FIXED, len(inputs)))
    du = rng.uniform(-1.0, 1.0, u.shape) * PACE * (high - low) / step
    each = [
        Parameters(**{**vars(p), **{name: _near(vars(p)[name], rng) for name in varied}})
        for _ in range(FIXED)
    ]
    return Points(np.concatenate([along, random]).T, u.T, du.T, each, varied)


def _near(value: float, rng: np.random.Generator) -> float:
    return float(value * rng.uniform(1.0 - VARIED, 1.0 + VARIED))


def tried(functions: Sequence[UserFunction], points: Points) -> Trial:
    """Try functions with many lanes; those that they fail on alone do not count."""
    width, sizes = None, list[FloatArray]()
    for function in functions:
        alone = points.alone(function)
        fine = np.flatnonzero(np.isfinite(alone).all(axis=0))
        if not len(fine):
            return Trial(
                f"{function.name} gives no finite numbers at the states where it was tried"
            )
        lanes = np.resize(fine, FIXED).astype(np.int64)
        chosen, expected = points.at(lanes), alone[:, lanes]
        sizes.append(np.max(np.abs(expected), axis=1))
        try:
            together = chosen.together(function)
            refusal = _difference(function, together, expected)
            if refusal is not None:
                return Trial(refusal)
            if not _same_in_any_order(function, chosen, together):
                return Trial(f"{function.name} gives other numbers in another order of the states")
            if not _same_in_any_number(function, chosen, together):
                width = FIXED
        except FunctionError as error:
            return Trial(str(error))
    return Trial(None, width, tuple(sizes))


def _difference(function: UserFunction, together: FloatArray, expected: FloatArray) -> str | None:
    """Say where numbers for many lanes, (count, B), are not those for each; None if nowhere."""
    sizes = np.max(np.abs(expected), axis=1, keepdims=True)
    other = ~(np.abs(together - expected) <= AGREES * sizes)
    if not other.any():
        return None
    row, lane = np.argwhere(other)[0]
    return (
        f"{function.name} gives {together[row, lane]:.6g} in place of {expected[row, lane]:.6g} "
        f"for its number {row + 1}"
    )


def _same_in_any_order(function: UserFunction, points: Points, together: FloatArray) -> bool:
    order = np.random.default_rng(0).permutation(together.shape[1])
    return np.array_equal(points.at(order).together(function), together[:, order])


def _same_in_any_number(function: UserFunction, points: Points, together: FloatArray) -> bool:
    for count in (WIDTH, 3 * WIDTH, 2 * FIXED, MOST_LANES):
        lanes = np.resize(np.arange(together.shape[1]), count)
        if not np.array_equal(points.at(lanes).together(function), together[:, lanes]):
            return False
    return True
