"""This module makes tables on the training: window, sizes, learning curve, stability."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from slide_fmu.core.measures import percent
from slide_fmu.core.readable import decimal
from slide_fmu.fitting.history import Curve, History, SizeTrial
from slide_fmu.memory.decay_figures import RecordSizingFigures, SizingFigures, seconds
from slide_fmu.memory.stability import AmplitudeTest, stability_figures
from slide_fmu.report.table import ReportTable
from slide_fmu.validation.error_figures import ResponseFigures


def decay_table(figures: SizingFigures) -> ReportTable:
    """Return the decay times of a system, or of a linear fit of records.

    Measured times belong to whole motions, so their last column is empty. A system may offer no
    linearized times; the row then says so.
    """
    if isinstance(figures, RecordSizingFigures):
        fitted = figures.fitted_decay_time_s
        row = "fitted", seconds(fitted.value), seconds(fitted.low), seconds(fitted.high)
        return ReportTable.of(("decay time", "slowest pole", "95 % interval from", "to"), [row])
    linearized, measured = figures.decay_time_s, figures.measured_decay_time_s
    times = ["not offered", "", ""]
    if linearized is not None:
        worst = linearized.worst, linearized.local_worst
        times = [seconds(linearized.mean), *map(seconds, worst)]
    rows = [
        ("linearized", *times),
        ("measured", seconds(measured.mean), seconds(measured.worst), ""),
    ]
    return ReportTable.of(("decay time", "mean", "worst", "at the worst instant"), rows)


def stability_table(tests: tuple[AmplitudeTest, ...]) -> ReportTable:
    """Return the results of the tests of fading memory and boundedness."""
    heading = "amplitude", "median difference", "largest difference", "growth", "test"
    rows = (
        (
            f"{figures.amplitude:g} x",
            _percent(figures.median_difference),
            _percent(figures.largest_difference),
            "inf" if figures.growth is None else decimal(figures.growth),
            "passed" if test.problem is None else test.problem,
        )
        for test, figures in zip(tests, stability_figures(tests), strict=True)
    )
    return ReportTable.of(heading, rows)


def training_table(histories: Mapping[str, History]) -> ReportTable:
    """Return steps and errors of the trainings."""

    def rows() -> Iterator[Sequence[str]]:
        for stage, history in histories.items():
            best = min(history.validation_error)
            error = percent(best) if history.relative else f"{decimal(best, 4)}, scaled"
            yield stage, str(history.step[-1]), error

    return ReportTable.of(("stage", "steps or iterations", "best validation loss"), rows())


def size_table(sizes: Sequence[SizeTrial]) -> ReportTable:
    """Return the sizes that a search has tried; of records, with the spread over their blocks."""
    spread = any(size.highest_error is not None for size in sizes)
    of_blocks = ("best block", "worst block") if spread else ()
    errors = "validation error", *of_blocks, "error still learnable"

    def shown(size: SizeTrial) -> Iterator[str]:
        blocks = (size.lowest_error, size.highest_error) if spread else ()
        for error in (size.validation_error, *blocks, size.learnable_error):
            yield "" if error is None else percent(error)

    rows = (
        (str(size.order), str(size.units), str(size.parameters), *shown(size)) for size in sizes
    )
    heading = "order", "hidden units", "parameters", *errors
    return ReportTable.of(heading, rows, "sizes tried")


def curve_table(curve: Curve) -> ReportTable:
    """Return a learning curve."""
    rows = (
        (
            str(point.trajectories),
            percent(point.validation_error),
            percent(point.training_error),
            f"{point.seconds:.0f}",
        )
        for point in curve.points
    )
    heading = "trajectories", "validation error", "training error", "time of data and fit / s"
    return ReportTable.of(heading, rows, "learning curve")


def response_table(figures: ResponseFigures) -> ReportTable:
    """Return the deviations of the learnt response matrix from the exact one."""
    above, relative = figures.max_above_diagonal, figures.max_above_diagonal_relative
    rows = [
        (
            "largest deviation, relative to the largest entry",
            percent(figures.max_deviation_relative),
        ),
        ("largest entry above the diagonal, absolute", decimal(above)),
        ("the same, relative to the largest entry", percent(relative)),
    ]
    return ReportTable.of(("figure", "value"), rows)


def _percent(value: float | None) -> str:
    """Return a difference in per cent; None is infinite."""
    return "inf" if value is None else percent(value)
