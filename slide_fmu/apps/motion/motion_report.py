"""The report of a motion shows what it leaves, beside shapers and the reference model."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from slide_fmu.apps.motion.move import Move
from slide_fmu.apps.motion.solve import Solved
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.units import behind, labelled
from slide_fmu.report.pictures import png
from slide_fmu.report.report import Report, Section

Rows = list[tuple[str, ...]]
"""The rows of a table, whose headings come first."""

SMALLEST_SHOWN = 1e-3
"""Distances from rest are drawn down to this part of the tolerance."""

SHOWN_AFTER = 40
"""A picture ends so many samples after the last move's end."""


def motion_report(solved: Solved) -> Report:
    """Return the report of a solved task."""
    figures, unit = solved.figures(), solved.surrogate.outputs[0].unit
    move = figures["move"]
    summary = (
        f"The move from {list(solved.task.start)} to {list(solved.task.goal)} arrives after "
        f"{move['arrives_s']:.4g} s and leaves {move['residual']:.3g}{behind(unit)}; with its "
        "margin "
        f"{move['residual_with_margin']:.3g}{behind(unit)}, of "
        f"{solved.task.tolerance:g}{behind(unit)} that "
        f"are allowed. The margin is {figures['margin_is']}."
    )
    if remark := remark_on_moves(solved):
        summary += f" {remark}"
    predicted, *true = move_rows(solved).items()
    text = (
        "Settled means that the outputs stay closer to rest than the tolerance; the margin is "
        "what the prediction may be off by. The shapers delay parts of the fastest move within "
        "the limits."
    )
    sections = [
        Section(*_headed(predicted, text), [_distances(solved)]),
        *(Section(*_headed(table, "It has no margin.")) for table in true),
    ]
    sections.append(
        Section(
            "Set points",
            "The coordinates of the move, and which part of each limit they use.",
            limit_rows(move),
            [_set_points(solved)],
        )
    )
    return Report(f"Motion with {solved.surrogate.name}", summary, figures, sections)


def remark_on_moves(solved: Solved) -> str | None:
    """Say whether a baseline is the answer, and what the domain of the surrogate has ruled out.

    It is None where an optimised move is the answer, and all moves lie in the domain.
    """
    found, said = solved.found, []
    if found.move.name in {move.name for move in found.baselines}:
        said.append(
            f"No other move is better than a usual one: the answer is {found.move.name!r}."
        )
    if outside := ", ".join(move.name for move in found.baselines if move.known < 1):
        said.append(f"These leave the domain of the surrogate, so they are no answer: {outside}.")
    if found.slower > 1:
        said.append(
            "Moves as fast as the limits admit leave the domain; so all of them begin with "
            f"{found.slower:g} times the time."
        )
    return " ".join(said) or None


def _headed(table: tuple[str, Rows], text: str) -> tuple[str, str, Rows]:
    title, rows = table
    return title[0].upper() + title[1:], text, rows


def move_rows(solved: Solved) -> dict[str, Rows]:
    """Return tables of all moves by their titles, headings first.

    They are as predicted, and by the reference model where somebody asked for it.
    """
    figures = solved.figures()
    found = {"moves, as predicted": _rows(solved, [figures["move"], *figures["baselines"]], True)}
    if "reference" in figures:
        true = figures["reference"]
        rows = _rows(solved, [true["move"], *true["baselines"]], False)
        found["the same moves, by the reference model"] = rows
    return found


def _rows(solved: Solved, moves: list[dict[str, Any]], margins: bool) -> Rows:
    """Return one row for each move; the columns with margins are left out where none are."""
    unit = solved.surrogate.outputs[0].unit
    columns = {
        "arrives": ("arrives_s", "s"),
        "settled": ("settled_s", "s"),
        "settled with its margin": ("settled_with_margin_s", "s"),
        "distance from rest after it": ("residual", unit),
        "with its margin": ("residual_with_margin", unit),
    }
    shown = {title: of for title, of in columns.items() if margins or "margin" not in title}
    return [
        ("move", *shown),
        *((move["name"], *(_cell(move[key], of) for key, of in shown.values())) for move in moves),
    ]


def _cell(value: float | None, unit: str) -> str:
    return "not" if value is None else f"{value:.{4 if unit == 's' else 3}g}{behind(unit)}"


def limit_rows(move: dict[str, Any]) -> list[tuple[str, str]]:
    used = move["limits_used"].items()
    return [("limit", "used"), *((name, f"{100 * part:.4g} %") for name, part in used)]


def _distances(solved: Solved) -> bytes:
    """Draw the distance from rest over time, for every move."""
    figure = Figure(figsize=(9, 4.2), layout="constrained")
    ax, response = figure.subplots(), solved.found.response
    last = min(max(m.end for m in solved.moves) + SHOWN_AFTER, response.count)
    time = response.output_time[:last]
    least = SMALLEST_SHOWN * solved.task.tolerance
    for index, move in enumerate(solved.moves):
        colour = f"C{index}"
        ax.semilogy(
            time, _away(move, least)[:last], colour, lw=2 if index == 0 else 1, label=move.name
        )
        ax.axvline(float(response.time[move.end]), color=colour, lw=0.7, ls=":")
    for index, move in enumerate(solved.true_moves()):
        label = "the same, reference model" if index == 0 else None
        ax.semilogy(time, _away(move, least)[:last], f"C{index}", lw=1, ls="--", label=label)
    ax.axhline(solved.task.tolerance, color="black", lw=1)
    ax.text(time[0], 1.15 * solved.task.tolerance, "tolerance", va="bottom")
    unit = solved.surrogate.outputs[0].unit
    ax.set(
        xlabel="time in s", ylabel=labelled("distance from rest", unit, " in "), ylim=(least, None)
    )
    ax.legend(loc="lower left", fontsize="small")
    return png(figure)


def _away(move: Move, least: float) -> FloatArray:
    return np.asarray(np.maximum(np.linalg.norm(move.outputs, axis=1), least))


def _set_points(solved: Solved) -> bytes:
    """Draw the coordinates of the move, relative to the route of each, and their speeds."""
    response, move = solved.found.response, solved.found.move
    figure = Figure(figsize=(9, 4.2), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True)
    rows = np.concatenate([response.start[None], move.motion[: move.end + 4]])
    time = response.step * np.arange(len(rows))
    for index, coordinate in enumerate(response.coordinates):
        upper.plot(time, rows[:, index], label=labelled(coordinate.name, coordinate.unit, " in "))
        lower.plot(time[1:], np.diff(rows[:, index]) / response.step)
    upper.set(ylabel="coordinate")
    lower.set(ylabel="its change per s", xlabel="time in s")
    upper.legend(fontsize="small", ncols=3)
    return png(figure)
