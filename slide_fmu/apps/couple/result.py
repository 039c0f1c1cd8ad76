"""The result of a coupled run: values over time, and figures."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Self

import numpy as np

from slide_fmu.core.files import write_whole
from slide_fmu.core.signals import FloatArray
from slide_fmu.importer.errors import CoSimulationError


@dataclass(frozen=True)
class CoupledFigures:
    """CoupledFigures say how a coupled system was run, and what that took.

    Attributes:
        method: its name.
        extrapolation: how unknown inputs continue in explicit steps: ``"zero"`` or ``"linear"``.
        step_s: communication step in s; the longest one where steps are controlled.
        steps: number of steps.
        rejected: number of steps that were repeated with half their length.
        shortest_step_s: in s.
        iterations: mean number of iterations of a step.
        most_iterations: their largest number.
        component_steps: steps of FMUs by the names of the components, with repeated ones.
        inputs: how each component takes its inputs.
        seconds: computing time of the steps in s.
        remarks: one sentence each.
    """

    method: str
    extrapolation: str
    step_s: float
    steps: int
    rejected: int
    shortest_step_s: float
    iterations: float
    most_iterations: int
    component_steps: Mapping[str, int]
    inputs: Mapping[str, str]
    seconds: float
    remarks: Sequence[str] = ()


@dataclass(frozen=True, eq=False)
class CoupledValues:
    """CoupledValues are what a run has computed, perhaps up to where it stopped.

    Attributes:
        time: communication points in s, (N,).
        values: by ``COMPONENT.VARIABLE``, in their units, (N,) each.
        units: of the values; empty where an FMU names none.
    """

    time: FloatArray
    values: Mapping[str, FloatArray]
    units: Mapping[str, str]

    def with_names(self, names: Mapping[str, str]) -> Self:
        """Return them with further names, each with the present one."""
        known = {name: one for name, one in names.items() if one in self.values}
        values = {**self.values, **{name: self.values[one] for name, one in known.items()}}
        units = {**self.units, **{name: self.units[one] for name, one in known.items()}}
        return replace(self, values=values, units=units)

    def write(self, path: str | Path) -> Path:
        """Write a table as CSV, with a column for the time and for each value; return its path."""
        table = np.column_stack([self.time, *self.values.values()])
        text = io.StringIO()
        rows = csv.writer(text, lineterminator="\n")  # names of Modelica may have commas
        rows.writerow(["time", *self.values])
        rows.writerows([f"{value:.9g}" for value in row] for row in table)
        write_whole(Path(path), text.getvalue().encode("utf-8"))
        return Path(path)


class StoppedRunError(CoSimulationError):
    """A StoppedRunError tells why a coupled run stopped before its end.

    Attributes:
        values: what was computed until then; None if nothing was.
    """

    def __init__(self, reason: str, values: CoupledValues | None = None) -> None:
        super().__init__(reason, values)
        self.values = values

    def __str__(self) -> str:
        return str(self.args[0])


@dataclass(frozen=True, eq=False)
class CoupledRun(CoupledValues):
    """A CoupledRun is the result of ``couple``: all values, and figures.

    Attributes:
        figures: how the system was run.
    """

    figures: CoupledFigures = field(repr=False)

    def __getitem__(self, name: str) -> FloatArray:
        """Return the values of ``COMPONENT.VARIABLE``."""
        return self.values[name]

    def with_remark(self, remark: str) -> CoupledRun:
        """Return the result with a further remark."""
        figures = replace(self.figures, remarks=[*self.figures.remarks, remark])
        return replace(self, figures=figures)
