"""Remarks tell the user what to know about a calibration."""

from __future__ import annotations

import numpy as np

from slide_fmu.apps.calibrate.measurements import Measurements
from slide_fmu.apps.calibrate.problem import CalibrationProblem
from slide_fmu.apps.calibrate.result import ALIKE, POOR, WIDE, FittedParameter, OutputFit
from slide_fmu.apps.calibrate.uncertainty import Uncertainty
from slide_fmu.core.measures import percent

MOST_OUTSIDE = 0.01
"""Largest share of samples of a record outside the ranges of the training."""


def remarks_about(
    problem: CalibrationProblem,
    parameters: tuple[FittedParameter, ...],
    fits: tuple[OutputFit, ...],
    uncertainty: Uncertainty,
    error_known: bool,
) -> tuple[str, ...]:
    """Describe what is not determined, does not fit, or is not known, one sentence each."""
    found = [p.remark for p in parameters if p.remark is not None]
    found += [*_left_out(problem.measurements), *_alike(parameters, uncertainty)]
    found += [
        f"{fit.name} is met to {percent(fit.relative)} only: the surrogate does not follow "
        "this record; check units, columns, signs and the pairing of samples"
        for fit in fits
        if fit.relative > POOR
    ]
    if uncertainty.short:
        time = uncertainty.correlation_time * problem.surrogate.window.step
        found.append(
            f"residuals remember {time:.3g} s, and the record is only a few times as long: the "
            "intervals may be too narrow; record longer"
        )
    outside = _outside(problem)
    if outside > MOST_OUTSIDE:
        found.append(
            f"{percent(outside)} of the samples follow inputs outside the ranges of the "
            "training, where the surrogate may be wrong: the intervals do not include that"
        )
    if not error_known:
        found.append(
            "the surrogate's own error is not known: the intervals count noise alone; take an FMU "
            "that slide-fmu run has measured"
        )
    return tuple(found)


def _left_out(measurements: Measurements) -> list[str]:
    """Describe the parts of the records that do not count."""
    found, short = [], measurements.left_out
    if short:
        found.append(
            f"{len(short)} of {len(short) + len(measurements.inputs)} records or parts of "
            f"them, with {sum(short)} samples, are no longer than the {measurements.lead} samples "
            "that do not count, since the inputs before are unknown: they are left out; record "
            "longer at one go"
        )
    missing = ~np.isfinite(measurements.scored[:, measurements.measured])
    if missing.any():
        found.append(
            f"{int(missing.sum())} of {missing.size} measured outputs are missing and do not count"
        )
    return found


def _alike(parameters: tuple[FittedParameter, ...], uncertainty: Uncertainty) -> list[str]:
    """Name parameters that can hardly be distinguished."""
    names = [found.parameter.name for found in parameters]
    first, second = np.nonzero(np.triu(np.abs(uncertainty.correlation), 1) > ALIKE)
    return [
        f"{names[i]} and {names[j]} can hardly be distinguished by this record (correlation "
        f"{uncertainty.correlation[i, j]:.3f}): fix one of them, or record other inputs"
        for i, j in zip(first, second, strict=True)
        if max(parameters[i].share, parameters[j].share) > WIDE
    ]


def _outside(problem: CalibrationProblem) -> float:
    """Return the share of counting samples that follow inputs outside their ranges."""
    lead, records = problem.measurements.lead, problem.measurements.inputs
    known = np.concatenate([problem.surrogate.inputs_in_range(u)[lead:] for u in records])
    return float(1 - known.mean())
