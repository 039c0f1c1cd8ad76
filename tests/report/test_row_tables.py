"""Tables and pictures of rows."""

from __future__ import annotations

from dataclasses import replace

from slide_fmu.report.accuracy_sections import all_rows, main_sections
from slide_fmu.report.row_tables import card_table, failures, output_table, row_table
from slide_fmu.report.step_chart import step_charts
from slide_fmu.validation.row import SMOOTH
from slide_fmu.validation.task import BEYOND
from tests.report.made_rows import MEASURED, row, unfilled, without_bound


def test_a_kind_has_one_row_with_both_steps() -> None:
    table = card_table(MEASURED)
    shares = ("covered", "trusted", "silent")
    heading = ("inputs", "motions", "h: error", *shares, "h/4: error", *shares, "verdict")
    assert table.heading == heading
    assert table.title == "plain call, h = 20 ms, h/4 = 5 ms"
    whole, steps, smooth = table.rows
    assert whole[:6] == ("in range", "12", "2 %", "95 %", "96 %", "0 %")
    assert whole[6:] == ("1.5 %", "95 %", "99 %", "0 %", "valid")
    assert (steps[0], steps[6:10]) == ("in range: steps", ("", "", "", ""))
    assert smooth[0] == "smooth inputs: sines of 1 Hz"
    far = "valid, but far off (error above 5 %)"
    assert smooth[-1] == f"h: not valid, not always reported; h/4: {far}"


def test_a_bound_that_never_counts_says_so_in_the_place_of_its_shares() -> None:
    (line,) = card_table([unfilled()]).rows
    assert line == ("in range", "12", "1 %", "bound not filled")
    (line,) = row_table([unfilled()]).rows
    assert "bound not filled" in line


def test_verdicts_follow_from_harm_and_silence() -> None:
    rows = [
        row("a", harmful=0.02, silent=0.01),
        row("b", harmful=0.03, silent=0.01),
        row("c", harmful=0.03, silent=0.02),
        row("d", harmful=0.02, silent=0.02),
        without_bound(inputs="e", harmful=0.03),
        row("f", error=0.06),
    ]
    assert [line[-1] for line in card_table(rows).rows] == [
        "valid",
        "not valid, and the FMU says so",
        *["not valid, not always reported"] * 2,
        "not valid",
        "valid, but far off (error above 5 %)",
    ]


def test_kinds_with_too_few_motions_are_not_judged() -> None:
    few = row("a", trajectories=11), row("a", steps=4.0, trajectories=2)
    rows = [*few, row("b"), row("b", steps=4.0, trajectories=3)]
    assert [line[-1] for line in card_table(rows).rows] == [
        "too few motions to tell (11 of 12)",
        "h: valid; h/4: too few motions to tell (3 of 12)",
    ]


def test_a_kind_that_is_valid_at_one_step_alone_is_judged_at_both() -> None:
    rows = [row("a"), row("a", harmful=0.03, silent=0.02, steps=4.0), row("b"), row("b", steps=4)]
    assert [line[-1] for line in card_table(rows).rows] == [
        "h: valid; h/4: not valid, not always reported",
        "valid",
    ]


def test_kinds_beyond_the_range_have_one_row_on_a_card_and_all_in_a_report() -> None:
    rows = [row(), row(group=BEYOND), row("steps", BEYOND)]
    assert [line[0] for line in card_table(rows).rows] == ["in range", "beyond the range"]
    assert card_table(rows, short=False).rows[-1][0] == "beyond the range: steps"


def test_groups_keep_their_order_and_all_kinds_come_first() -> None:
    rows = [row(group=BEYOND), row("s", SMOOTH), row("steps"), row()]
    assert [line[0] for line in card_table(rows).rows] == [
        "in range",
        "in range: steps",
        "smooth inputs: s",
        "beyond the range",
    ]


def test_all_rows_have_their_call_step_and_shares() -> None:
    table = row_table([*MEASURED, row(call="known", over_bound=3.25)])
    assert len(table.rows) == len(MEASURED) + 1
    calls = [(line[1], line[2]) for line in table.rows if line[0] == "in range"]
    known = "inputs known to the step's end"
    assert calls == [("plain call", "20 ms"), ("plain call", "5 ms"), (known, "20 ms")]
    assert table.heading[-1] == "largest error over its bound where trusted"
    assert [line[-1] for line in table.rows if line[1] == known] == ["3.25"]
    (line, *_) = output_table(MEASURED).rows
    assert line[3:] == ("position", "2 %", "40 µm", "200 µm", "95 %")


def test_failures_of_the_reference_are_named_once() -> None:
    failing = row(failed=("u = 3 N: it diverged",))
    assert failures([failing, replace(failing, steps=4.0)]) == [
        "The reference could not be simulated on in range: u = 3 N: it diverged."
    ]


def test_picture_has_a_line_of_the_fmu_and_one_of_the_model() -> None:
    steps = (0.5, 1.0, 4.0)
    rows = [row("sines", SMOOTH, 0.1 / count, steps=count) for count in steps]
    model = [replace(one, call="model") for one in rows]
    (chart,) = step_charts([row(), *rows, *model])
    fmu, points, other, _ = chart.panels[0].lines
    assert fmu.x.tolist() == [5.0, 20.0, 40.0]
    assert fmu.y.tolist() == [2.5, 10.0, 20.0]
    assert (points.style, other.dashed, other.y.tolist()) == ("points", True, fmu.y.tolist())
    assert chart.marks == [20.0]
    (alone,) = step_charts(rows)
    assert len(alone.panels[0].lines) == 2
    assert step_charts([row()]) == []


def test_report_begins_with_the_picture_and_the_kinds() -> None:
    picture, kinds = main_sections(MEASURED, "zero_order")
    assert picture.title == "Error against communication step"
    assert kinds.title == "Where it is valid"
    assert kinds.table == card_table(MEASURED, short=False)
    assert "held over h" in kinds.text
    assert "held over h" not in main_sections(MEASURED, "first_order")[1].text
    assert [section.folded for section in all_rows(MEASURED)] == [True, True]
    assert main_sections([], "zero_order") == all_rows([]) == []
