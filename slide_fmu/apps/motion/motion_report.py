"""The report of a motion shows its vibration, next to shapers and the reference model."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from slide_fmu.apps.motion.coordinates import Coordinate
from slide_fmu.apps.motion.move import Move, MoveFigures
from slide_fmu.apps.motion.solve import MoveSolution
from slide_fmu.core.measures import percent
from slide_fmu.core.readable import quantity
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.units import NO_UNIT, ratio
from slide_fmu.core.web.charts import Chart, Line, Panel, colour_of
from slide_fmu.report.html_report import Fact, Report, ReportSection, Verdict
from slide_fmu.report.table import ReportTable
from slide_fmu.report.trajectory_charts import panels_by_unit

SMALLEST_SHOWN = 1e-3
"""Distances from rest are drawn down to this fraction of the tolerance."""

SHOWN_AFTER = 40
"""Number of samples in a chart after the end of the last move."""


def motion_report(solved: MoveSolution) -> Report:
    """Return the report of a solved task."""
    figures, unit = solved.figures(), solved.surrogate.outputs[0].unit
    move = figures.move
    start, goal = (
        ", ".join(f"{value:g}" for value in pose) for pose in (solved.task.start, solved.task.goal)
    )
    summary = (
        f"The move from {start} to {goal} arrives after "
        f"{move.arrives_s:.4g} s and leaves {quantity(move.residual, unit)}; with its margin "
        f"{quantity(move.residual_with_margin, unit)}, of {quantity(solved.task.tolerance, unit)} "
        f"that are allowed. The margin is {figures.margin_is}."
    )
    if remark := remark_on_moves(solved):
        summary += f" {remark}"
    predicted, *true = move_tables(solved)
    text = (
        "Settled means that the outputs stay closer to rest than the tolerance; the margin is "
        "what the prediction may be off by. The shapers delay parts of the fastest move within "
        "the limits."
    )
    sections = [
        ReportSection(_upper(predicted.title), text, predicted, charts=[_distances(solved)]),
        *(ReportSection(_upper(table.title), "It has no margin.", table) for table in true),
    ]
    sections.append(
        ReportSection(
            "Set points",
            "The coordinates of the move, and which part of each limit they use.",
            limit_table(move.limits_used),
            charts=[_set_points(solved)],
        )
    )
    title = f"Motion with {solved.surrogate.name}"
    return Report(title, summary, figures, sections, verdict=Verdict(facts=_facts(solved)))


def _facts(solved: MoveSolution) -> list[Fact]:
    """Return the large numbers of a move: its time, what it saves, and what is left at its end."""
    figures, unit = solved.figures(), solved.surrogate.outputs[0].unit
    move, true = figures.move, None if figures.reference is None else figures.reference.move
    settled = [m.settled_s for m in figures.baselines if m.settled_s is not None]
    facts = [Fact("Arrival", f"{move.arrives_s:.3g} s", "The move takes this time.")]
    if settled and move.settled_s is not None:
        text = f"The best other move stands still after {min(settled):.3g} s."
        saved = 1 - move.settled_s / min(settled)
        if saved > 0:
            facts.append(Fact("Earlier", percent(saved), text))
    inside = move.residual_with_margin <= solved.task.tolerance
    allowed = f"of {quantity(solved.task.tolerance, unit)} that are allowed"
    text = f"Distance from rest after it, {allowed}; with its margin "
    text += f"{quantity(move.residual_with_margin, unit)}."
    judged = None if figures.rounds else inside  # else the reference model judges
    facts.append(Fact("Predicted", quantity(move.residual, unit), text, judged))
    if true is not None:
        rounds = figures.rounds
        done = f"Verified in {_rounds(rounds)}" if rounds else "The same"
        text = f"{done} by the reference model, {allowed}."
        good = true.residual <= solved.task.tolerance
        facts.append(Fact("Reference model", quantity(true.residual, unit), text, good))
    return facts


def remark_on_moves(solved: MoveSolution) -> str | None:
    """Say whether it is verified, whether a baseline is the answer, and what the domain excludes.

    It is None if an optimised move is the answer, without a reference model, and all moves lie in
    the domain.
    """
    optimised, sentences, figures = solved.optimised, [], solved.figures()
    if figures.reference is not None:
        begin = f"Verified in {_rounds(optimised.rounds)}: by" if optimised.rounds else "By"
        true = figures.reference.move
        unit = solved.surrogate.outputs[0].unit
        sentences.append(
            f"{begin} the reference model, the move leaves {quantity(true.residual, unit)} of "
            f"{quantity(solved.task.tolerance, unit)} that are allowed."
        )
        if optimised.rounds and optimised.move.known < 1:
            sentences.append("It leaves the domain of the surrogate, where margins say nothing.")
    if optimised.move.name in {move.name for move in optimised.baselines}:
        sentences.append(
            f"No other move is better than a usual one: the answer is {optimised.move.name!r}."
        )
    outside = ", ".join(move.name for move in optimised.baselines if move.known < 1)
    if outside and not optimised.rounds:
        sentences.append(
            f"These leave the domain of the surrogate, so they are no answer: {outside}."
        )
    if optimised.slower > 1:
        sentences.append(
            "Moves as fast as the limits admit leave the domain; so all of them begin with "
            f"{optimised.slower:g} times the time."
        )
    return " ".join(sentences) or None


def _rounds(rounds: int) -> str:
    return f"{rounds} round{'s' if rounds > 1 else ''} of planning"


def _upper(title: str) -> str:
    return title[0].upper() + title[1:]


def move_tables(solved: MoveSolution) -> list[ReportTable]:
    """Return tables of all moves: as predicted, and by the reference model if there is one."""
    figures, unit = solved.figures(), solved.surrogate.outputs[0].unit
    tables = [_move_table("moves, as predicted", [figures.move, *figures.baselines], unit)]
    if figures.reference is not None:
        moves = [figures.reference.move, *figures.reference.baselines]
        table = _move_table("the same moves, by the reference model", moves, unit)
        tables.append(table.columns("move", "arrives", SETTLED, RESIDUAL))
    return tables


SETTLED, RESIDUAL = "settled", "distance from rest after it"
"""Columns of the table of moves that do not use the margin."""


def _move_table(title: str, moves: Sequence[MoveFigures], unit: str) -> ReportTable:
    heading = "move", "arrives", SETTLED, "settled with its margin", RESIDUAL, "with its margin"
    rows = (
        (
            move.name,
            *map(_seconds, (move.arrives_s, move.settled_s, move.settled_with_margin_s)),
            quantity(move.residual, unit),
            quantity(move.residual_with_margin, unit),
        )
        for move in moves
    )
    return ReportTable.of(heading, rows, title)


def _seconds(value: float | None) -> str:
    return "not" if value is None else f"{value:.4g} s"


def limit_table(used: Mapping[str, float]) -> ReportTable:
    """Return the used fraction of each limit as a table."""
    rows = ((name, percent(part)) for name, part in used.items())
    return ReportTable.of(("limit", "used"), rows)


def _distances(solved: MoveSolution) -> Chart:
    """Draw the distance from rest over time, for some moves; dotted lines are their ends."""
    response = solved.optimised.response
    last = min(max(m.end for m in solved.moves) + SHOWN_AFTER, response.count)
    time, tolerance = response.output_time[:last], solved.task.tolerance
    least = SMALLEST_SHOWN * tolerance
    lines = [Line("tolerance", time[[0, -1]], np.full(2, tolerance), "cursor", width=1.0)]
    drawn, true = _drawn(solved), solved.true_moves()
    for colour, index in enumerate(drawn):
        move, width = solved.moves[index], 2.4 if index == 0 else 1.2
        away = _away(move, least)[:last]
        lines.append(Line(move.name, time, away, colour_of(colour), width=width))
        if true:
            away, name = _away(true[index], least)[:last], f"{move.name}, reference model"
            lines.append(Line(name, time, away, colour_of(colour), dashed=True, width=1.2))
    unit = solved.surrogate.outputs[0].unit
    panel = Panel("distance from rest", unit, lines, log=True)
    marks = [float(response.time[solved.moves[index].end]) for index in drawn]
    return Chart("Distance from rest", [panel], marks=marks)


def _drawn(solved: MoveSolution) -> list[int]:
    """Return the moves that are drawn: the answer, the fastest one, and the best shaper."""
    figures = solved.figures()
    settled = [math.inf if m.settled_s is None else m.settled_s for m in figures.baselines]
    places = [1 + int(np.argmin(settled))] if settled else []
    return sorted({0, *([1] if settled else []), *places})


def _away(move: Move, least: float) -> FloatArray:
    return np.asarray(np.maximum(np.linalg.norm(move.outputs, axis=1), least))


def _set_points(solved: MoveSolution) -> Chart:
    """Draw the coordinates of the move, and their speeds."""
    response, move = solved.optimised.response, solved.optimised.move
    rows = np.concatenate([response.start[None], move.motion[: move.end + 4]])
    time = response.step * np.arange(len(rows), dtype=np.float64)
    speeds = np.diff(rows, axis=0) / response.step
    panels = [
        *coordinate_panels("set point", response.coordinates, time, rows),
        *coordinate_panels("speed", response.coordinates, time[1:], speeds, over="s"),
    ]
    return Chart("Set points", panels)


def coordinate_panels(
    title: str,
    coordinates: Sequence[Coordinate],
    time: FloatArray,
    values: FloatArray,
    over: str = NO_UNIT,
) -> list[Panel]:
    """Draw values of coordinates, (N, n_coordinates), as ``panels_by_unit`` does."""
    names, units = [c.title for c in coordinates], [c.unit for c in coordinates]
    return panels_by_unit(title, names, [ratio(unit, over) for unit in units], time, values)
