"""This module gives the large numbers and the commands of a verdict."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from slide_fmu.core.measures import percent
from slide_fmu.core.readable import decimal, ratio_text
from slide_fmu.report.html_report import Fact, Verdict
from slide_fmu.report.row_tables import CALLS, FAR, call_of, length_of
from slide_fmu.report.run_figures import RunFigures
from slide_fmu.report.speed import timing_text
from slide_fmu.report.verdict import main_rows, verdict
from slide_fmu.surrogate.description import SurrogateDescription
from slide_fmu.validation.error_figures import Timing
from slide_fmu.validation.row import ALL, Call, Row
from slide_fmu.validation.task import BEYOND, HELD_OUT, IN_RANGE

MISSING = 0.02
"""A bound that covers less than its confidence by more than this is no longer what it promises."""

CONFIDENCE = 0.95
"""The confidence of the bounds of rows."""


def verdict_of(measured: RunFigures, surrogate: SurrogateDescription) -> Verdict:
    """Return the verdict on an FMU, with its numbers and commands."""
    found = measured.in_range
    commands = [
        ("Read it", f"slide-fmu info {measured.name}.fmu"),
        (
            "Run it",
            f'fmpy.simulate_fmu("{measured.name}.fmu", input=table, stop_time=T, '
            f"output_interval={surrogate.window.step:.10g})",
        ),
        (
            "Measure it again",
            f"slide-fmu validate {measured.name}.fmu --trajectories {found.trajectories} "
            f"--seed {found.seed}",
        ),
        ("Make it again", measured.command),
    ]
    facts = facts_of(measured.rows, found.timing, surrogate.memory_s)
    return Verdict(verdict(measured.rows), facts, commands)


def facts_of(rows: Sequence[Row], timing: Timing, memory_s: float) -> list[Fact]:
    """Return the large numbers of a verdict: error, bound, trust, validity, speed and memory.

    The memory is the time in s for which outputs depend on an input.
    """
    call = call_of(rows)
    own = next(iter(main_rows(rows, call)), None)
    facts = [
        *([] if own is None else _of_row(own, call)),
        _validity([row for row in rows if row.is_at(call, 1.0)]),
        _speed(timing),
        Fact(
            "Memory",
            f"{decimal(memory_s)} s",
            "Outputs depend on inputs no older than this.",
        ),
    ]
    return [fact for fact in facts if fact is not None]


def _of_row(row: Row, call: Call) -> list[Fact]:
    """Return the numbers of all inputs in range, in the call of an importer."""
    of_output = "" if len(row.outputs) == 1 else " of the worst output"
    text = f"Relative RMSE{of_output} {CALLS[call].within} at {length_of(row)}, on unseen inputs."
    found = [Fact("Error", percent(row.error), text, False if row.far_off else None)]
    if row.covered is not None:
        good = row.covered >= CONFIDENCE - MISSING
        below = f"This part of the samples lies below the error bound of {percent(CONFIDENCE)}."
        found.append(Fact("Bound", percent(row.covered), below, good))
    if row.trusted is not None:
        found.append(Fact("Trusted", percent(row.trusted), "Here the FMU says that it is right."))
    return found


def _validity(rows: Iterable[Row]) -> Fact | None:
    """Return how many kinds of inputs the FMU is valid for; of unseen kinds none is expected."""
    judged = [row for row in rows if row.valid is not None and row.inputs != ALL]
    if not judged:
        return None
    learnt = [bool(row.valid) for row in judged if row.group == IN_RANGE]
    good = [bool(row.valid) for row in judged if row.group not in (BEYOND, HELD_OUT)]
    value = f"{sum(bool(row.valid) for row in judged)} of {len(judged)}"
    far = sum(bool(row.valid) and row.far_off for row in judged)
    text = (
        "Valid for these kinds of input, of those that were measured: "
        f"{sum(learnt)} of {len(learnt)} kinds of its training."
    )
    text += f" For {far} of them it is {FAR}." if far else ""
    return Fact("Validity", value, text, all(good) and not far)


def _speed(found: Timing) -> Fact:
    if found.speed is None:
        text = "A step of the FMU takes this time."
        return Fact("Speed", f"{found.fmu_step_us:.3g} µs", text)
    good = None if found.speed.ratio >= 1 else False
    return Fact("Speed", f"{ratio_text(found.speed.ratio)} times", timing_text(found), good)
