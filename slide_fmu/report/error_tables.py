"""This module makes tables of errors by output, of times, and of errors by parameters."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from slide_fmu.core.measures import percent
from slide_fmu.core.readable import decimal, quantity
from slide_fmu.report.table import ReportTable
from slide_fmu.validation.error_figures import (
    OutputFigures,
    ParameterFigures,
    ParameterPoint,
    Timing,
    ValidationFigures,
)

SIZE = "RMS of the reference about its mean"
RELATIVE = "relative RMSE"
KNOWN = "relative RMSE, known to the step's end"
PLAIN = "relative RMSE, plain call"
"""Columns of tables of errors. Where inputs move, both calls have one."""

WORST = 5
"""Number of the worst values of physical parameters that are shown."""


def percent_or_nothing(value: float | None) -> str:
    """Return a fraction as per cent; an empty text for None."""
    return "" if value is None else percent(value)


def accuracy_table(validations: Mapping[str, ValidationFigures]) -> ReportTable:
    """Return the errors of every output in each validation."""
    heading = (
        "inputs",
        "output",
        SIZE,
        "RMSE",
        KNOWN if all(v.moving for v in validations.values()) else RELATIVE,
        "median of trajectories (10 % .. 90 %)",
        "largest error",
        PLAIN,
        "relative RMSE of the data's model",
        "noise of what was measured",
        "run freely",
    )
    rows = ((n, *_accuracy_cells(o)) for n, v in validations.items() for o in v.outputs)
    return ReportTable.of(heading, rows).without_empty_columns()


def _accuracy_cells(output: OutputFigures) -> tuple[str, ...]:
    unit, single = output.unit, output.relative_rmse_of_trajectories
    others = (
        output.plain_relative_rmse,
        output.model_relative_rmse,
        output.relative_noise_floor,
        output.free_relative_rmse,
    )
    return (
        output.name,
        quantity(output.rms_reference_about_mean, unit),
        quantity(output.rmse, unit),
        percent(output.relative_rmse),
        f"{percent(single.median)} ({percent(single.p10)} .. {percent(single.p90)})",
        quantity(output.max_error, unit),
        *map(percent_or_nothing, others),
    )


def noise_sentences(outputs: Iterable[OutputFigures]) -> list[str]:
    """Say how much of the errors on records is noise of what was measured, where it is known."""
    return [
        _noise(output, output.relative_noise_floor)
        for output in outputs
        if output.relative_noise_floor is not None
    ]


def _noise(output: OutputFigures, floor: float) -> str:
    """Say how much of an error on a record is noise, and how much comes from the window."""
    noise = f"{output.name}: {percent(floor)} is noise"
    if output.free_relative_rmse is None:
        return noise
    return f"{noise}; free of the window the error is {percent(output.free_relative_rmse)}"


def timing_table(timing: Timing) -> ReportTable:
    """Return the time of a step of the FMU and of the reference."""
    rows = [("FMU, with all that it says of its error", f"{timing.fmu_step_us:.3g} µs")]
    if timing.reference_step_us is not None:
        rows.append(("reference system as it is", f"{timing.reference_step_us:.3g} µs"))
    return ReportTable.of(
        ("median; of the FMU: set, doStep and get through fmpy", "per step"), rows
    )


def parameter_table(figures: ParameterFigures) -> ReportTable:
    """Return the errors by physical parameters.

    All corners are shown, and the worst ``WORST`` of the other values.
    """

    def rows() -> Iterator[tuple[str, ...]]:
        parts = ("corner", figures.corners, None), ("measured, worst", figures.unseen, WORST)
        for what, points, most in parts:
            for point in sorted(points, key=_error_at, reverse=True)[:most]:
                values = (decimal(point.values[name], 4) for name in figures.names)
                yield what, *values, percent(_error_at(point))

    return ReportTable.of(("values", *figures.names, "relative RMSE"), rows())


def _error_at(point: ParameterPoint) -> float:
    return max(point.relative_rmse)
