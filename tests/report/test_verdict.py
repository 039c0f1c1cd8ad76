"""The verdict has three sentences: error in the user's call, trust, what to avoid; and numbers."""

from __future__ import annotations

from dataclasses import replace

import pytest

from slide_fmu.report.html_report import Fact
from slide_fmu.report.verdict import MISSING, verdict, verdict_facts
from slide_fmu.validation.error_figures import Timing
from slide_fmu.validation.row import ALL, Row
from slide_fmu.validation.task import BEYOND, HELD_OUT, IN_RANGE
from tests.report.made_rows import MEASURED, row, timing, unfilled, without_bound


def test_three_sentences_say_error_trust_and_what_to_avoid() -> None:
    error, trust, avoid = verdict(MEASURED)
    assert "in the plain call is 2 %" in error
    assert "at a communication step of 20 ms, its own, and 1.5 % at 5 ms" in error
    assert "under sines of 1 Hz 30 % and 8 %" in error
    assert "trusts 96 % of the samples at 20 ms, where its bound covers 95 %, and 99 %" in trust
    assert avoid == (
        "Avoid, at its own step: smooth inputs: sines of 1 Hz (30 %); there it is wrong and does "
        "not say so."
    )


def test_a_bound_that_never_counts_at_a_step_is_named() -> None:
    _, trust, _ = verdict([row(), unfilled(steps=4.0)])
    assert "At 5 ms error_bound_filled never becomes 1" in trust


def test_an_fmu_without_a_bound_says_so_and_what_to_avoid() -> None:
    rows = [without_bound(), without_bound(inputs="steps", error=0.5, harmful=0.4)]
    _, trust, avoid = verdict(rows)
    assert trust == "It has no error bound, so it does not say where it is wrong."
    assert avoid.startswith("Avoid, at its own step: in range: steps (50 %)")
    assert "does not say so" in avoid


def test_kinds_that_are_reported_come_behind_silent_ones() -> None:
    reported = row("jumps", HELD_OUT, 0.9, harmful=0.5)
    _, _, avoid = verdict([row(), reported])
    assert "jumps (90 %); there it says that it is wrong" in avoid
    _, _, avoid = verdict([row(), reported, row("steps", harmful=0.5, silent=0.2)])
    assert "jumps" not in avoid
    assert "steps" in avoid


def test_kinds_that_are_silent_at_the_finer_step_alone_are_named_behind() -> None:
    finer = [row("jumps", steps=4.0, error=0.2, silent=0.03), row("ramps", steps=4.0)]
    _, _, avoid = verdict([row(), row("jumps"), *finer])
    says = "At 5 ms it is wrong and does not say so under in range: jumps (20 %)."
    assert avoid == f"{says} Inputs outside of their ranges are reported."
    silent = row("steps", harmful=0.5, silent=0.2)
    _, _, avoid = verdict([row(), silent, replace(silent, steps=4.0), *finer])
    assert avoid.endswith(
        f"there it is wrong and does not say so. {says.replace('is wrong', 'is also wrong')}"
    )
    assert "steps" not in avoid.partition("At 5 ms")[2]


def test_kinds_beyond_the_range_and_sums_of_kinds_are_not_named() -> None:
    bad = row("steps", BEYOND, harmful=0.9, silent=0.9)
    _, _, avoid = verdict([row(harmful=0.5, silent=0.5), bad])
    assert avoid.startswith("Of the measured kinds of input none is to be avoided.")


def test_kinds_of_which_few_motions_were_measured_say_how_many() -> None:
    rows = [row("jumps", harmful=0.5, trajectories=2), row("steps", harmful=0.4, trajectories=1)]
    _, _, avoid = verdict([row(), *rows])
    assert "in range: jumps (1 %, 2 motions), in range: steps (1 %, 1 motion); there" in avoid


def test_kinds_of_the_same_name_have_their_groups() -> None:
    rows = [row("steps", group, harmful=0.5, silent=0.1) for group in (IN_RANGE, HELD_OUT)]
    _, _, avoid = verdict([row(), *rows])
    assert f"{IN_RANGE}: steps (1 %)" in avoid
    assert f"{HELD_OUT}: steps (1 %)" in avoid


def test_more_kinds_than_three_are_counted() -> None:
    rows = [row(f"kind {n}", harmful=0.9, silent=0.1 * n) for n in range(1, 6)]
    _, _, avoid = verdict([row(), *rows])
    assert "kind 5 (1 %), in range: kind 4 (1 %), in range: kind 3 (1 %) and 2 more" in avoid


def test_records_have_the_error_of_the_call_that_was_measured() -> None:
    rows = [replace(one, call="known") for one in MEASURED if one.inputs == ALL]
    error, *_ = verdict(rows)
    assert error.startswith("The error with inputs known to the step's end is 2 %")


def test_several_outputs_have_the_largest_error() -> None:
    one = row()
    worse = replace(one.outputs[0], name="angle", relative_rmse=0.07, covered=0.9)
    error, trust, _ = verdict([replace(one, outputs=(*one.outputs, worse))])
    assert "is up to 7 %" in error
    assert "covers 90 %" in trust


def test_errors_that_are_large_but_usual_are_told_in_the_same_line() -> None:
    rows = [row(error=0.4), row("steps", error=0.4), row("ramps", error=0.06), row("rest")]
    error, _, avoid = verdict(rows)
    assert error.endswith("(relative RMSE). At its own step the FMU is far off (error above 5 %).")
    usual = (
        "in range: steps (40 %), in range: ramps (6 %) its error is usual, but the FMU is far off "
        "(error above 5 %)."
    )
    assert avoid == f"Under {usual} Inputs outside of their ranges are reported."
    _, _, avoid = verdict([*rows, row("jumps", error=0.9, harmful=0.5, silent=0.5)])
    assert avoid.endswith(f"jumps (90 %); there it is wrong and does not say so. Under {usual}")


def test_nothing_is_far_off_up_to_five_per_cent() -> None:
    assert "far off" not in " ".join(verdict([row(error=0.05), row("steps", error=0.05)]))


def test_nothing_measured_says_so() -> None:
    assert verdict([]) == ()


TIMING = timing(10.0)


def facts(*rows: Row, times: Timing = TIMING) -> dict[str, Fact]:
    return {fact.name: fact for fact in verdict_facts(rows, times, memory_s=1.5)}


def test_facts_are_those_of_all_inputs_in_range_in_the_plain_call() -> None:
    found = facts(*MEASURED)
    values = {name: fact.value for name, fact in found.items()}
    assert values == {
        "Error": "2 %",
        "Bound": "95 %",
        "Trusted": "96 %",
        "Validity": "1 of 2",
        "Speed": "10 times",
        "Memory": "1.5 s",
    }
    assert found["Validity"].good is False


@pytest.mark.parametrize(("missing", "good"), [(MISSING - 1e-4, True), (MISSING + 1e-4, False)])
def test_a_bound_that_covers_too_little_is_no_good_sign(missing: float, good: bool) -> None:
    assert facts(row(covered=0.95 - missing))["Bound"].good is good


def test_validity_expects_nothing_of_kinds_that_no_training_saw() -> None:
    unseen = row("binary", HELD_OUT, harmful=0.5)
    found = facts(row(), row("steps"), unseen)["Validity"]
    assert (found.value, found.good) == ("1 of 2", True)


def test_a_large_error_is_no_good_sign_even_where_it_is_usual() -> None:
    found = facts(row(error=0.4), row("steps", error=0.4), row("rest"))
    assert found["Error"].good is False
    assert (found["Validity"].value, found["Validity"].good) == ("2 of 2", False)
    assert found["Validity"].text.endswith("For 1 of them it is far off (error above 5 %).")


def test_without_bound_there_are_no_numbers_of_one() -> None:
    assert not {"Bound", "Trusted"} & set(facts(without_bound()))


def test_speed_is_that_at_equal_accuracy() -> None:
    found = facts(row())["Speed"]
    assert found.good is None
    assert found.text.startswith(
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
