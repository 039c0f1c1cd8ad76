"""The large numbers of a verdict."""

from __future__ import annotations

import pytest

from slide_fmu.report.html_report import Fact
from slide_fmu.report.verdict_facts import MISSING, facts_of
from slide_fmu.validation.error_figures import Timing
from slide_fmu.validation.row import Row
from slide_fmu.validation.task import HELD_OUT
from tests.report.made_rows import MEASURED, row, timing, without_bound

TIMING = timing(10.0)


def facts(*rows: Row, times: Timing = TIMING) -> dict[str, Fact]:
    return {fact.name: fact for fact in facts_of(rows, times, memory_s=1.5)}


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
