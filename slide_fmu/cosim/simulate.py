"""An FMU is simulated at given times, from inputs that are known at these times."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.given_numbers import given_numbers
from slide_fmu.core.held_means import held_means
from slide_fmu.core.signals import FloatArray, cosines_of
from slide_fmu.cosim.between import even_out, refine
from slide_fmu.cosim.whole_run import StepGrid, run_over
from slide_fmu.fmu.description.variables import (
    AT_STEP_END,
    BY_KEY,
    HELD,
    INITIAL,
    PREHISTORY_KNOWN,
    REFERENCES_PER_KIND,
)
from slide_fmu.fmu.export import SURROGATE, read_fmu, read_member
from slide_fmu.importer.description import is_multiple
from slide_fmu.importer.errors import CoSimulationError
from slide_fmu.importer.file import UnpackedFmu, unpacked


def simulate(
    fmu: str | Path,
    t: NDArray[Any],
    u: NDArray[Any],
    parameters: Mapping[str, float] | None = None,
) -> FloatArray:
    """Return the outputs of an FMU of slide-fmu at given times, from its inputs at the same times.

    All inputs are known, so nothing is late and nothing is forecast. Before the first time they
    are constant.

    Inputs with a first-order hold are straight lines between the times (an angle given by cosine
    and sine turns evenly), or curves where the inputs are smooth. If the FMU's inputs are set to
    their present values, it knows straight lines only. For curves it then stores values whose
    lines have the mean of the curve, while its outputs follow the inputs themselves. An FMU whose
    inputs are planned motions (``Surrogate.planned``) knows the curves between samples; one
    trained on records stores the samples as they are.

    Inputs with a zero-order hold are constant from each time to the next. If the distances are not
    multiples of the FMU's step, the FMU takes its own steps, each with the mean of its inputs, and
    outputs are straight lines between them.

    Args:
        fmu: file of the FMU, of FMI 2.0 or FMI 3.0.
        t: times in s, rising, shape (N,).
        u: inputs at these times in their units, in the order of the model description, shape
            (N, n_inputs); (N,) is allowed for one input.
        parameters: values of the FMU's physical parameters by name, in their units; missing ones
            have start values.

    Returns:
        Outputs at these times in their units, shape (N, n_outputs).

    Raises:
        CoSimulationError: the FMU cannot be run, or reports an error.
        FmuError: the file is not an FMU, or its model description cannot be read.
        TypeError: times or inputs are no real numbers.
        ValueError: times or inputs do not have these shapes, are not finite, or times do not rise.
    """
    path = Path(fmu)
    with unpacked(path) as files:
        inputs, outputs = _of_kind(files, "INPUT"), _of_kind(files, "OUTPUT")
        meaning = _meaning(path)
        times, values = _checked(t, u, inputs)
        run = _Simulation(files, inputs, outputs, parameters or {})
        if meaning.first_order:
            own, rows, places = refine(times, values, meaning.cosines, files.step)
            lines = meaning.straight
            kept = even_out(own, rows, meaning.cosines, files.step) if lines else rows
            return run.moving(own, rows, kept)[places]
        if all(is_multiple(gap, files.step) for gap in np.diff(times).tolist()):
            return run.held(times, values)
        own = times[0] + files.step * np.arange(np.ceil((times[-1] - times[0]) / files.step) + 1)
        outputs_at_own = run.held(own, held_means(times, values, own))
        return np.stack([np.interp(times, own, column) for column in outputs_at_own.T], axis=1)


@dataclass(frozen=True, eq=False)
class _Simulation:
    """A _Simulation is an FMU with names of its inputs and outputs, and values of parameters."""

    fmu: UnpackedFmu
    inputs: Sequence[str]
    outputs: Sequence[str]
    parameters: Mapping[str, float]

    def moving(self, times: FloatArray, values: FloatArray, kept: FloatArray) -> FloatArray:
        """Set inputs with a first-order hold before each step to their values at its end.

        Outputs follow ``values``. For the next steps the FMU stores ``kept``, whose straight lines
        replace curves between the values.
        """
        known = {
            INITIAL.replace("{signal}", name): u
            for name, u in zip(self.inputs, values[0], strict=True)
        }
        start = {PREHISTORY_KNOWN: 1.0, **known, AT_STEP_END: 1.0}
        return self._outputs(times, values[0], values[1:], start, kept[1:])

    def held(self, times: FloatArray, values: FloatArray) -> FloatArray:
        """Set inputs with a zero-order hold before each step to their values in it."""
        return self._outputs(times, values[0], values[: len(times) - 1], {HELD: 1.0})

    def _outputs(
        self,
        times: FloatArray,
        first: FloatArray,
        rows: FloatArray,
        start: dict[str, float],
        kept: FloatArray | None = None,
    ) -> FloatArray:
        """Return outputs (N, n_outputs) at times (N,), under inputs that are set before each step.

        ``rows`` are the inputs that the outputs follow, ``kept`` those that the FMU stores.
        """
        grid, inputs = StepGrid.between(times), (self.inputs, rows)
        parameters = {**self.parameters, **start}
        return run_over(self.fmu, grid, inputs, self.outputs, parameters, first, kept).values


def _of_kind(fmu: UnpackedFmu, key: str) -> list[str]:
    """Return the names of the variables of one kind, in the order of their value references."""
    number = BY_KEY[key].number
    names = {r: n for n, r in fmu.references.items() if r // REFERENCES_PER_KIND == number}
    return [names[reference] for reference in sorted(names)]


@dataclass(frozen=True)
class _Meaning:
    """A _Meaning says how an FMU's inputs are understood.

    Attributes:
        first_order: whether they move between communication points.
        straight: whether they move along straight lines, as far as the FMU knows.
        cosines: indices of inputs that are cosines of angles.
    """

    first_order: bool
    straight: bool
    cosines: tuple[int, ...] = ()


def _meaning(path: Path) -> _Meaning:
    """Read how an FMU's inputs are understood.

    Raises:
        CoSimulationError: the FMU is not of slide-fmu, so it does not contain this.
    """
    if read_member(path, SURROGATE) is None:
        raise CoSimulationError(
            f"{path.name} has no {SURROGATE}; expected an FMU of slide-fmu: only these state what "
            "their inputs do between communication points"
        )
    surrogate, _ = read_fmu(path)
    forecast = surrogate.forecast
    straight = not (surrogate.planned or (forecast is not None and forecast.sampled))
    return _Meaning(surrogate.hold == "first_order", straight, cosines_of(surrogate.inputs))


def _checked(
    t: NDArray[Any], u: NDArray[Any], inputs: Sequence[str]
) -> tuple[FloatArray, FloatArray]:
    """Return times (N,) and inputs (N, n_inputs) as float64.

    Raises:
        TypeError: they are no real numbers.
        ValueError: they have other shapes, are not finite, or times do not rise.
    """
    times, values = given_numbers("t", t), given_numbers("u", u)
    if times.ndim != 1 or len(times) == 0:
        raise ValueError(f"t of shape {times.shape}; expected (N,), at least one time in s")
    values = values[:, None] if values.ndim == 1 and len(inputs) == 1 else values
    if values.shape != (len(times), len(inputs)):
        raise ValueError(
            f"u of shape {values.shape}; expected ({len(times)}, {len(inputs)}): a row for each "
            f"time, a column for each input, {list(inputs)}"
        )
    for name, array in (("t", times), ("u", values)):
        if not np.all(np.isfinite(array)):
            row = int(np.argwhere(~np.isfinite(array))[0, 0])
            raise ValueError(f"{name}[{row}] = {array[row]}; expected finite numbers")
    falls = np.flatnonzero(np.diff(times) <= 0)
    if len(falls):
        k = int(falls[0])
        raise ValueError(
            f"t[{k}] = {times[k]:.9g} s, t[{k + 1}] = {times[k + 1]:.9g} s; expected times that "
            "rise"
        )
    return times, values
