"""This module makes tables of rows: one with a row for each kind of input, and one of all rows."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from slide_fmu.core.measures import FEWEST, percent
from slide_fmu.core.readable import quantity, ratio_text
from slide_fmu.core.signals import Hold
from slide_fmu.core.units import NO_UNIT
from slide_fmu.report.table import ReportTable
from slide_fmu.validation.row import (
    ALL,
    FAR_OFF,
    FINER,
    HARMFUL,
    LEAST_COVERED,
    MOST_HARMFUL,
    MOST_SILENT,
    OF_TRAINING,
    TONES,
    Call,
    Row,
    RowOutput,
    kinds_of,
    row_at,
)
from slide_fmu.validation.task import BEYOND


@dataclass(frozen=True)
class CallWords:
    """These are the words for a call: its name in tables and pictures, and within a sentence."""

    name: str
    within: str


CALLS: dict[Call, CallWords] = {
    "plain": CallWords("plain call", "in the plain call"),
    "known": CallWords("inputs known to the step's end", "with inputs known to the step's end"),
    "model": CallWords("finest model", "in a plain call of the finest model"),
}
"""Calls in words, in the order in which they are shown."""

WORDS = (
    "The plain call is that of an ordinary importer, such as fmpy.simulate_fmu: before each step "
    "of the length H it sets what the inputs are then. h is the surrogate's own step. The error "
    "is the RMSE over the RMS of the reference about its mean, of the worst output. The usual "
    "level of an output is the 95 % quantile of its errors in range, with known inputs. A sample "
    f"is harmful if an error exceeds {HARMFUL:g} times that, and silent if it is harmful, trusted "
    "is true and the error exceeds its 95 % bound. Shares count samples from which on "
    "error_bound_filled is 1."
)
"""What the columns of all tables mean."""

RULE = (
    f"An FMU is valid on inputs of which at most {percent(MOST_HARMFUL)} of the samples are "
    f"harmful and at most {percent(MOST_SILENT)} silent, and of whose errors its bound covers at "
    f"least {percent(LEAST_COVERED)} where it trusts some samples; if only the first does not "
    f"hold, it says where it is wrong. {FEWEST} motions are needed to tell."
)
"""When an FMU is valid on inputs."""

FAR = f"far off (error above {percent(FAR_OFF)})"
"""What is said where an error is large, although it may be the usual one of an FMU."""

STEP_DIGITS = 4
"""Digits of communication steps."""

NOT_VALID = {
    None: "not valid",
    True: "not valid, and the FMU says so",
    False: "not valid, not always reported",
}
"""What is said of inputs on which an FMU is not valid, by whether it says where it is wrong; None
where that cannot be judged."""

TOO_FEW = f"too few motions to tell ({{count}} of {FEWEST})"
"""What is said of inputs of which too few motions were measured."""

TOO_FEW_OF_CELLS = f"too few motions in each cell to tell (at most {{count}} of {FEWEST})"
"""What is said of lasting tones if that is so of each amplitude and frequency."""

HELD = (
    "Inputs in range, held out and beyond the range are held over h, as in the training; at this "
    "step the importer says so by `inputs_held` = 1. All others act at their own times, but jump "
    "at multiples of h, where an importer sets them. At h/4 outputs between multiples of h count, "
    "too: there an input that changes within h counts by its mean and three moments."
)
"""What is measured of an FMU whose inputs are held."""

NEVER_FILLED = "bound not filled"
"""Where shares would stand, of an FMU whose bound never counts at a communication step."""


def explanations(rows: Sequence[Row], hold: Hold) -> str:
    """Say what the columns of a table of rows mean.

    Args:
        rows: all that was measured.
        hold: how the inputs of the FMU act between samples.
    """
    parts = {HELD: hold == "zero_order", WORDS: True, RULE: any(r.valid is not None for r in rows)}
    return " ".join(text for text, needed in parts.items() if needed)


def call_of(rows: Iterable[Row]) -> Call:
    """Return the call by which an FMU is judged: the plain one, or if not measured the known."""
    return "plain" if any(row.call == "plain" for row in rows) else "known"


def judgement_on(row: Row) -> str:
    """Say whether the FMU is valid on the inputs of a row; empty where errors have no level."""
    if row.valid is None:
        return "" if row.harmful is None else TOO_FEW.format(count=row.trajectories)
    if not row.valid:
        return NOT_VALID[row.honest]
    return f"valid, but {FAR}" if row.far_off else "valid"


def card_table(rows: Sequence[Row], short: bool = True) -> ReportTable:
    """Return the table of the model card: a row for each kind of input, at h and a shorter step.

    ``info`` and ``validate`` print it, and the report shows it with all kinds beyond the range.
    The call is the plain one.
    Where it was not measured, it is that of known inputs.

    Args:
        rows: all rows.
        short: whether kinds beyond the range have one row together.
    """
    call = call_of(rows)
    at = [row for row in rows if row.is_at(call, 1.0) or row.is_at(call, FINER)]
    steps = sorted({round(row.steps, 9): row.step_s for row in at}.items())
    heading = ["inputs", "motions"]
    for number, _ in steps:
        heading += [f"{_part(number)}: error", "covered", "trusted", "silent"]
    heading.append("verdict")
    lengths = ", ".join(
        f"{_part(number)} = {quantity(step, 's', STEP_DIGITS)}" for number, step in steps
    )
    title = f"{CALLS[call].name}, {lengths}"

    def cells() -> Iterator[list[str]]:
        for group, inputs in kinds_of(at):
            if (short and group == BEYOND and inputs != ALL) or inputs == OF_TRAINING:
                continue
            if group == TONES and inputs != ALL:  # they have a table of their own (``tone_map``)
                continue
            measured = [row_at(at, group, inputs, call, number) for number, _ in steps]
            known = next(row for row in measured if row is not None)
            line = [name_of(known), str(known.trajectories)]
            for row in measured:
                line += ["", "", "", ""] if row is None else _shares(row)
            judged = _judged_at_all(row for row in measured if row is not None)
            yield [*line, _judged_cells(at) if group == TONES else judged]

    return ReportTable.of(heading, cells(), title).without_empty_columns()


def _judged_at_all(rows: Iterable[Row]) -> str:
    """Judge the rows of a kind of input once where they agree, else at each step."""
    rows = list(rows)
    if rows and all(row.few for row in rows):
        return judgement_on(rows[0])
    words = {_part(row.steps): text for row in rows if (text := judgement_on(row))}
    if len(set(words.values())) <= 1:
        return next(iter(words.values()), "")
    return "; ".join(f"{part}: {word}" for part, word in words.items())


def _judged_cells(rows: Iterable[Row]) -> str:
    """Say in how many cells of lasting tones an FMU is valid, at its own step."""
    cells = [row for row in rows if row.tones is not None and row.is_at(row.call, 1.0)]
    judged = [row for row in cells if row.valid is not None]
    if not judged:
        few = [row.trajectories for row in cells if row.harmful is not None]
        return TOO_FEW_OF_CELLS.format(count=max(few)) if few else ""
    return f"valid in {sum(bool(row.valid) for row in judged)} of {len(judged)} cells"


def _part(steps: float) -> str:
    """Write a step of which some are in the own step h."""
    return "h" if steps == 1 else f"h/{steps:g}"


def _shares(row: Row) -> list[str]:
    """Return error, covered, trusted and silent of a row."""
    shares = [_share(share) for share in (row.covered, row.trusted, row.silent)]
    if not row.counted:
        shares[0] = NEVER_FILLED
    return [percent(row.error), *shares]


def length_of(row: Row) -> str:
    """Write the communication step of a row."""
    return quantity(row.step_s, "s", STEP_DIGITS)


def name_of(row: Row) -> str:
    """Return group and inputs of a row: several groups may have a kind of the same name."""
    return row.group if row.inputs == ALL else f"{row.group}: {row.inputs}"


def row_table(rows: Sequence[Row]) -> ReportTable:
    """Return all rows with all their shares."""
    heading = (
        *("inputs", "call", "H", "motions", "samples", "error", "covered", "width", "trusted"),
        *("harmful", "silent", "largest error over its bound where trusted"),
    )
    cells = (
        (
            name_of(row),
            CALLS[row.call].name,
            length_of(row),
            str(row.trajectories),
            str(row.samples),
            percent(row.error),
            _share(row.covered) if row.counted else NEVER_FILLED,
            "" if row.width is None else ratio_text(row.width),
            *map(_share, (row.trusted, row.harmful, row.silent)),
            "" if row.over_bound is None else ratio_text(row.over_bound),
        )
        for row in in_order(rows)
    )
    return ReportTable.of(heading, cells).without_empty_columns()


def output_table(rows: Sequence[Row]) -> ReportTable:
    """Return the errors of each output in all rows, in its unit."""
    heading = (
        "inputs",
        "call",
        "H",
        "output",
        "relative RMSE",
        "RMSE",
        "largest error",
        "covered",
    )
    cells = (
        (name_of(row), CALLS[row.call].name, length_of(row), *_output_cells(output))
        for row in in_order(rows)
        for output in row.outputs
    )
    return ReportTable.of(heading, cells).without_empty_columns()


def _output_cells(output: RowOutput) -> tuple[str, ...]:
    unit = output.unit or NO_UNIT
    return (
        output.name,
        percent(output.relative_rmse),
        quantity(output.rmse, unit),
        quantity(output.largest_error, unit),
        _share(output.covered),
    )


def in_order(rows: Sequence[Row]) -> list[Row]:
    """Return rows by inputs, then by call, long steps first."""
    places = {kind: place for place, kind in enumerate(kinds_of(rows))}
    calls = list(CALLS)
    return sorted(
        rows, key=lambda row: (places[row.group, row.inputs], calls.index(row.call), row.steps)
    )


def failures(rows: Sequence[Row]) -> list[str]:
    """Say on which inputs the reference could not be simulated."""
    reasons = {f"{name_of(row)}: {text}": None for row in rows for text in row.failed}
    return [f"The reference could not be simulated on {text}." for text in reasons]


def _share(share: float | None) -> str:
    return "" if share is None else percent(share)
