"""Outputs of an FMU at given times, from inputs that are known at these times."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray, cosines_of
from slide_fmu.cosim.between import evened, refined
from slide_fmu.cosim.importer import Reader, Slave
from slide_fmu.cosim.run import CoSimulationError, UnpackedFmu, instantiated, unpacked
from slide_fmu.fmu.description.variables import (
    AT_STEP_END,
    BY_KEY,
    INITIAL,
    PREHISTORY_KNOWN,
    REFERENCES_PER_KIND,
)
from slide_fmu.fmu.export import SURROGATE, read_fmu, read_member

WHOLE = 1e-6
"""How far a step may be from a multiple of the FMU's own, in such steps: rounding."""


def simulate(
    fmu: str | Path,
    t: NDArray[Any],
    u: NDArray[Any],
    parameters: Mapping[str, float] | None = None,
) -> FloatArray:
    """Give the outputs of an FMU of slide-fmu at times, from its inputs at the same times.

    All inputs are known here, so that nothing is late and nothing is forecast. Before the first
    time they were what they are there.

    Inputs with a first-order hold are straight lines between the times (an angle that cosine and
    sine give turns evenly), or curves where the inputs are smooth. An FMU whose inputs are set to
    what they are now knows straight lines only; where there are curves, it keeps values whose
    lines have the mean of the curve, though its outputs follow the inputs themselves. One whose
    inputs are planned motions (``Surrogate.planned``) knows how these go on between samples, and
    one that has learnt from records keeps samples as they are.

    Inputs with a zero-order hold stay what they are from each time to the next; where the
    distances are no multiples of the FMU's step, the FMU takes its own steps, each under the mean
    of its inputs, and outputs are straight lines between them.

    Args:
        fmu: file of the FMU, of FMI 2.0 or FMI 3.0.
        t: times in s, rising, shape (N,).
        u: inputs at these times in their units, in the order of the model description, shape
            (N, n_inputs); (N,) will do for one input.
        parameters: values of the FMU's physical parameters by name, in their units; those that
            are not given have their start values.

    Returns:
        Outputs at these times in their units, shape (N, n_outputs).

    Raises:
        CoSimulationError: the FMU cannot be run, or reports an error.
        FmuError: the file is no FMU, or its model description cannot be read.
        ValueError: times or inputs do not have these shapes, are not finite, or times do not rise.
    """
    path = Path(fmu)
    with unpacked(path) as files:
        inputs, outputs = _of_kind(files, "INPUT"), _of_kind(files, "OUTPUT")
        meaning = _meaning(path)
        times, values = _checked(t, u, inputs)
        run = _Run(files, inputs, outputs, parameters or {})
        if meaning.first_order:
            own, rows, places = refined(times, values, meaning.cosines, files.step)
            lines = meaning.straight
            kept = evened(own, rows, meaning.cosines, files.step) if lines else rows
            return run.moving(own, rows, kept)[places]
        if _whole(np.diff(times) / files.step):
            return run.held(times, values)
        own = times[0] + files.step * np.arange(np.ceil((times[-1] - times[0]) / files.step) + 1)
        found = run.held(own, _means(times, values, own))
        return np.stack([np.interp(times, own, column) for column in found.T], axis=1)


@dataclass(frozen=True, eq=False)
class _Run:
    """An FMU, the names of its inputs and outputs, and values of its physical parameters."""

    fmu: UnpackedFmu
    inputs: Sequence[str]
    outputs: Sequence[str]
    parameters: Mapping[str, float]

    def moving(self, times: FloatArray, values: FloatArray, kept: FloatArray) -> FloatArray:
        """Set before each step what inputs with a first-order hold reach by its end.

        Outputs follow the values; what the FMU keeps of them for the next steps are others, whose
        straight lines stand for curves between the values.
        """
        known = {
            INITIAL.replace("{signal}", name): u
            for name, u in zip(self.inputs, values[0], strict=True)
        }
        start = {PREHISTORY_KNOWN: 1.0, **known, AT_STEP_END: 1.0}
        return self._steps(times, values[0], (values[1:], kept[1:]), start)

    def held(self, times: FloatArray, values: FloatArray) -> FloatArray:
        """Set before each step what inputs with a zero-order hold are in it."""
        rows = values[: len(times) - 1]
        return self._steps(times, values[0], (rows, rows), {})

    def _steps(
        self,
        times: FloatArray,
        first: FloatArray,
        rows: tuple[FloatArray, FloatArray],
        start: dict[str, float],
    ) -> FloatArray:
        """Outputs (N, n_outputs) at times (N,), under inputs that are set before each step.

        Rows of the inputs are those that the outputs follow, and those that the FMU keeps.
        """
        fmu, start = self.fmu, {**self.parameters, **start}
        fmu.require(*start)
        of_inputs = [fmu.references[name] for name in self.inputs]
        read = Reader(
            [fmu.references[name] for name in self.outputs], [fmu.types[n] for n in self.outputs]
        )
        with instantiated(fmu) as slave:
            slave.set_real([fmu.references[name] for name in start], [*start.values()])
            slave.set_real(of_inputs, first.tolist())
            slave.enter_initialization(float(times[0]))
            slave.exit_initialization()
            found = [read(slave)]
            for time, length, row, kept in zip(times[:-1], np.diff(times), *rows, strict=True):
                step = _Step(slave, of_inputs, float(time), float(length))
                if np.array_equal(row, kept):
                    step.take(row)
                    found.append(read(slave))
                    continue
                with step.to_come_back():
                    step.take(row)
                    found.append(read(slave))
                step.take(kept)
            slave.terminate()
        return np.array(found, dtype=np.float64)


@dataclass(frozen=True, eq=False)
class _Step:
    """A communication step of an instance, which may be taken, undone and taken again."""

    slave: Slave
    of_inputs: list[int]
    time: float
    length: float

    def take(self, inputs: FloatArray) -> None:
        """Set the inputs and take the step."""
        self.slave.set_real(self.of_inputs, inputs.tolist())
        self.slave.do_step(self.time, self.length)

    @contextmanager
    def to_come_back(self) -> Iterator[None]:
        """Undo what happens in a ``with`` block."""
        state = self.slave.get_state()
        yield
        self.slave.set_state(state)
        self.slave.free_state(state)


def _of_kind(fmu: UnpackedFmu, key: str) -> list[str]:
    """Names of the variables of one kind, in the order of their value references."""
    number = BY_KEY[key].number
    found = {r: n for n, r in fmu.references.items() if r // REFERENCES_PER_KIND == number}
    return [found[reference] for reference in sorted(found)]


@dataclass(frozen=True)
class _Meaning:
    """This says what an FMU's inputs mean.

    Attributes:
        first_order: whether they move between communication points.
        straight: whether they move along straight lines, as far as the FMU knows.
        cosines: indices of those that are cosines of angles.
    """

    first_order: bool
    straight: bool
    cosines: tuple[int, ...] = ()


def _meaning(path: Path) -> _Meaning:
    """Read what an FMU's inputs mean.

    Raises:
        CoSimulationError: the FMU is none of slide-fmu, so that nothing says it.
    """
    if read_member(path, SURROGATE) is None:
        raise CoSimulationError(
            f"{path.name} has no {SURROGATE}; expected an FMU of slide-fmu: only these say what "
            "their inputs do between communication points"
        )
    surrogate, _ = read_fmu(path)
    forecast = surrogate.forecast
    straight = not (surrogate.planned or (forecast is not None and forecast.sampled))
    return _Meaning(surrogate.hold == "first_order", straight, cosines_of(surrogate.inputs))


def _checked(
    t: NDArray[Any], u: NDArray[Any], inputs: Sequence[str]
) -> tuple[FloatArray, FloatArray]:
    """Times (N,) and inputs (N, n_inputs) as float64.

    Raises:
        ValueError: they have other shapes, are not finite, or times do not rise.
    """
    times, values = np.asarray(t, dtype=np.float64), np.asarray(u, dtype=np.float64)
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


def _whole(steps: FloatArray) -> bool:
    return bool(np.all((np.rint(steps) >= 1) & (np.abs(steps - np.rint(steps)) <= WHOLE)))


def _means(times: FloatArray, values: FloatArray, own: FloatArray) -> FloatArray:
    """Mean, from each own time to the next, of values that stay until the next of their times."""
    lengths = np.diff(times)[:, None]
    sums = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values[:-1] * lengths, 0)])
    ends = np.append(times, max(own[-1], times[-1]) + 1)
    sums = np.append(sums, sums[-1:] + values[-1:] * (ends[-1] - times[-1]), axis=0)
    at = np.stack([np.interp(own, ends, column) for column in sums.T], axis=1)
    return np.asarray(np.diff(at, axis=0) / np.diff(own)[:, None])
