"""A meter measures one FMU on motions, and makes rows of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.cosim.run import UnpackedFmu
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation.calls import (
    CallAnswers,
    ErrorLevels,
    MeasuredMotion,
    Named,
    answers,
    row_of,
)
from slide_fmu.validation.row import ALL, FINER, Call, Row

Calls = Sequence[tuple[Call, float]]
"""Calls, each with the number of its communication steps in the surrogate's own step."""


@dataclass(frozen=True, eq=False)
class Meter:
    """A Meter is an FMU with what its errors are compared with.

    Attributes:
        fmu: the unpacked FMU, whose library is run.
        surrogate: the surrogate that it runs.
        levels: which errors are usual.
    """

    fmu: UnpackedFmu
    surrogate: Surrogate
    levels: ErrorLevels

    @property
    def step(self) -> float:
        """The surrogate's own step in s."""
        return self.surrogate.window.step

    def relative_to(self, size: FloatArray) -> Meter:
        """Return the meter whose errors are relative to a size of the outputs, (n_outputs,)."""
        return replace(self, levels=replace(self.levels, size=size))

    def usual_calls(self, finer: bool = True) -> Calls:
        """Return the calls that every kind of input is measured in.

        They are the plain call at the own step, and where it is known what inputs do between
        samples at a shorter one, too (``finer``). Where inputs move, they are also known.
        """
        found: list[tuple[Call, float]] = [("plain", 1.0)]
        if finer:
            found.append(("plain", float(FINER)))
        if self.surrogate.hold == "first_order":
            found.append(("known", 1.0))
        return found

    def answers(
        self, motions: Sequence[MeasuredMotion], call: Call, steps: float
    ) -> list[CallAnswers]:
        """Run the FMU on motions in a call, with a number of steps in the own step.

        Raises:
            CoSimulationError: the FMU reports an error.
        """
        signals = self.surrogate.inputs, self.surrogate.outputs
        return [answers(self.fmu, *signals, one, call, self.step / steps) for one in motions]

    def rows(self, named: Named, motions: Sequence[MeasuredMotion], calls: Calls) -> list[Row]:
        """Return a row for each of the calls, as far as it has a communication point that counts.

        Raises:
            CoSimulationError: the FMU reports an error.
        """
        found = (
            self._row(self.answers(motions, call, steps), named, call, steps)
            for call, steps in calls
            if motions
        )
        return [row for row in found if row is not None]

    def rows_by_kind(
        self, group: str, kinds: Mapping[str, Sequence[MeasuredMotion]], calls: Calls
    ) -> list[Row]:
        """Return the rows of each kind of a group, and of all of them together.

        Raises:
            CoSimulationError: the FMU reports an error.
        """
        rows: list[Row | None] = []
        for call, steps in calls:
            found = {
                name: self.answers(motions, call, steps)
                for name, motions in kinds.items()
                if motions
            }
            every = [one for some in found.values() for one in some]
            for name, some in {ALL: every, **found}.items():
                if some:
                    rows.append(self._row(some, Named(group, name), call, steps))
        return [row for row in rows if row is not None]

    def _row(
        self, found: Sequence[CallAnswers], named: Named, call: Call, steps: float
    ) -> Row | None:
        lengths = self.step / steps, self.step
        return row_of(found, self.surrogate.outputs, named, call, lengths, self.levels)


def size_of(truth: FloatArray) -> FloatArray:
    """Return the RMS of true outputs, (n, n_outputs), about their mean, (n_outputs,)."""
    return np.asarray(truth.std(axis=0))
