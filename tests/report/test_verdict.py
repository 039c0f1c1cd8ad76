"""The verdict has three sentences: error in the user's call, trust, what to avoid; and numbers."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from slide_fmu.report.html_report import Fact
from slide_fmu.report.row_tables import card_table
from slide_fmu.report.verdict import MISSING, verdict, verdict_facts
from slide_fmu.validation.error_figures import Timing
from slide_fmu.validation.row import ALL, FINER, YOURS, Row
from slide_fmu.validation.task import BEYOND, HELD_OUT, IN_RANGE
from tests.report.made_rows import MEASURED, row, timing, unfilled, without_bound

SILENT = "does not say so"
REPORTED = "says that it is wrong"
"""What the last sentence says of kinds of input that are to be avoided."""


def to_avoid(*rows: Row) -> str:
    """Return the last sentence, of an FMU that was measured on these kinds and in range."""
    *_, sentence = verdict([row(), *rows])
    return sentence


def test_three_sentences_say_error_trust_and_what_to_avoid() -> None:
    error, trust, avoid = verdict(MEASURED)
    for figure in ("plain call is 2 %", "20 ms", "1.5 % at 5 ms", "sines of 1 Hz 30 % and 8 %"):
        assert figure in error
    for figure in ("96 % of the samples at 20 ms", "covers 95 %", "99 %"):
        assert figure in trust
    assert "smooth inputs: sines of 1 Hz (30 %); there" in avoid
    assert SILENT in avoid


def yours(name: str = "second half of drive.csv", **more: Any) -> Row:
    return row(name, YOURS, **more)


def test_your_inputs_come_before_the_three_sentences() -> None:
    first, *others = verdict([*MEASURED, yours(error=0.003), yours(error=0.002, steps=FINER)])
    assert tuple(others) == verdict(MEASURED)
    for figure in (
        "(second half of drive.csv)",
        "plain call is 0.3 %",
        "20 ms, and 0.2 % at 5 ms",
    ):
        assert figure in first
    assert "trusts 96 % of the samples there at 20 ms, where its bound covers 95 %," in first
    without = yours(error=0.003, covered=None, trusted=None, silent=None)
    one, two, *_ = verdict([*MEASURED, yours("a.csv"), replace(without, inputs="b.csv")])
    assert "(a.csv)" in one
    assert two.startswith("Under your inputs (b.csv) the error in the plain call is 0.3 %")
    assert two.endswith("of 20 ms (relative RMSE).")


def test_your_inputs_are_the_first_large_number_and_the_first_row() -> None:
    name, *_ = facts(*MEASURED, yours(error=0.06))
    assert name == "Your inputs"
    number = facts(*MEASURED, yours(error=0.06))[name]
    assert (number.value, number.good) == ("6 %", False)
    assert card_table([*MEASURED, yours()]).rows[0][0] == "your inputs: second half of drive.csv"


def test_a_bound_that_never_counts_at_a_step_is_named() -> None:
    _, trust, _ = verdict([row(), unfilled(steps=4.0)])
    assert "At 5 ms error_bound_filled never becomes 1" in trust


def test_an_fmu_without_a_bound_says_so_and_what_to_avoid() -> None:
    rows = [without_bound(), without_bound(inputs="steps", error=0.5, harmful=0.4)]
    _, trust, avoid = verdict(rows)
    assert "no error bound" in trust
    assert "in range: steps (50 %)" in avoid
    assert SILENT in avoid


def test_kinds_that_are_reported_come_behind_silent_ones() -> None:
    reported = row("jumps", HELD_OUT, 0.9, harmful=0.5)
    alone = to_avoid(reported)
    assert f"{HELD_OUT}: jumps (90 %)" in alone
    assert REPORTED in alone
    both = to_avoid(reported, row("steps", harmful=0.5, silent=0.2))
    assert "jumps" not in both
    assert "steps" in both


def test_kinds_that_are_silent_at_the_finer_step_alone_are_named_behind() -> None:
    finer = [row("jumps", steps=4.0, error=0.2, silent=0.03), row("ramps", steps=4.0)]
    alone = to_avoid(row("jumps"), *finer)
    assert alone.startswith("At 5 ms ")
    assert "in range: jumps (20 %)" in alone
    assert "ramps" not in alone
    silent = row("steps", harmful=0.5, silent=0.2)
    own, _, at_finer = to_avoid(silent, replace(silent, steps=4.0), *finer).partition("At 5 ms")
    assert ("steps" in own, "jumps" in own) == (True, False)
    assert ("steps" in at_finer, "jumps" in at_finer) == (False, True)


@pytest.mark.parametrize("kind", [BEYOND, "sum"])
def test_kinds_beyond_the_range_and_sums_of_kinds_are_not_named(kind: str) -> None:
    bad = row("steps", BEYOND, harmful=0.9, silent=0.9) if kind == BEYOND else row(harmful=0.5)
    assert "none is to be avoided" in to_avoid(bad)


def test_kinds_of_which_few_motions_were_measured_say_how_many() -> None:
    rows = [row("jumps", harmful=0.5, trajectories=2), row("steps", harmful=0.4, trajectories=1)]
    assert "jumps (1 %, 2 motions), in range: steps (1 %, 1 motion); there" in to_avoid(*rows)


def test_kinds_of_the_same_name_have_their_groups() -> None:
    rows = [row("steps", group, harmful=0.5, silent=0.1) for group in (IN_RANGE, HELD_OUT)]
    for group in (IN_RANGE, HELD_OUT):
        assert f"{group}: steps (1 %)" in to_avoid(*rows)


def test_more_kinds_than_three_are_counted() -> None:
    rows = [row(f"kind {n}", harmful=0.9, silent=0.1 * n) for n in range(1, 6)]
    named = to_avoid(*rows)
    assert [n for n in range(1, 6) if f"kind {n} " in named] == [3, 4, 5]
    assert "and 2 more" in named


def test_records_have_the_error_of_the_call_that_was_measured() -> None:
    rows = [replace(one, call="known") for one in MEASURED if one.inputs == ALL]
    error, *_ = verdict(rows)
    assert "with inputs known to the step's end is 2 %" in error


def test_several_outputs_have_the_largest_error() -> None:
    one = row()
    worse = replace(one.outputs[0], name="angle", relative_rmse=0.07, covered=0.9)
    error, trust, _ = verdict([replace(one, outputs=(*one.outputs, worse))])
    assert "is up to 7 %" in error
    assert "covers 90 %" in trust


def test_errors_that_are_large_but_usual_are_told_in_the_same_line() -> None:
    rows = [row(error=0.4), row("steps", error=0.4), row("ramps", error=0.06), row("rest")]
    error, _, avoid = verdict(rows)
    assert "far off (error above 5 %)" in error
    usual = "in range: steps (40 %), in range: ramps (6 %) its error is usual"
    assert usual in avoid
    assert SILENT not in avoid
    _, _, avoid = verdict([*rows, row("jumps", error=0.9, harmful=0.5, silent=0.5)])
    assert "jumps (90 %)" in avoid
    assert avoid.index(SILENT) < avoid.index(usual)


def test_nothing_is_far_off_up_to_five_per_cent() -> None:
    assert "far off" not in " ".join(verdict([row(error=0.05), row("steps", error=0.05)]))


def test_nothing_measured_says_so() -> None:
    assert verdict([]) == ()


TIMING = timing(10.0)


def facts(*rows: Row, times: Timing = TIMING) -> dict[str, Fact]:
    return {fact.name: fact for fact in verdict_facts(rows, times, memory_s=1.5)}


def test_facts_are_those_of_all_inputs_in_range_in_the_plain_call() -> None:
    numbers = facts(*MEASURED)
    values = {name: fact.value for name, fact in numbers.items()}
    assert values == {
        "Error": "2 %",
        "Bound": "95 %",
        "Trusted": "96 %",
        "Validity": "1 of 2",
        "Speed": "10 times",
        "Memory": "1.5 s",
    }
    assert numbers["Validity"].good is False


@pytest.mark.parametrize(("missing", "good"), [(MISSING - 1e-4, True), (MISSING + 1e-4, False)])
def test_a_bound_that_covers_too_little_is_no_good_sign(missing: float, good: bool) -> None:
    assert facts(row(covered=0.95 - missing))["Bound"].good is good


def test_validity_expects_nothing_of_kinds_that_no_training_saw() -> None:
    unseen = row("binary", HELD_OUT, harmful=0.5)
    number = facts(row(), row("steps"), unseen)["Validity"]
    assert (number.value, number.good) == ("1 of 2", True)


def test_a_large_error_is_no_good_sign_even_where_it_is_usual() -> None:
    number = facts(row(error=0.4), row("steps", error=0.4), row("rest"))
    assert number["Error"].good is False
    assert (number["Validity"].value, number["Validity"].good) == ("2 of 2", False)
    assert number["Validity"].text.endswith("For 1 of them it is far off (error above 5 %).")


def test_without_bound_there_are_no_numbers_of_one() -> None:
    assert not {"Bound", "Trusted"} & set(facts(without_bound()))


def test_speed_is_that_at_equal_accuracy() -> None:
    number = facts(row())["Speed"]
    assert number.good is None
    assert number.text.startswith(
        "A step takes 4 µs. At equal accuracy its model takes 10 times as long: RK45 with rtol = "
        "1e-4 has an error of 1 %, the FMU 2 %."
    )


def test_an_fmu_that_is_slower_than_its_model_says_so() -> None:
    slow = facts(row(), times=timing(0.1))["Speed"]
    assert (slow.value, slow.good) == ("0.1 times", False)
    assert "its model takes 0.1 times as long" in slow.text


def test_an_fmu_of_a_record_has_the_time_of_a_step_alone() -> None:
    alone = facts(row(), times=Timing(fmu_step_us=4.0))["Speed"]
    assert (alone.value, alone.good) == ("4 µs", None)
