"""What was found out on the way is shown as tables: proposals, trials, windows, searches."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from slide_fmu.cli.console import console, show_remark
from slide_fmu.cli.tables import table_of
from slide_fmu.core.units import NO_UNIT, behind
from slide_fmu.report.tables import curve_rows, size_rows

if TYPE_CHECKING:
    from slide_fmu.pipeline.apps import Repeated
    from slide_fmu.propose.proposal import Proposal
    from slide_fmu.propose.record_proposal import RecordProposal


def show_draft(proposal: Proposal | RecordProposal) -> None:
    """Print the signals of a proposed recipe, and what was assumed."""
    draft = proposal.draft
    table = table_of("signal", "unit", "range", "acts", "where the range comes from")
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
            table.add_row(*row)
    console.print(table)
    console.print(f"step    {draft.step:g} s: {draft.step_origin}")
    for remark in proposal.remarks:
        show_remark(remark)


def show_found(resolved: dict[str, dict[str, Any]]) -> None:
    """Print the values that were found for what a recipe leaves open."""
    found = [
        f"{t}.{key} = {value}" for t, inner in resolved.items() for key, value in inner.items()
    ]
    if found:
        console.print(f"found   {', '.join(found)}")


def show_sizing(figures: dict[str, Any]) -> None:
    """Print decay times as ``slide_fmu.memory.decay_figures`` gives them."""
    from slide_fmu.memory.decay_figures import decay_rows

    headings, *rows = decay_rows(figures)
    table = table_of(*headings)
    for row in rows:
        table.add_row(*row)
    console.print(table)


def show_trial(figures: dict[str, Any], refused: str | None = None) -> None:
    """Print what was found out about a recipe before it is run; an error tells what is refused."""
    system, data, window = figures["system"], figures["data"], figures["window"]["window"]
    table = table_of("signal", "unit", "range", "acts between samples")
    for what in ("input", "output"):
        for signal in system[f"{what}s"]:
            moves = {"zero_order": "is held", "first_order": "moves linearly"}[signal["hold"]]
            limits = f"{signal['low']:g} .. {signal['high']:g}"
            name = f"{what} {signal['name']}"
            table.add_row(
                name, behind(signal["unit"]).strip(), limits, moves if what == "input" else ""
            )
    console.print(table)
    offers = [name for name, offered in system["offers"].items() if offered]
    measured = data["wall_time_per_simulated_second_s"] is None
    if not measured:
        console.print(f"the system offers beside its outputs: {', '.join(offers) or 'nothing'}")
    show_sizing(figures["window"])
    console.print(
        f"window  {window['n_in']} inputs to {window['n_out']} outputs, {window['step_s']:g} s "
        f"apart; {window['truncation_time_s']:.4g} s are there to forget in"
    )
    if measured:
        _show_parts(data)
    else:
        _show_costs(data)
    for remark in figures["remarks"]:
        show_remark(None if remark == refused else remark)


def _show_parts(data: dict[str, Any]) -> None:
    """Print how records are divided."""
    parts = [f"{count} for {part}" for part, count in data["trajectories"].items() if count]
    console.print(
        f"data    stretches of {data['duration_s']:g} s that overlap: {', '.join(parts)}"
    )


def _show_costs(data: dict[str, Any]) -> None:
    """Print what the data will cost."""
    speed = 1.0 / data["wall_time_per_simulated_second_s"]
    least = "at least " if data["at_least"] else ""  # a learning curve may ask for more
    count = sum(data["trajectories"].values())
    console.print(
        f"data    {least}{count} trajectories of {data['duration_s']:g} s "
        f"and {data['burn_in_s']:g} s to lead in; {speed:.3g} simulated seconds per second and "
        f"process: {least or 'about '}{data['expected_wall_time_s'] / 60:.2g} minutes"
    )


def show_search(figures: dict[str, Any]) -> None:
    """Print what was searched for: numbers of trajectories, sizes, and what may be missing."""
    curve = figures.get("learning_curve")
    if curve is not None:
        _show_table("learning curve", curve_rows(curve))
        console.print(f"it ended: {curve['ended']}")
    if figures.get("sizes_tried"):
        _show_table("sizes tried", size_rows(figures["sizes_tried"]))
    show_remark(figures.get("remark"))


def show_repeated(run: Repeated) -> None:
    """Print how something that an FMU carries went when it was repeated here."""
    _show_table(run.title, run.rows)


def _show_table(title: str, rows: Sequence[Sequence[str]]) -> None:
    console.print(title)
    table = table_of(*rows[0])
    for row in rows[1:]:
        table.add_row(*row)
    console.print(table)
