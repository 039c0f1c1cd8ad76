"""Tables on terminals of any width: no word is broken, and nothing is cut."""

from __future__ import annotations

import io

import pytest
from rich.console import Console

from slide_fmu.cli import stage_results
from slide_fmu.propose.proposal import Proposal
from slide_fmu.recipe.writing import Draft, DraftSignal
from slide_fmu.report.console import PrintedTable
from slide_fmu.report.table import ReportTable
from slide_fmu.systems.declared import SignalTable


def printed(table: PrintedTable, width: int) -> str:
    """Return what a console of a width shows."""
    shown = io.StringIO()
    Console(file=shown, width=width, markup=False, highlight=False).print(table)
    return shown.getvalue()


def example() -> PrintedTable:
    heading = "output", "of the worst trajectories", "correlation", "relative RMSE"
    rows = [("position", "91.2 %", "0.73", "0.0407 %"), ("velocity", "95 %", "", "0.1 %")]
    return PrintedTable(ReportTable.of(heading, rows))


@pytest.mark.parametrize("width", [200, 60])
def test_table_that_fits_by_words_is_a_table(width: int) -> None:
    text = printed(example(), width)
    assert "│ position " in text
    assert "trajectories" in text
    assert max(map(len, text.splitlines())) <= width


def test_table_whose_words_do_not_fit_is_printed_row_by_row() -> None:
    lines = printed(example(), 40).splitlines()
    assert lines[:4] == [
        "output: position",
        "  of the worst trajectories: 91.2 %",
        "  correlation: 0.73",
        "  relative RMSE: 0.0407 %",
    ]
    assert lines[4:] == [
        "output: velocity",
        "  of the worst trajectories: 95 %",
        "  relative RMSE: 0.1 %",
    ]


def test_how_inputs_act_stands_once_below_the_signals_of_a_proposal(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    shown = io.StringIO()
    monkeypatch.setattr(stage_results, "console", Console(file=shown, width=60))
    table = SignalTable(range=(-1.0, 1.0), unit="m", hold="first_order")
    acts = "Moves linearly."
    inputs = tuple(DraftSignal(name, table, "It is declared.", acts) for name in ("road", "wind"))
    outputs = (DraftSignal("travel", table, "Seen in one motion."),)
    stage_results.show_draft(
        Proposal("", Draft("car", "", inputs, outputs, 0.01, "It is given."), ())
    )
    lines = shown.getvalue().splitlines()
    assert [line for line in lines if acts in line] == ["moves   road, wind: Moves linearly."]
    assert lines[-1] == "step    0.01 s: It is given."
