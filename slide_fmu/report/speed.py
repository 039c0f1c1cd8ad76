"""This module compares an FMU with its model at equal accuracy, in a sentence and a table."""

from __future__ import annotations

from slide_fmu.core.measures import percent
from slide_fmu.core.readable import duration, ratio_text
from slide_fmu.report.html_report import ReportSection
from slide_fmu.report.table import ReportTable
from slide_fmu.validation.error_figures import SolverSetting, SpeedFigures, Timing

MEANING = (
    "The model's solver is loosened until its error is that of the FMU; compared is the fastest "
    "setting whose error is no larger. Errors are those of known inputs: RMSEs over the RMS of "
    "the truth about its mean, their RMS over the outputs. Of the FMU, set, doStep and get of its "
    "outputs through fmpy are timed."
)


FAR_BETTER = 1 / 3
"""A model whose error is smaller than this part of the FMU's is not its equal, but far better."""


def timing_text(found: Timing) -> str:
    """Say how long a step of an FMU takes, and how much longer its model takes where compared."""
    step = f"A step takes {found.fmu_step_us:.3g} µs."
    return step if found.speed is None else f"{step} {speed_text(found.speed)}"


def speed_text(found: SpeedFigures) -> str:
    """Say how much longer the model takes, by which solver, and how accurate both are."""
    loosened, finest = found.loosened, found.finest
    far_better = loosened.relative_error < FAR_BETTER * found.relative_error
    times = f"takes {ratio_text(found.ratio)} times as long"
    if not found.can_be_loosened:
        return (
            f"Its model, by {finest.solver} {finest.setting}, {times}; there is no other setting "
            f"with the error of the FMU ({percent(found.relative_error)})."
        )
    if loosened.relative_error == 0.0:
        text = (
            f"Its model, by {_by(finest)}, {times}: no looser setting that was tried is as "
            f"accurate as the FMU ({percent(found.relative_error)})."
        )
    elif far_better:
        text = (
            f"The FMU cannot be compared at equal accuracy: {_name(loosened)} {times} by "
            f"{_by(loosened)}, whose error is {percent(loosened.relative_error)}, the FMU's "
            f"{percent(found.relative_error)}; looser settings fail or err more than the FMU. The "
            f"truth is {_by(finest)}, which {_more(found)}."
        )
    else:
        text = (
            f"At equal accuracy {_name(loosened)} {times}: {_by(loosened)} has an error "
            f"of {percent(loosened.relative_error)}, the FMU {percent(found.relative_error)}. The "
            f"truth is {_by(finest)}, which {_more(found)}."
        )
    if not found.complete:
        text += " The search for faster settings was stopped, since it took long."
    return text


def _name(solved: SolverSetting) -> str:
    return "its model" if solved.model == "reference" else "the model that made its data"


def _by(solved: SolverSetting) -> str:
    return f"{solved.solver} with {solved.setting}"


def _more(found: SpeedFigures) -> str:
    return f"takes {ratio_text(found.finest.seconds / found.seconds)} times as long as the FMU"


def speed_section(found: SpeedFigures) -> ReportSection:
    """Return the section with errors and times of the FMU, and of its model at both settings."""
    rows = [("FMU", percent(found.relative_error), duration(found.seconds))]
    rows += [
        (f"{name}: {_by(solved)}", percent(solved.relative_error), duration(solved.seconds))
        for name, solved in (
            ("model at equal accuracy", found.loosened),
            ("finest model, the truth", found.finest),
        )
    ]
    heading = ("in one run on one machine", "relative RMSE", "a simulated second takes")
    text = f"{speed_text(found)} {MEANING}"
    return ReportSection("Time at equal accuracy", text, ReportTable.of(heading, rows))
