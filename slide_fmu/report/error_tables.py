"""This module makes tables of errors by output, in the plain call, at rest and by parameters."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from slide_fmu.core.measures import percent
from slide_fmu.core.readable import decimal, quantity
from slide_fmu.report.table import ReportTable
from slide_fmu.validation.box import TITLES
from slide_fmu.validation.error_figures import (
    BoxFigures,
    OutputFigures,
    ParameterFigures,
    ParameterPoint,
    PlainCallFigures,
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


def short_accuracy_table(validation: ValidationFigures) -> ReportTable:
    """Return the errors of every output of one validation, as a console shows them."""
    return accuracy_table({"": validation}).columns(
        "output", SIZE, "RMSE", RELATIVE, KNOWN, "largest error", PLAIN
    )


def timing_table(timing: Timing) -> ReportTable:
    """Return the time of a step of the FMU and of the reference."""
    rows = [("FMU, with all that it says of its error", f"{timing.fmu_step_us:.3g} µs")]
    if timing.reference_step_us is not None:
        rows.append(("reference system as it is", f"{timing.reference_step_us:.3g} µs"))
    return ReportTable.of(
        ("median; of the FMU: set, doStep and get through fmpy", "per step"), rows
    )


def plain_call_table(found: PlainCallFigures) -> ReportTable:
    """Return the errors of the plain call; columns of what was not measured are left out."""
    heading = (
        "output",
        "smooth inputs",
        "worst smooth motion",
        "inputs as in the training",
        "inputs known to the step's end",
        "covered by the bound under smooth inputs",
        "smooth inputs, which are held for a step",
    )
    rows = (
        (
            output.name,
            *map(
                percent_or_nothing,
                (
                    output.smooth,
                    output.smooth_worst,
                    output.rough,
                    output.known_to_step_end,
                    output.smooth_covered,
                    output.smooth_if_held,
                ),
            ),
        )
        for output in found.outputs
    )
    title = "plain call, fmpy.simulate_fmu(fmu, input=table, output_interval=STEP): relative RMSE"
    return ReportTable.of(heading, rows, title).without_empty_columns()


def box_table(found: BoxFigures) -> ReportTable:
    """Return the errors at constant inputs."""
    heading = "inputs", "output", "relative RMSE", "largest error", "covered by the bound"
    rows = (
        (
            f"{TITLES[name]} ({group.points} points)",
            output.name,
            percent(output.relative_rmse),
            quantity(output.largest_error, output.unit),
            percent_or_nothing(output.covered),
        )
        for name, group in found.groups.items()
        for output in group.outputs
    )
    return ReportTable.of(heading, rows).without_empty_columns()


def parameter_table(found: ParameterFigures) -> ReportTable:
    """Return the errors by physical parameters.

    All corners are shown, and the worst ``WORST`` of the other values.
    """

    def rows() -> Iterator[tuple[str, ...]]:
        parts = ("corner", found.corners, None), ("measured, worst", found.unseen, WORST)
        for what, points, most in parts:
            for point in sorted(points, key=_error_at, reverse=True)[:most]:
                values = (decimal(point.values[name], 4) for name in found.names)
                yield what, *values, percent(_error_at(point))

    return ReportTable.of(("values", *found.names, "relative RMSE"), rows())


def _error_at(point: ParameterPoint) -> float:
    return max(point.relative_rmse)
