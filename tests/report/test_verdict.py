"""The verdict has three sentences: error in the user's call, trust, what to avoid; and numbers."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from slide_fmu.core.measures import FEWEST
from slide_fmu.report.html_report import Fact
from slide_fmu.report.row_tables import card_table
from slide_fmu.report.verdict import MISSING, verdict, verdict_facts
from slide_fmu.validation.error_figures import Timing
from slide_fmu.validation.row import ALL, FLAGGED, LEAST_COVERED, SEARCH, YOURS, Row
from slide_fmu.validation.task import BEYOND, HELD_OUT, IN_RANGE
from tests.report.made_rows import MEASURED, row, timing, unfilled, without_bound

ITSELF = "it says itself where it is wrong"
"""What the last sentence says of kinds of input on which the FMU says where it is wrong."""


def to_avoid(*rows: Row) -> str:
    """Return the last sentence, of an FMU that was measured on these kinds and in range."""
    *_, sentence = verdict([row(), *rows])
    return sentence


def test_three_sentences_say_error_trust_and_what_to_avoid() -> None:
    assert verdict(MEASURED) == (
        "The error in the plain call is 2 % under inputs as in the training at a communication "
        "step of 20 ms, its own, and 1.5 % at 5 ms (relative RMSE).",
        "The FMU trusts 96 % of these samples at 20 ms and 99 % at 5 ms; its bound promises to "
        "cover 95 % of the errors, and covers 95 % and 95 %.",
        "Avoid sines of 1 Hz (error 30 %, wrong and trusted in 80 %); inputs outside of their "
        "ranges are reported.",
    )


def test_every_verdict_has_three_sentences_of_one_full_stop_each() -> None:
    bad = row("steps", harmful=0.5, silent=0.1)
    far = row("ramps", error=0.4)
    few = row("rest", trajectories=3)
    for rows in ([row()], [without_bound()], [row(), bad, few], [row(), far], [unfilled(), few]):
        sentences = verdict(rows)
        assert len(sentences) == 3
        assert all(one.endswith(".") and ". " not in one and " ;" not in one for one in sentences)


def yours(name: str = "second half of drive.csv", **more: Any) -> Row:
    return row(name, YOURS, **more)


def test_your_inputs_are_the_first_large_number_and_the_first_row() -> None:
    name, *_ = facts(*MEASURED, yours(error=0.06))
    assert name == "Your inputs"
    number = facts(*MEASURED, yours(error=0.06))[name]
    assert (number.value, number.good) == ("6 %", False)
    assert card_table([*MEASURED, yours()]).rows[0][0] == "your inputs: second half of drive.csv"


def test_a_bound_that_never_counts_at_a_step_is_named() -> None:
    _, trust, _ = verdict([row(), unfilled(steps=4.0)])
    assert trust.endswith("; at 5 ms error_bound_filled never becomes 1, so that no bound counts.")


def test_an_fmu_without_a_bound_says_so_and_what_to_avoid() -> None:
    rows = [without_bound(), without_bound(inputs="steps", error=0.5, harmful=0.4)]
    _, trust, avoid = verdict(rows)
    assert "no error bound" in trust
    assert "Avoid steps (error 50 %, not reported); " in avoid


def test_kinds_that_are_reported_are_counted_and_not_named() -> None:
    reported = row("jumps", HELD_OUT, 0.9, harmful=0.5)
    assert f"can be judged (1) is to be avoided; under 1 of them {ITSELF}; " in to_avoid(reported)
    both = to_avoid(reported, row("steps", harmful=0.5, silent=0.2))
    one_more = f"under 1 more kind {ITSELF}; "
    assert both.startswith(f"Avoid steps (error 1 %, wrong and trusted in 20 %); {one_more}")
    slightly = row("ramps", harmful=0.5, silent=0.009)
    assert f"under 2 of them {ITSELF}" in to_avoid(slightly, reported)
    silent = row("steps", harmful=0.5, silent=0.2)
    assert f"under 2 more kinds {ITSELF}" in to_avoid(slightly, reported, silent)


def test_large_errors_are_not_to_be_avoided_where_no_sample_is_trusted() -> None:
    """As of tones far above a resonance, where an output hardly moves."""
    never, sometimes = (row("tones", error=0.95, trusted=t) for t in (FLAGGED, FLAGGED + 0.01))
    assert f"is to be avoided; under 1 of them {ITSELF}; " in to_avoid(never)
    assert "Avoid tones (error 95 %, usual for it); " in to_avoid(sometimes)


def test_kinds_that_are_reported_at_one_step_and_silent_at_a_finer_one_are_named_alone() -> None:
    rows = row("jumps", harmful=0.5), row("jumps", steps=4.0, error=0.2, silent=0.03)
    assert to_avoid(*rows).startswith(
        "Avoid jumps at 5 ms (error 20 %, wrong and trusted in 3 %); inputs outside "
    )


def test_a_bound_that_covers_too_little_makes_a_kind_one_to_avoid() -> None:
    few, well = (LEAST_COVERED + more for more in (-1e-3, 1e-3))
    assert "Avoid steps (error 1 %, bound covers 87.9 %); " in to_avoid(row("steps", covered=few))
    flagged = row("ramps", covered=few, trusted=FLAGGED)
    assert "Avoid" not in to_avoid(row("steps", covered=well), flagged)


def test_kinds_that_are_silent_at_the_finer_step_alone_are_named_with_it() -> None:
    finer = [row("jumps", steps=4.0, error=0.2, silent=0.03), row("ramps", steps=4.0)]
    assert to_avoid(row("jumps"), *finer).startswith(
        "Avoid jumps at 5 ms (error 20 %, wrong and trusted in 3 %); "
    )
    silent = row("steps", harmful=0.5, silent=0.2)
    both = to_avoid(silent, replace(silent, steps=4.0), *finer)
    assert both.startswith("Avoid steps (error 1 %, wrong and trusted in 20 %), jumps at 5 ms (")
    assert "ramps" not in both


@pytest.mark.parametrize("kind", [BEYOND, "sum"])
def test_kinds_beyond_the_range_and_sums_of_kinds_are_not_named(kind: str) -> None:
    bad = row("steps", BEYOND, harmful=0.9, silent=0.9) if kind == BEYOND else row(harmful=0.5)
    assert "Avoid inputs unlike those that were measured;" in to_avoid(bad)
    assert "can be judged (1) is to be avoided;" in to_avoid(bad, row("ramps"))


def test_kinds_with_too_few_motions_are_counted_and_not_judged() -> None:
    few = [row(f"jumps {n}", harmful=0.5, trajectories=FEWEST - 1) for n in range(2)]
    assert to_avoid(*few).startswith(
        "Avoid inputs unlike those that were measured; of 2 kinds there are too few motions to "
    )
    enough = replace(few[0], trajectories=FEWEST, silent=0.1)
    assert "Avoid jumps 0 (" in to_avoid(enough, few[1])


def test_one_motion_of_a_search_is_judged() -> None:
    found = row("noise", SEARCH, harmful=0.5, silent=0.3, trajectories=1)
    assert "Avoid noise (error 1 %, wrong and trusted in 30 %)" in to_avoid(found)


def test_kinds_of_the_same_name_have_their_groups() -> None:
    rows = [row("steps", group, harmful=0.5, silent=0.1) for group in (IN_RANGE, HELD_OUT)]
    for group in (IN_RANGE, HELD_OUT):
        assert f"{group}: steps (error 1 %" in to_avoid(*rows)


def test_more_kinds_than_three_are_counted() -> None:
    rows = [row(f"kind {n}", harmful=0.9, silent=0.1 * n) for n in range(1, 6)]
    named = to_avoid(*rows)
    assert [n for n in range(1, 6) if f"kind {n} " in named] == [3, 4, 5]
    assert "and 2 more kinds of input that the report names" in named


def test_records_have_the_error_of_the_call_that_was_measured() -> None:
    rows = [replace(one, call="known") for one in MEASURED if one.inputs == ALL]
    error, *_ = verdict(rows)
    assert "with inputs known to the step's end is 2 %" in error


def test_several_outputs_have_the_largest_error() -> None:
    one = row()
    worse = replace(one.outputs[0], name="angle", relative_rmse=0.07, covered=0.9)
    error, trust, _ = verdict([replace(one, outputs=(*one.outputs, worse))])
    assert "is up to 7 %" in error
    assert "and covers 90 %" in trust


def test_errors_that_are_large_but_usual_are_told_in_the_same_line() -> None:
    rows = [row(error=0.4), row("steps", error=0.4), row("ramps", error=0.06), row("rest")]
    error, _, avoid = verdict(rows)
    assert "far off (error above 5 %)" in error
    usual = "steps (error 40 %, usual for it), ramps (error 6 %, usual for it)"
    assert f"Avoid {usual}; " in avoid
    _, _, avoid = verdict([*rows, row("jumps", error=0.9, harmful=0.5, silent=0.5)])
    assert f"Avoid jumps (error 90 %, wrong and trusted in 50 %), {usual}; " in avoid


def test_nothing_is_far_off_up_to_five_per_cent() -> None:
    assert "far off" not in " ".join(verdict([row(error=0.05), row("steps", error=0.05)]))


def test_your_inputs_come_in_the_place_of_those_of_the_training() -> None:
    yours = row("second half of drive.csv", YOURS, 0.03, trajectories=1, trusted=0.7)
    error, trust, avoid = verdict([row(), yours])
    assert "is 3 % under your inputs (second half of drive.csv) at a communication" in error
    assert trust.startswith("The FMU trusts 70 % of these samples at 20 ms; ")
    assert "can be judged (1) is to be avoided" in avoid


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


def test_validity_counts_kinds_with_too_few_motions_apart() -> None:
    number = facts(row(), row("steps"), row("ramps", trajectories=3))["Validity"]
    assert number.value == "1 of 1"
    assert number.text.endswith(" 1 more has too few motions to tell.")
    more = facts(row(), row("steps"), row("ramps", trajectories=3), row("rest", trajectories=3))
    assert more["Validity"].text.endswith(" 2 more have too few motions to tell.")


def test_a_large_error_is_no_good_sign_even_where_it_is_usual() -> None:
    number = facts(row(error=0.4), row("steps", error=0.4), row("rest"))
    assert number["Error"].good is False
    assert (number["Validity"].value, number["Validity"].good) == ("2 of 2", False)
    assert number["Validity"].text.endswith("For 1 of them it is far off (error above 5 %).")


def test_without_bound_there_are_no_numbers_of_one() -> None:
    assert not {"Bound", "Trusted"} & set(facts(without_bound()))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({}, "long at equal accuracy (see"),
        ({"relative_error": 0.5}, "long, but is more accurate (see"),
        ({"can_be_loosened": False}, "long (see"),
    ],
)
def test_speed_says_in_a_short_sentence_what_is_compared(
    change: dict[str, Any], words: str
) -> None:
    compared = timing(10.0)
    assert compared.speed is not None
    number = facts(row(), times=replace(compared, speed=replace(compared.speed, **change)))[
        "Speed"
    ]
    assert number.good is None
    assert number.text == (
        f'A step takes 4 µs; its model takes this many times as {words} "Time at equal accuracy").'
    )


def test_an_fmu_that_is_slower_than_its_model_says_so() -> None:
    slow = facts(row(), times=timing(0.1))["Speed"]
    assert (slow.value, slow.good) == ("0.1 times", False)


def test_an_fmu_of_a_record_has_the_time_of_a_step_alone() -> None:
    alone = facts(row(), times=Timing(fmu_step_us=4.0))["Speed"]
    assert (alone.value, alone.good) == ("4 µs", None)
