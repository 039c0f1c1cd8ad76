"""The verdict gives a user the most important facts about an FMU in three sentences.

They are the error in the user's call, how much of it is trusted, and what to avoid. Console,
report, card and ``slide-fmu info`` begin with it. A report also has large numbers and commands.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from slide_fmu.core.measures import percent
from slide_fmu.core.readable import decimal, ratio_text
from slide_fmu.report.html_report import Fact, Verdict
from slide_fmu.report.prose import sentences
from slide_fmu.report.row_tables import CALLS, FAR, call_of, length_of
from slide_fmu.report.run_figures import RunFigures
from slide_fmu.report.speed import timing_text
from slide_fmu.surrogate.description import SurrogateDescription
from slide_fmu.validation.error_figures import Timing
from slide_fmu.validation.row import ALL, FINER, OF_TRAINING, SMOOTH, YOURS, Call, Row, row_at
from slide_fmu.validation.task import BEYOND, HELD_OUT, IN_RANGE

MOST_NAMED = 3
"""Number of kinds of input that the verdict names as such to avoid."""

EXAMPLES = 3
"""So few motions of a kind are examples of it; their number is said."""

LEARNT = "inputs as in the training"
"""The inputs in range, in words."""

MISSING = 0.02
"""A bound that covers less than its confidence by more than this is no longer what it promises."""

CONFIDENCE = 0.95
"""The confidence of the bounds of rows."""


def verdict(rows: Sequence[Row]) -> tuple[str, ...]:
    """Return three sentences about an FMU, after one on your inputs; none if not measured."""
    if not rows:
        return ()
    call = call_of(rows)
    main = main_rows(rows, call)
    return (
        *on_your_inputs(rows),
        *sentences(
            "verdict.txt",
            call=CALLS[call],
            main=main,
            inputs=LEARNT if not main or main[0].group == IN_RANGE else main[0].group,
            smooth=_smooth(rows, call),
            bounded=[r for r in main if r.covered is not None and r.trusted is not None],
            unfilled=[r for r in main if not r.counted],
            far=FAR,
            most_named=MOST_NAMED,
            examples=EXAMPLES,
            **_to_avoid(rows, call),
        ),
    )


def on_your_inputs(rows: Sequence[Row]) -> tuple[str, ...]:
    """Return a sentence or two on each file of inputs that judges an FMU; none without one."""
    call = call_of(rows)
    yours = dict.fromkeys(row.inputs for row in rows if row.group == YOURS)
    at = ([row_at(rows, YOURS, name, call, n) for n in (1.0, float(FINER))] for name in yours)
    files = [[row for row in one if row is not None] for one in at]
    of_files = (sentences("your_inputs.txt", call=CALLS[call], rows=one) for one in files if one)
    return tuple(" ".join(paragraphs) for paragraphs in of_files)


def main_rows(rows: Sequence[Row], call: Call) -> list[Row]:
    """Return the rows of all inputs in range, or of the first group, at h and at a finer step."""
    group = next((row.group for row in rows if row.group == IN_RANGE), None)
    group = group or next((row.group for row in rows), IN_RANGE)
    main = (row_at(rows, group, ALL, call, steps) for steps in (1.0, float(FINER)))
    return [row for row in main if row is not None]


def _smooth(rows: Sequence[Row], call: Call) -> list[Row]:
    """Return the rows of the first kind of smooth inputs at h and at a finer step."""
    smooth = [row for row in rows if row.group == SMOOTH and row.inputs != OF_TRAINING]
    kinds = [row.inputs for row in smooth[:1]]
    at = (row_at(smooth, SMOOTH, kind, call, n) for kind in kinds for n in (1.0, float(FINER)))
    return [row for row in at if row is not None]


def _to_avoid(rows: Sequence[Row], call: Call) -> dict[str, object]:
    """Return what is to be avoided: kinds of input at the own step, and others at the finer one.

    Kinds beyond the range and sums of kinds are left out. ``judged`` tells whether any inputs
    could be judged.
    """
    kinds = [row for row in rows if row.group != BEYOND and row.inputs != ALL]
    at, finer = ([row for row in kinds if row.is_at(call, steps)] for steps in (1.0, FINER))
    bad = _worst_first(row for row in at if row.valid is False)
    silent = [row for row in bad if row.honest is not True]
    known = {(row.group, row.inputs) for row in silent}
    return {
        "judged": any(
            row.valid is not None for row in rows if row.is_at(call, 1.0) and row.group != BEYOND
        ),
        "bad": bad,
        "silent": silent,
        "silent_at_finer": _worst_first(
            row for row in finer if row.honest is False and (row.group, row.inputs) not in known
        ),
        "usual_but_far": sorted(
            (row for row in at if row.valid and row.far_off), key=lambda row: -row.error
        ),
    }


def _worst_first(rows: Iterable[Row]) -> list[Row]:
    """Order rows: those that do not say where they are wrong come first."""
    return sorted(
        rows, key=lambda row: (row.honest is not False, -(row.silent or 0.0), -row.error)
    )


def verdict_of(measured: RunFigures, surrogate: SurrogateDescription) -> Verdict:
    """Return the verdict on an FMU, with its numbers and commands."""
    in_range = measured.in_range
    commands = [
        ("Read it", f"slide-fmu info {measured.name}.fmu"),
        (
            "Run it",
            f'fmpy.simulate_fmu("{measured.name}.fmu", input=table, stop_time=T, '
            f"output_interval={surrogate.window.step:.10g})",
        ),
        (
            "Measure it again",
            f"slide-fmu validate {measured.name}.fmu --trajectories {in_range.trajectories} "
            f"--seed {in_range.seed}",
        ),
        ("Make it again", measured.command),
    ]
    facts = verdict_facts(measured.rows, in_range.timing, surrogate.memory_s)
    return Verdict(verdict(measured.rows), facts, commands)


def verdict_facts(rows: Sequence[Row], timing: Timing, memory_s: float) -> list[Fact]:
    """Return the large numbers of a verdict: error, bound, trust, validity, speed and memory.

    The memory is the time in s for which outputs depend on an input.
    """
    call = call_of(rows)
    own = next(iter(main_rows(rows, call)), None)
    yours = [row for row in rows if row.group == YOURS and row.is_at(call, 1.0)]
    facts = [
        *(_of_your_inputs(row, call) for row in yours),
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


def _of_your_inputs(row: Row, call: Call) -> Fact:
    """Return the error under a file of your inputs, with what its bound covers."""
    covered = "" if row.covered is None else f"; the bound covers {percent(row.covered)}"
    text = f"Error {CALLS[call].within} at {length_of(row)} under the {row.inputs}{covered}."
    return Fact("Your inputs", percent(row.error), text, False if row.far_off else None)


def _of_row(row: Row, call: Call) -> list[Fact]:
    """Return the numbers of all inputs in range, in the call of an importer."""
    of_output = "" if len(row.outputs) == 1 else " of the worst output"
    text = f"Relative RMSE{of_output} {CALLS[call].within} at {length_of(row)}, on unseen inputs."
    facts = [Fact("Error", percent(row.error), text, False if row.far_off else None)]
    if row.covered is not None:
        good = row.covered >= CONFIDENCE - MISSING
        below = f"This part of the samples lies below the error bound of {percent(CONFIDENCE)}."
        facts.append(Fact("Bound", percent(row.covered), below, good))
    if row.trusted is not None:
        facts.append(Fact("Trusted", percent(row.trusted), "Here the FMU says that it is right."))
    return facts


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


def _speed(timing: Timing) -> Fact:
    if timing.speed is None:
        text = "A step of the FMU takes this time."
        return Fact("Speed", f"{timing.fmu_step_us:.3g} µs", text)
    good = None if timing.speed.ratio >= 1 else False
    return Fact("Speed", f"{ratio_text(timing.speed.ratio)} times", timing_text(timing), good)
