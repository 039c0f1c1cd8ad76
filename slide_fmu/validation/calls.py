"""This module runs an FMU as an importer does, at any communication step, and makes rows of it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.measures import TINY, relative_rmse, rms, size_about
from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.cosim.whole_run import Run, run_fmu
from slide_fmu.fmu.description.variables import (
    AT_STEP_END,
    BOUND_FILLED,
    ERROR_BOUND,
    ERROR_ESTIMATE,
    HELD,
    IN_DOMAIN,
    NOVELTY,
    TRUST,
    TRUSTED,
    known_inputs,
)
from slide_fmu.importer.file import UnpackedFmu
from slide_fmu.validation.input_courses import InputCourse, Stairs
from slide_fmu.validation.row import HARMFUL, Call, Row, RowOutput, ToneCell

Kind = TypeVar("Kind", bound=np.generic)

SLACK = 1e-6
"""Times that differ by this part of a step are the same, as their rounding differs."""


@dataclass(frozen=True, eq=False)
class MeasuredMotion:
    """A MeasuredMotion has inputs as a function of time, and the true outputs at some times.

    Attributes:
        course: the inputs.
        truth: true outputs at t = 0, grid, 2 grid ..., in their units, shape (N + 1, n_outputs).
        grid: time in s between them.
        first: time in s from which on outputs count.
        parameters: values of the FMU's physical parameters by name.
        answers: what the FMU gave in some calls at its own step, so that it is not run again.
    """

    course: InputCourse
    truth: FloatArray
    grid: float
    first: float
    parameters: Mapping[str, float] = field(default_factory=dict)
    answers: Mapping[Call, CallAnswers] = field(default_factory=dict)

    def points(self, step: float) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the communication points that count, and their places in the truth, (n,) each.

        Points count whose time is one of the truth's, and those alone.

        Args:
            step: the communication step in s.
        """
        count = self.count(step)
        numbers = np.arange(1, count + 1)
        place = numbers * step / self.grid
        known = np.abs(place - np.rint(place)) <= SLACK * max(1.0, step / self.grid)
        known &= numbers * step >= self.first - SLACK * step
        return numbers[known], np.rint(place[known]).astype(np.int64)

    def count(self, step: float) -> int:
        """Return the number of whole communication steps, in s, within the motion."""
        return math.floor((len(self.truth) - 1) * self.grid / step + SLACK)


@dataclass(frozen=True, eq=False)
class CallAnswers:
    """CallAnswers are what an FMU gave at the n communication points of a motion that count.

    Attributes:
        outputs: in their units, shape (n, n_outputs).
        truth: what the reference gave, likewise.
        bounds: 95 % error bounds, likewise; None of an FMU without them.
        trusted: whether ``trusted`` was true, (n,); None of an FMU without it.
        filled: whether ``error_bound_filled`` was 1, (n,); all true of an FMU without it.
        estimates: error estimates, as the bounds; None of an FMU without them.
        novelty, in_domain: of the inputs, (n,); None of an FMU without them.
    """

    outputs: FloatArray
    truth: FloatArray
    bounds: FloatArray | None
    trusted: NDArray[np.bool_] | None
    filled: NDArray[np.bool_]
    estimates: FloatArray | None = None
    novelty: FloatArray | None = None
    in_domain: FloatArray | None = None

    @property
    def error(self) -> FloatArray:
        """Outputs minus truth, (n, n_outputs)."""
        return self.outputs - self.truth


@dataclass(frozen=True, eq=False)
class ErrorLevels:
    """ErrorLevels say which errors are usual, and to what they are relative; (n_outputs,) each.

    Attributes:
        mean: of the reference in range.
        usual: 95 % quantile of the absolute errors in range with known inputs; None if unknown.
        size: what errors are relative to; None for the RMS of each truth about ``mean``.
    """

    mean: FloatArray
    usual: FloatArray | None = None
    size: FloatArray | None = None


@dataclass(frozen=True)
class InputsLabel:
    """An InputsLabel has the group of some inputs, and their kind in words, as a ``Row`` has."""

    group: str
    inputs: str
    failed: tuple[str, ...] = ()
    tones: ToneCell | None = None


def answers(
    fmu: UnpackedFmu,
    inputs: Sequence[Signal],
    outputs: Sequence[Signal],
    motion: MeasuredMotion,
    call: Call,
    step: float,
) -> CallAnswers:
    """Run a fresh instance of an FMU on a motion, as an importer does.

    In the plain call it sets the inputs at t before the step from t; in the call ``known`` moving
    ones at t + step, and the FMU knows that. Of inputs that are held over its own step it knows
    that they are held, where the communication step shows nothing else.

    Args:
        fmu: the unpacked FMU.
        inputs, outputs: its signals.
        motion: the motion.
        call: ``plain`` or ``known``.
        step: the communication step in s.

    Raises:
        CoSimulationError: the FMU reports an error.
        ValueError: the motion is too short for a step.
    """
    count = motion.count(step)
    if count < 1:
        raise ValueError(
            f"a communication step of {step:g} s for a motion of "
            f"{motion.grid * (len(motion.truth) - 1):g} s; expected a shorter one"
        )
    names, bounds, estimates = names_of(outputs)
    known = recorded(fmu, outputs)
    run = run_in_call(fmu, inputs, motion.course, known, (call, step, count), motion.parameters)
    at, places = motion.points(step)
    by_name = dict(zip(known, run.values[at].T, strict=True))

    def stacked(names: Sequence[str]) -> FloatArray | None:
        """Return what the FMU gave for all outputs, (n, n_outputs); None where it lacks one."""
        every = [by_name[name] for name in names if name in by_name]
        return np.stack(every, axis=1) if len(every) == len(names) else None

    filled = by_name.get(BOUND_FILLED)
    return CallAnswers(
        outputs=run.values[at, : len(names)],
        truth=motion.truth[places],
        bounds=stacked(bounds),
        trusted=by_name[TRUSTED] > 0 if TRUSTED in by_name else None,
        filled=np.full(len(at), True) if filled is None else filled >= 1,
        estimates=stacked(estimates),
        novelty=by_name.get(NOVELTY),
        in_domain=by_name.get(IN_DOMAIN),
    )


def names_of(outputs: Sequence[Signal]) -> tuple[list[str], list[str], list[str]]:
    """Return the names of outputs, of their bounds and of their estimates."""
    names = [signal.name for signal in outputs]
    bounds = [ERROR_BOUND.format(signal=name) for name in names]
    return names, bounds, [ERROR_ESTIMATE.format(signal=name) for name in names]


def recorded(fmu: UnpackedFmu, outputs: Sequence[Signal]) -> list[str]:
    """Return the names of all that a run of an FMU records to be measured."""
    wanted = (*(name for names in names_of(outputs) for name in names), *TRUST)
    return [name for name in wanted if name in fmu.references]


def run_in_call(
    fmu: UnpackedFmu,
    inputs: Sequence[Signal],
    course: InputCourse,
    wanted: Sequence[str],
    steps: tuple[Call, float, int],
    parameters: Mapping[str, float],
    timed: bool = False,
) -> Run:
    """Run a fresh instance of an FMU under some inputs, as ``answers`` does.

    Args:
        fmu: the unpacked FMU.
        inputs: its inputs.
        course: the inputs over time.
        wanted: names of the variables to record.
        steps: the call, the communication step in s, and the number of steps.
        parameters: values of physical parameters by name.
        timed: whether the calls of every step are timed.

    Raises:
        CoSimulationError: the FMU reports an error.
    """
    call, step, count = steps
    known_by = known_inputs(fmu.references)
    ahead = 1.0 if call == "known" and known_by == AT_STEP_END else 0.0
    rows = course(step * (np.arange(count, dtype=np.float64) + ahead))
    columns = {signal.name: rows[:, index] for index, signal in enumerate(inputs)}
    parameters, held = dict(parameters), known_by == HELD
    if call == "known":
        parameters[known_by] = 1.0
    elif held and isinstance(course, Stairs) and _same(step, course.step, fmu.step):
        # at this step nobody can tell stairs from samples of a smooth signal: the user says so
        parameters[HELD] = 1.0
    return run_fmu(fmu, columns, wanted, parameters, step, timed)


def _same(*steps: float) -> bool:
    """Return whether steps in s are the same, but for rounding."""
    return max(steps) - min(steps) <= SLACK * max(steps)


def row_of(
    every: Sequence[CallAnswers],
    outputs: Sequence[Signal],
    label: InputsLabel,
    call: Call,
    steps: tuple[float, float],
    levels: ErrorLevels,
) -> Row | None:
    """Make the row of some motions; None where no communication point counts.

    Args:
        every: the answers on each motion.
        outputs: the signals of the outputs.
        label: the inputs.
        call: how the importer called.
        steps: its communication step, and the surrogate's own, in s.
        levels: which errors are usual.
    """
    error, truth = (np.concatenate([getattr(a, n) for a in every]) for n in ("error", "truth"))
    if not len(error):
        return None
    step, own = steps
    filled = np.concatenate([one.filled for one in every])
    size = size_about(truth, levels.mean) if levels.size is None else levels.size
    relative, absolute = relative_rmse(error, size), np.abs(error)
    bounds = _joined([one.bounds for one in every])
    flags = _joined([one.trusted for one in every])
    counts = filled if bounds is not None else np.full(len(error), True)
    shares = _Shares(
        absolute[counts],
        None if bounds is None else bounds[counts],
        None if flags is None else flags[counts],
        levels.usual,
    )
    covered, width = shares.covered(), shares.width()
    return Row(
        group=label.group,
        inputs=label.inputs,
        call=call,
        step_s=step,
        steps=own / step,
        trajectories=len(every),
        samples=len(error),
        counted=int(np.count_nonzero(counts)),
        outputs=tuple(
            RowOutput(
                name=signal.name,
                unit=signal.unit,
                relative_rmse=float(relative[index]),
                rmse=float(rms(error)[index]),
                largest_error=float(absolute[:, index].max()),
                covered=None if covered is None else float(covered[index]),
                width=None if width is None else float(width[index]),
            )
            for index, signal in enumerate(outputs)
        ),
        trusted=shares.trusted(),
        harmful=shares.harmful(),
        silent=shares.silent(),
        over_bound=shares.over_bound(),
        failed=label.failed,
        tones=label.tones,
    )


@dataclass(frozen=True, eq=False)
class _Shares:
    """The shares of the samples that count: absolute errors, bounds, flags and the usual level."""

    error: FloatArray
    bounds: FloatArray | None
    flags: NDArray[np.bool_] | None
    usual: FloatArray | None

    def covered(self) -> FloatArray | None:
        if self.bounds is None or not len(self.error):
            return None
        return np.asarray(np.mean(self.error <= self.bounds, axis=0))

    def width(self) -> FloatArray | None:
        if self.bounds is None or self.usual is None or not len(self.error):
            return None
        return np.asarray(self.bounds.mean(axis=0) / np.maximum(self.usual, TINY))

    def trusted(self) -> float | None:
        return None if self.flags is None or not len(self.error) else float(np.mean(self.flags))

    def harmful(self) -> float | None:
        if self.usual is None or not len(self.error):
            return None
        return float(np.mean((self.error > HARMFUL * self.usual).any(axis=1)))

    def silent(self) -> float | None:
        if self.bounds is None or self.flags is None or self.usual is None or not len(self.error):
            return None
        large = (self.error > HARMFUL * self.usual) & (self.error > self.bounds)
        return float(np.mean(large.any(axis=1) & self.flags))

    def over_bound(self) -> float | None:
        if self.bounds is None or self.flags is None or not self.flags.any():
            return None
        ratios = self.error[self.flags] / np.maximum(self.bounds[self.flags], TINY)
        return float(ratios.max())


def _joined(parts: Sequence[NDArray[Kind] | None]) -> NDArray[Kind] | None:
    """Join what all motions have; None if one of them has it not."""
    known = [part for part in parts if part is not None]
    return np.concatenate(known) if len(known) == len(parts) else None
