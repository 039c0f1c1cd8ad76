"""A motion that leaves all ranges has diverged: going on would give numbers without a meaning."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slide_fmu.apps.couple.component import BOUNDLESS
from slide_fmu.apps.couple.rows import RowKeeper, Rows
from slide_fmu.apps.couple.structure import CoupledSystem, Pin, declared
from slide_fmu.core.signals import FloatArray
from slide_fmu.importer.errors import CoSimulationError

FAR = 100.0
"""Values this number of half ranges from the middle of their range have diverged; nearer ones get
a remark, since ranges of other tools may be those of a drawing."""


EVERY = 16
"""Rows are looked at when there are so many new ones, since each look takes time."""


class DivergedError(CoSimulationError):
    """A DivergedError tells which value left all ranges, and when."""


@dataclass(frozen=True, eq=False)
class Limits:
    """Limits are the ends of the ranges of linked inputs, and then of watched variables.

    Attributes:
        pins: the variables.
        middle, half: of their ranges, (n,); infinite halves where none is declared.
    """

    pins: Sequence[Pin]
    middle: FloatArray
    half: FloatArray

    def require(self, keeper: RowKeeper) -> None:
        """Refuse a run whose last rows are far beyond a range, and cut it where they begin to be.

        Raises:
            DivergedError: the message has the value that left its range, and when.
        """
        beyond = np.any(self._parts(keeper.rows(EVERY)) > FAR, axis=1)
        if beyond.any():
            keeper.cut(len(keeper.times) - len(beyond) + int(np.argmax(beyond)) + 1)
            raise self._error(keeper.rows())

    def _parts(self, rows: Rows) -> FloatArray:
        """Return how many half ranges values are away from the middle, (N, n)."""
        return np.abs(np.hstack([rows.inputs, rows.watched]) - self.middle) / self.half

    def _error(self, rows: Rows) -> DivergedError:
        """Return what is to be said of the last row, in which a value is far beyond its range."""
        parts, values = self._parts(rows), np.hstack([rows.inputs, rows.watched])
        worst = int(np.argmax(parts[-1]))
        left = rows.time[int(np.argmax(parts[:, worst] > 1.0))]
        low, high = (self.middle[worst] + sign * self.half[worst] for sign in (-1.0, 1.0))
        return DivergedError(
            f"{self.pins[worst]} left its range {low:g} .. {high:g} at {left:.6g} s, and reaches "
            f"{values[-1, worst]:.4g} at {rows.time[-1]:.6g} s: the run diverged; expected values "
            "near their ranges: take shorter steps or the method newton, or see whether one of "
            "the FMUs is unstable by itself"
        )


def limits_of(system: CoupledSystem, watched: Sequence[Pin]) -> Limits:
    """Return the limits of a system: the range of a link holds what either end declares."""
    groups = [(link.target, link.source) for link in system.links] + [(pin,) for pin in watched]
    ends = np.array([_ends(system, group) for group in groups]).reshape(-1, 2)
    known = np.isfinite(ends).all(axis=1)
    middle = np.where(known, 0.5 * ends.sum(axis=1, where=known[:, None]), 0.0)
    half = np.where(known, 0.5 * np.diff(np.where(known[:, None], ends, 0.0))[:, 0], np.inf)
    return Limits([group[0] for group in groups], middle, half)


def _ends(system: CoupledSystem, pins: Sequence[Pin]) -> tuple[float, float]:
    """Return the least and the greatest end that variables declare; infinite without a range."""
    found = []
    for pin in pins:
        variable = system.variable(pin)
        low, high = (declared(variable, end) for end in ("min", "max"))
        if low is not None and high is not None and float(low) < float(high) < BOUNDLESS:
            found.append((float(low), float(high)))
    if not found or min(found)[0] <= -BOUNDLESS:
        return -np.inf, np.inf
    return min(low for low, _ in found), max(high for _, high in found)
