"""An FMU says by itself which samples it does not trust under some inputs; no model is needed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.figures import optional
from slide_fmu.core.readable import quantity
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.units import NO_UNIT, behind
from slide_fmu.cosim.whole_run import Run
from slide_fmu.fmu.description.variables import (
    BOUND_FILLED,
    ERROR_BOUND,
    IN_RANGE,
    NOVELTY,
    OUTPUTS_IN_RANGE,
    TRUSTED,
)
from slide_fmu.importer.file import UnpackedFmu
from slide_fmu.record_files.inputs import SLACK, InputTable
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation.calls import run_in_call
from slide_fmu.validation.row import Call
from slide_fmu.validation.your_inputs import course_from

APART = 0.01
"""Samples that are not trusted are one part where less than this part of the file is between."""

ROUNDING = 1e-6
"""A bound counts as above its tolerance from this relative distance below it on."""

Flags = NDArray[np.bool_]


@dataclass(frozen=True, kw_only=True)
class Reason:
    """A Reason says why samples are not trusted.

    Attributes:
        why: the reason, for people.
        share: share of the samples that count for which it holds; several may hold for one.
    """

    why: str
    share: float


@dataclass(frozen=True, kw_only=True)
class UntrustedPart:
    """An UntrustedPart is a part of a file in which an FMU does not trust some samples.

    Attributes:
        begin_s, end_s: times in s of its first and its last such sample, as the file has them.
        samples: number of samples that are not trusted.
        share: share of its samples that are not trusted.
        why: the reasons, that for most samples first.
    """

    begin_s: float
    end_s: float
    samples: int
    share: float
    why: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class OwnView:
    """An OwnView is what an FMU says of its own outputs under inputs from a file.

    Shares are of the samples from which on ``error_bound_filled`` is 1. They are None of an FMU
    without an error bound, and where no sample counts.

    Attributes:
        inputs: name of the file.
        call: how the importer called.
        step_s: its communication step in s.
        samples: number of communication points.
        bounded: whether the FMU has an error bound.
        counted: number of them in which shares count.
        first_s: time in s of the first of these, as the file has it.
        not_trusted: share of samples that are not trusted.
        reasons: why, the most frequent reason first.
        parts: where, in the order of time.
        out_of_range: inputs whose values leave their ranges, with the farthest value.
    """

    inputs: str
    call: Call
    step_s: float
    samples: int
    bounded: bool
    counted: int
    first_s: float | None = optional()
    not_trusted: float | None = optional()
    reasons: tuple[Reason, ...] = optional(())
    parts: tuple[UntrustedPart, ...] = optional(())
    out_of_range: tuple[str, ...] = optional(())


@dataclass(frozen=True, eq=False)
class FileRun:
    """A FileRun is the run of an FMU along the inputs of a file.

    Attributes:
        view: what the FMU says of its outputs.
        times: communication points in s, as the file has them, shape (N + 1,).
        columns: inputs, outputs and what is said of them, by name, each of shape (N + 1,).
    """

    view: OwnView
    times: FloatArray
    columns: Mapping[str, FloatArray]


def simulated(
    fmu: UnpackedFmu, surrogate: Surrogate, table: InputTable, call: Call, step: float
) -> FileRun:
    """Run a fresh instance of an FMU along the inputs of a file, from its first sample on.

    Args:
        fmu: the unpacked FMU.
        surrogate: the surrogate that it runs.
        table: the inputs.
        call: ``plain`` or ``known``.
        step: the communication step in s.

    Raises:
        CoSimulationError: the FMU reports an error.
        ValueError: the file is shorter than a step.
    """
    count = int(np.floor(table.duration / step + SLACK))
    if count < 1:
        raise ValueError(
            f"{table.record.path}: {table.duration:g} s of inputs; expected at least the "
            f"communication step of {step:g} s"
        )
    names = [signal.name for signal in surrogate.outputs]
    bounds = [ERROR_BOUND.format(signal=name) for name in names]
    wanted = (*names, *bounds, TRUSTED, BOUND_FILLED, NOVELTY, IN_RANGE, OUTPUTS_IN_RANGE)
    known = [name for name in wanted if name in fmu.references]
    course = course_from(table, 0.0, step, count)
    run = run_in_call(fmu, surrogate.inputs, course, known, (call, step, count), {})
    elapsed = step * np.arange(count + 1, dtype=np.float64)
    inputs = dict(zip((s.name for s in surrogate.inputs), table.at(elapsed).T, strict=True))
    times = float(table.record.time[0]) + elapsed
    said = _by_name(known, run)
    view = OwnView(
        inputs=table.record.path,
        call=call,
        step_s=step,
        samples=count,
        bounded=surrogate.bound is not None,
        counted=0,
        out_of_range=_out_of_range(table),
    )
    if surrogate.bound is not None:
        view = _judged(view, surrogate, {n: v[1:] for n, v in said.items()}, times[1:])
    return FileRun(view, times, {**inputs, **said})


def _by_name(names: Sequence[str], run: Run) -> dict[str, FloatArray]:
    return dict(zip(names, run.values.T, strict=True))


def _out_of_range(table: InputTable) -> tuple[str, ...]:
    """Name the inputs whose values leave their ranges, with the farthest value of each."""
    texts = []
    for signal, values in zip(table.signals, table.values.T, strict=True):
        beyond = np.maximum(signal.low - values, values - signal.high)
        if signal.angle is None and beyond.max() > 0:
            texts.append(
                f"{signal.name} reaches {values[np.argmax(beyond)]:.6g}, beyond "
                f"{signal.low:g} .. {signal.high:g}{behind(signal.unit)}"
            )
    return tuple(texts)


def _judged(
    view: OwnView, surrogate: Surrogate, said: Mapping[str, FloatArray], times: FloatArray
) -> OwnView:
    """Add to a view what is not trusted, where and why."""
    filled = said[BOUND_FILLED] >= 1
    if not filled.any():
        return view
    bad = (said[TRUSTED] == 0) & filled
    reasons = {why: flags & bad for why, flags in _reasons(surrogate, said).items()}
    count = int(np.count_nonzero(filled))
    shares = {why: float(np.count_nonzero(flags) / count) for why, flags in reasons.items()}
    return replace(
        view,
        counted=count,
        first_s=float(times[np.argmax(filled)]),
        not_trusted=float(np.count_nonzero(bad) / count),
        reasons=tuple(
            Reason(why=why, share=share)
            for why, share in sorted(shares.items(), key=lambda item: -item[1])
            if share > 0
        ),
        parts=_parts(bad, reasons, times),
    )


def _reasons(surrogate: Surrogate, said: Mapping[str, FloatArray]) -> dict[str, Flags]:
    """Return all reasons in words, with the samples for which they hold."""
    reasons: dict[str, Flags] = {}
    for signal, tolerance in zip(surrogate.outputs, surrogate.error_tolerances, strict=True):
        allowed = quantity(float(tolerance), signal.unit or NO_UNIT)
        bound = said[ERROR_BOUND.format(signal=signal.name)]
        reasons[f"the bound of {signal.name} is above its tolerance, {allowed}"] = (
            bound > (1.0 - ROUNDING) * tolerance
        )
    reasons["inputs are unlike those of the training (novelty above 1)"] = said[NOVELTY] > 1
    reasons["inputs were out of their ranges"] = said[IN_RANGE] == 0
    if OUTPUTS_IN_RANGE in said:
        reasons["outputs are out of their ranges in the training"] = said[OUTPUTS_IN_RANGE] == 0
    return reasons


def _parts(
    bad: Flags, reasons: Mapping[str, Flags], times: FloatArray
) -> tuple[UntrustedPart, ...]:
    """Return the parts in which samples are not trusted, in the order of time."""
    at = np.flatnonzero(bad)
    if not len(at):
        return ()
    apart = max(1.0, APART * len(bad))
    pieces = np.split(at, np.flatnonzero(np.diff(at) > apart) + 1)
    parts = []
    for piece in pieces:
        whole = slice(piece[0], piece[-1] + 1)
        counts = {why: int(np.count_nonzero(flags[whole])) for why, flags in reasons.items()}
        parts.append(
            UntrustedPart(
                begin_s=float(times[piece[0]]),
                end_s=float(times[piece[-1]]),
                samples=len(piece),
                share=len(piece) / (piece[-1] + 1 - piece[0]),
                why=tuple(sorted((w for w, n in counts.items() if n), key=lambda w: -counts[w])),
            )
        )
    return tuple(parts)
