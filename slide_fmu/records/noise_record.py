"""A noise record holds outputs that were measured at rest, so that they are noise of the sensors.

It must be measured in the same way as the other records, which then have the same noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from slide_fmu.core.autoregression import fit_autoregression
from slide_fmu.core.signals import FloatArray
from slide_fmu.record_files.record import Record, RecordError
from slide_fmu.records.clock import Clock, clock_of_record
from slide_fmu.records.findings import examine_alone, messages, require_sound
from slide_fmu.records.preparation import gap_free_ranges
from slide_fmu.records.resampling import LONGER, plan_resampling, resampled

LEAST = 500
"""The spectrum of noise is known from at least this many samples."""
SHORTEST = 100
"""Pieces between gaps with fewer samples do not count."""
QUIET = 0.5
"""An output has moved if its deviation is more than this part of that in the other records."""


@dataclass(frozen=True, eq=False)
class Noise:
    """Noise of outputs alone, with the step of the trajectories.

    Attributes:
        pieces: pieces without gaps, shape (N, n_outputs) each, in the outputs' units.
        file: name of the file that they come from.
        digest: SHA-256 of the file.
        remarks: remarks on the file, one sentence each.
    """

    pieces: tuple[FloatArray, ...]
    file: str
    digest: str
    remarks: tuple[str, ...] = ()


def require_alike(
    noise: Record, records: Sequence[Record], outputs: tuple[str, ...]
) -> tuple[str, ...]:
    """Refuse a noise record that was not measured as the other records were.

    Returns:
        Remarks on it that need no correction.

    Raises:
        RecordError: a column is missing or cannot be used, a unit or the step is another one, or
            the file is one of the other records.
    """
    findings = examine_alone(noise, outputs)
    for record in records:
        if record.digest == noise.digest:
            raise RecordError(
                f"noise record {noise.path} holds the same bytes as {record.path}; expected a "
                "record that was taken while nothing moved: name another one, or leave out "
                "system.noise_record"
            )
    require_sound(findings)
    remarks = list(messages(findings))
    for name in outputs:
        own, wanted = noise.units[name], records[0].units[name]
        if not own and wanted:
            remarks.append(
                f"noise record {noise.path}, column {name!r} tells no unit; it is taken to be "
                f"{wanted!r}, that of {records[0].path}"
            )
        elif own != wanted:
            raise RecordError(
                f"noise record {noise.path}, column {name!r}: the unit is {own!r}; expected "
                f"{wanted!r}, that of {records[0].path}: correct the header, or convert the values"
            )
    own_step, step = clock_of_record(noise).step, clock_of_record(records[0]).step
    if max(own_step / step, step / own_step) > LONGER:
        raise RecordError(
            f"noise record {noise.path} has a step of {own_step:.6g} s; expected {step:.6g} s, "
            f"that of {records[0].path}, since noise has another spectrum at another step: record "
            "it as the others"
        )
    return tuple(remarks)


def noise_at_rest(
    noise: Record, records: Sequence[Record], outputs: tuple[str, ...], step: float
) -> Noise:
    """Bring a noise record to the step of the trajectories, in s, as its records are brought.

    Raises:
        RecordError: as in ``require_alike``; or the record is too short, or an output is constant
            in it, or moves.
    """
    remarks = require_alike(noise, records, outputs)
    clock = clock_of_record(noise)
    whole = _resampled(noise, clock, outputs, step)
    pieces = tuple(piece for piece in whole if len(piece) >= SHORTEST)
    samples = sum(len(piece) for piece in pieces)
    if samples < LEAST:
        raise RecordError(
            f"noise record {noise.path} has {samples} samples of {step:.6g} s in which all of "
            f"{list(outputs)} are known, in pieces of at least {SHORTEST} without a gap; "
            f"expected at least {LEAST}: record the outputs at rest for longer, without gaps"
        )
    for name, moving in zip(outputs, _deviations(records, outputs), strict=True):
        _require_quiet(noise, name, float(moving))
    return Noise(pieces, Path(noise.path).name, noise.digest, remarks)


def remarks_on_noise(
    noise: Noise, records: Sequence[Record], outputs: tuple[str, ...]
) -> tuple[str, ...]:
    """Say the size of the noise of each output relative to its deviation, and its colour."""
    remarks, deviations = [*noise.remarks], _deviations(records, outputs)
    for index, (name, deviation) in enumerate(zip(outputs, deviations, strict=True)):
        model = fit_autoregression([piece[:, index] for piece in noise.pieces])
        size = float(np.sqrt(model.variances[0])) / deviation
        colour = "white"
        if model.order:
            colour = (
                f"coloured: an autoregression of order {model.order} predicts all of it but "
                f"{100 * model.unpredictable:.2g} %"
            )
        remarks.append(
            f"{noise.file}: noise of {name!r} is {100 * size:.3g} % of its standard deviation, "
            f"and {colour}; residuals are weighted by it"
        )
    return tuple(remarks)


def _resampled(
    noise: Record, clock: Clock, outputs: tuple[str, ...], step: float
) -> tuple[FloatArray, ...]:
    """Return pieces in which all outputs are known, (N, n_outputs) each, at a step in s."""
    plan = plan_resampling(clock.step, step, clock.jitter, clock.longest(len(noise.time)))
    values = noise.chosen(outputs)
    rows = [slice(begin, end) for begin, end in gap_free_ranges(noise, clock, outputs)]
    pieces = [resampled(noise.time[part], values[part], plan, "smooth") for part in rows]
    return tuple(piece for piece in pieces if len(piece))


def _deviations(records: Sequence[Record], outputs: tuple[str, ...]) -> FloatArray:
    """Return the standard deviations of outputs in all records, (n_outputs,)."""
    values = np.concatenate([record.chosen(outputs) for record in records])
    return np.asarray(np.nanstd(np.where(np.isfinite(values), values, np.nan), axis=0))


def _require_quiet(noise: Record, name: str, moving: float) -> None:
    """Refuse an output that is constant at rest, or deviates nearly as it does when moving."""
    values = noise.columns[name]
    values = values[np.isfinite(values)]
    at_rest = float(np.std(values))
    if values.min() == values.max():
        raise RecordError(
            f"noise record {noise.path}, column {name!r}: the value is the same in all samples; "
            "expected the noise of its sensor: record it with its full resolution, or leave out "
            "system.noise_record"
        )
    if at_rest > QUIET * moving:
        raise RecordError(
            f"noise record {noise.path}, column {name!r}: the standard deviation is "
            f"{noise.with_unit(name, at_rest)}, {100 * at_rest / moving:.3g} % of what it is in "
            f"the other records; expected at most {100 * QUIET:g} %, while nothing moves: record "
            "the outputs at rest"
        )
