"""Results of single stages are printed: proposals, trials, windows, costs, searches."""

from __future__ import annotations

from typing import TYPE_CHECKING

from slide_fmu.cli.console import console, show_remark, show_table
from slide_fmu.core.readable import number
from slide_fmu.core.units import NO_UNIT, behind
from slide_fmu.report.table import ReportTable

if TYPE_CHECKING:
    from slide_fmu.memory.decay_figures import SizingFigures
    from slide_fmu.propose.proposal import Proposal
    from slide_fmu.propose.trial import Costs, TrialFigures
    from slide_fmu.recipe.automatic import FoundValues


def show_draft(proposal: Proposal) -> None:
    """Print the signals of a proposed recipe, and the assumptions.

    How inputs act stands once below the table: in each row it would make narrow consoles long.
    """
    draft = proposal.draft
    rows = []
    comments: dict[tuple[str, str], list[str]] = {}
    for what, signals in (("input", draft.inputs), ("output", draft.outputs)):
        for signal in signals:
            ends = signal.table.range
            acts = {"zero_order": "held", "first_order": "moves"}.get(str(signal.table.hold), "")
            acts = acts if what == "input" else ""  # outputs have no hold
            assert ends is not None  # a draft knows its ranges
            limits = f"{ends[0]:g} .. {ends[1]:g}"
            row = (
                f"{what} {signal.name}",
                behind(signal.table.unit or NO_UNIT).strip(),
                limits,
                acts,
                signal.origin,
            )
            rows.append(row)
            comments.setdefault((acts, signal.acts), []).append(signal.name)
    heading = "signal", "unit", "range", "acts", "where the range comes from"
    show_table(ReportTable.of(heading, rows))
    for (acts, comment), names in comments.items():
        if comment:
            console.print(f"{acts:7} {', '.join(names)}: {comment}")
    console.print(f"step    {draft.step:g} s: {draft.step_origin}")
    for remark in proposal.remarks:
        show_remark(remark)


def show_resolved(resolved: FoundValues) -> None:
    """Print the values that were found for open keys of a recipe."""
    values = [
        f"{table}.{key} = {value}"
        for table, keys in resolved.items()
        for key, value in keys.items()
    ]
    if values:
        console.print(f"found   {', '.join(values)}")


def show_sizing(figures: SizingFigures) -> None:
    """Print decay times."""
    from slide_fmu.report.learning_tables import decay_table

    show_table(decay_table(figures))


def show_trial(figures: TrialFigures, refused: str | None = None) -> None:
    """Print the results of trying a recipe; ``refused`` is an error that would stop the run."""
    from slide_fmu.pipeline.work_estimate import CPU_MINUTES, Span, in_words
    from slide_fmu.surrogate.description import SIGNAL_COLUMNS, signal_rows, window_text

    system, data, window = figures.system, figures.data, figures.window.window
    rows = signal_rows(system.inputs, system.outputs)
    show_table(ReportTable.of(SIGNAL_COLUMNS, rows).without_empty_columns())
    offers = [name for name, offered in system.offers.items() if offered]
    seconds = data.wall_time_per_simulated_second_s
    if seconds is not None:
        more = f"outputs, {', '.join(offers)}" if offers else "outputs alone"
        console.print(f"model   gives {more}")
    show_sizing(figures.window)
    console.print(
        f"window  {window_text(window.n_in, window.n_out, window.step_s)}. Effects of the initial "
        f"state have {window.truncation_time_s:.4g} s to decay."
    )
    if seconds is None:
        _show_parts(data)
    else:
        _show_costs(data, seconds)
    console.print(f"run     takes {in_words(Span(*data.computing_time_s), CPU_MINUTES)} in all")
    for remark in figures.remarks:
        show_remark(None if remark == refused else remark)


def _show_parts(data: Costs) -> None:
    """Print the division of records."""
    parts = [f"{count} for {part}" for part, count in data.trajectories.items() if count]
    console.print(f"data    parts of {data.duration_s:g} s that overlap: {', '.join(parts)}")


def _minutes(seconds: float) -> str:
    """Write a time in the unit in which people wait."""
    if seconds < 60:
        return f"{number(seconds)} s"
    return f"{number(seconds / 60)} min" if seconds < 3600 else f"{number(seconds / 3600)} h"


def _show_costs(data: Costs, seconds: float) -> None:
    """Print the cost of the data, for a computing time in s per simulated second."""
    least = "at least " if data.at_least else ""  # a learning curve may ask for more
    count = sum(data.trajectories.values())
    console.print(
        f"data    {least}{count} trajectories of {data.duration_s:g} s, each after a burn-in of "
        f"{data.burn_in_s:g} s. To simulate them takes {least or 'about '}"
        f"{_minutes(data.expected_wall_time_s)} (number of processes: {data.workers}; each "
        f"simulates {number(1.0 / seconds)} s per second)."
    )
