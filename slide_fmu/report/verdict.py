"""The verdict gives a user the most important facts about an FMU in three sentences.

They are the error in the user's call, how much of it is trusted and what the bound promises, and
what to avoid. Console, report, card and ``slide-fmu info`` show it. A report also has large
numbers and commands; all else stands in its sections.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from slide_fmu.core.measures import percent
from slide_fmu.core.readable import decimal, ratio_text
from slide_fmu.report.html_report import Fact, Verdict
from slide_fmu.report.prose import sentences
from slide_fmu.report.row_tables import CALLS, FAR, call_of, length_of, name_of
from slide_fmu.report.run_figures import RunFigures
from slide_fmu.report.speed import speed_in_short
from slide_fmu.surrogate.description import SurrogateDescription
from slide_fmu.validation.error_figures import Timing
from slide_fmu.validation.row import (
    ALL,
    FINER,
    FLAGGED,
    OF_TRAINING,
    YOURS,
    Call,
    Row,
    kinds_of,
    row_at,
)
from slide_fmu.validation.task import BEYOND, HELD_OUT, IN_RANGE

MOST_NAMED = 3
"""Number of kinds of input that the verdict names as such to avoid."""

LEARNT = "inputs as in the training"
"""The inputs in range, in words."""

MISSING = 0.02
"""A bound that covers less than its confidence by more than this is no longer what it promises."""

CONFIDENCE = 0.95
"""The confidence of the bounds of rows."""


@dataclass(frozen=True)
class Avoided:
    """This is a kind of input to avoid.

    Attributes:
        row: where the FMU is worst on it.
        name: the inputs, with their group where others are called likewise.
        at: the communication step in words, where it is not the own one.
        reason: how the FMU is wrong there without saying so.
    """

    row: Row
    name: str
    at: str
    reason: str


def verdict(rows: Sequence[Row]) -> tuple[str, ...]:
    """Return three sentences about an FMU; none of one that was not measured.

    The first two are about your inputs if a file of them judges it, else about those of the
    training; the third is about all kinds of input.
    """
    if not rows:
        return ()
    call = call_of(rows)
    main = _first_rows(rows, call)
    judged = [row for row in _kinds(rows) if row.is_at(call, 1.0)]
    avoided = _to_avoid(rows, call)
    named = {_kind_of(one.row) for one in avoided}
    return tuple(
        sentences(
            "verdict.txt",
            call=CALLS[call],
            main=main,
            inputs=words_of(main[0]) if main else LEARNT,
            confidence=CONFIDENCE,
            bounded=[r for r in main if r.covered is not None and r.trusted is not None],
            unfilled=[r for r in main if not r.counted],
            far=FAR,
            most_named=MOST_NAMED,
            avoided=avoided,
            reported=sum(_is_reported(row) and _kind_of(row) not in named for row in judged),
            judged=sum(row.valid is not None for row in judged),
            few=sum(row.harmful is not None and row.few for row in judged),
        )
    )


def main_rows(rows: Sequence[Row], call: Call) -> list[Row]:
    """Return the rows of all inputs in range, or of the first others, at h and at a finer step.

    Your inputs are not among them.
    """
    return _first_rows([row for row in rows if row.group != YOURS], call)


def _first_rows(rows: Sequence[Row], call: Call) -> list[Row]:
    """Return the rows of the first inputs that are shown, at h and at a finer step."""
    kinds = kinds_of(row for row in rows if row.call == call)
    first = [
        row_at(rows, group, inputs, call, steps)
        for group, inputs in kinds[:1]
        for steps in (1.0, float(FINER))
    ]
    return [row for row in first if row is not None]


def words_of(row: Row) -> str:
    """Say which inputs the first sentences are about."""
    if row.group == YOURS:
        return f"{YOURS} ({row.inputs})"
    return LEARNT if row.group == IN_RANGE else row.group


def _kinds(rows: Sequence[Row]) -> list[Row]:
    """Return the rows of single kinds of input, without those beyond the range."""
    return [row for row in rows if row.group != BEYOND and row.inputs not in (ALL, OF_TRAINING)]


def _kind_of(row: Row) -> tuple[str, str]:
    return row.group, row.inputs


def _to_avoid(rows: Sequence[Row], call: Call) -> list[Avoided]:
    """Return the kinds of input to avoid, each once: at the own step, else at the finer one.

    They are those of which the FMU does not say where it is wrong, and then large errors that it
    trusts. Where it says so itself, nobody need be warned: outputs that hardly answer to fast
    tones, for example, have large relative errors which no sample is trusted with.
    """
    kinds = _kinds(rows)
    names = Counter(inputs for _, inputs in kinds_of(kinds))
    found: dict[tuple[str, str], Row] = {}
    for steps in (1.0, float(FINER)):
        for row in kinds:
            if row.is_at(call, steps) and _is_bad(row, steps):
                found.setdefault(_kind_of(row), row)
    return [
        Avoided(
            row,
            row.inputs if names[row.inputs] == 1 else name_of(row),
            "" if row.steps == 1.0 else f" at {length_of(row)}",
            _reason(row),
        )
        for row in sorted(found.values(), key=_worst_first)
    ]


def _is_bad(row: Row, steps: float) -> bool:
    """Tell whether a kind is to be avoided; at the finer step only where the FMU is silent."""
    if steps != 1.0:
        return row.valid is False and row.honest is False
    if row.valid is None or _is_reported(row):
        return False
    return not row.valid or row.far_off


def _is_reported(row: Row) -> bool:
    """Tell whether an FMU says where it is wrong, or trusts nothing where it is far off."""
    if row.valid:
        return row.far_off and row.trusted is not None and row.trusted <= FLAGGED
    return row.valid is False and row.honest is True


def _worst_first(row: Row) -> tuple[bool, float, float]:
    return bool(row.valid), -(row.silent or 0.0), -row.error


def _reason(row: Row) -> str:
    """Say how an FMU is wrong without saying so: usually, beyond its bound, or how often."""
    if row.valid:
        return "usual for it"
    if row.uncovered and row.covered is not None:
        return f"bound covers {percent(row.covered)}"
    return "not reported" if not row.silent else f"wrong and trusted in {percent(row.silent)}"


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


def verdict_facts(rows: Sequence[Row], timing: Timing | None, memory_s: float) -> list[Fact]:
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
        None if timing is None else _speed(timing),
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
    at = f"{CALLS[call].within} at {length_of(row)}"
    text = f"Relative RMSE{of_output} {at}, under {words_of(row)}."
    facts = [Fact("Error", percent(row.error), text, False if row.far_off else None)]
    if row.covered is not None:
        good = row.covered >= CONFIDENCE - MISSING
        below = f"This part of the samples lies below the error bound of {percent(CONFIDENCE)}."
        facts.append(Fact("Bound", percent(row.covered), below, good))
    if row.trusted is not None:
        facts.append(Fact("Trusted", percent(row.trusted), "Here the FMU says that it is right."))
    return facts


def _validity(rows: Sequence[Row]) -> Fact | None:
    """Return how many kinds of inputs the FMU is valid for; of unseen kinds none is expected."""
    judged = [row for row in rows if row.valid is not None and row.inputs != ALL]
    few = sum(row.harmful is not None and row.few for row in rows if row.inputs != ALL)
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
    text += f" {few} more {'has' if few == 1 else 'have'} too few motions to tell." if few else ""
    return Fact("Validity", value, text, all(good) and not far)


def _speed(timing: Timing) -> Fact:
    if timing.speed is None:
        text = "A step of the FMU takes this time."
        return Fact("Speed", f"{timing.fmu_step_us:.3g} µs", text)
    good = None if timing.speed.ratio >= 1 else False
    return Fact("Speed", f"{ratio_text(timing.speed.ratio)} times", speed_in_short(timing), good)
