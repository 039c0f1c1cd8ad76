"""This module compares an FMU with its model at equal accuracy, in a sentence and a table."""

from __future__ import annotations

from slide_fmu.core.measures import percent
from slide_fmu.core.readable import duration
from slide_fmu.report.html_report import ReportSection
from slide_fmu.report.prose import sentences
from slide_fmu.report.table import ReportTable
from slide_fmu.validation.error_figures import SpeedFigures, Timing

MEANING = (
    "The model's solver is loosened until its error is that of the FMU; compared is the fastest "
    "setting whose error is no larger. Functions are integrated sample by sample, and over whole "
    "motions by one call of scipy's solve_ivp, as their users would do it. Errors are those of "
    "known inputs: RMSEs over the RMS of the truth about its mean, their RMS over the outputs. "
    "The FMU is timed in fmpy.simulate_fmu, as its users run it. All times are CPU times."
)


TITLE = "Time at equal accuracy"

FAR_BETTER = 1 / 3
"""A model whose error is smaller than this part of the FMU's is not its equal, but far better."""


def timing_text(timing: Timing) -> str:
    """Say how long a step of an FMU takes, and how much longer its model takes where compared."""
    step = f"A step takes {timing.fmu_step_us:.3g} µs."
    return step if timing.speed is None else f"{step} {speed_text(timing.speed)}"


def speed_text(speed: SpeedFigures) -> str:
    """Say how much longer the model takes, by which solver, and how accurate both are."""
    return " ".join(sentences("speed.txt", speed=speed, far_better=_is_far_better(speed)))


def speed_in_short(timing: Timing) -> str:
    """Say how long a step of an FMU takes, and what its model is compared at, in a few words.

    The large number of a verdict stands above: how many times as long the model takes.
    """
    step, speed = f"A step takes {timing.fmu_step_us:.3g} µs", timing.speed
    if speed is None:
        return f"{step}."
    if not speed.can_be_loosened:
        at = ""
    elif speed.loosened.relative_error == 0.0 or _is_far_better(speed):
        at = ", but is more accurate"
    else:
        at = " at equal accuracy"
    return f'{step}; its model takes this many times as long{at} (see "{TITLE}").'


def _is_far_better(speed: SpeedFigures) -> bool:
    return speed.loosened.relative_error < FAR_BETTER * speed.relative_error


def speed_section(speed: SpeedFigures) -> ReportSection:
    """Return the section with errors and times of the FMU, and of its model at both settings."""
    rows = [("FMU", percent(speed.relative_error), duration(speed.seconds))]
    rows += [
        (
            f"{name}: {solved.solver} with {solved.setting}",
            percent(solved.relative_error),
            duration(solved.seconds),
        )
        for name, solved in (
            ("model at equal accuracy", speed.loosened),
            ("finest model, the truth", speed.finest),
        )
    ]
    heading = ("in one run on one machine", "relative RMSE", "a simulated second takes")
    text = f"{speed_text(speed)} {MEANING}"
    return ReportSection(TITLE, text, ReportTable.of(heading, rows))
