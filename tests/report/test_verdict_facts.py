"""The large numbers of a verdict."""

from __future__ import annotations

import pytest

from slide_fmu.report.html_report import Fact
from slide_fmu.report.verdict_facts import MISSING, Subject, facts_of
from slide_fmu.validation.error_figures import Timing
from slide_fmu.validation.row import Row
from slide_fmu.validation.task import HELD_OUT
from tests.report.made_rows import MEASURED, row, without_bound

TIMING = Timing(fmu_step_us=4.0, reference_step_us=40.0, speedup=10.0)


def facts(*rows: Row, timing: Timing = TIMING) -> dict[str, Fact]:
    return {fact.name: fact for fact in facts_of(rows, timing, Subject(1.5, 0.02))}


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


def test_without_bound_there_are_no_numbers_of_one() -> None:
    assert not {"Bound", "Trusted"} & set(facts(without_bound()))


def test_an_fmu_that_is_slower_than_its_model_says_so() -> None:
    slow = facts(row(), timing=Timing(fmu_step_us=40.0, reference_step_us=4.0, speedup=0.1))
    assert slow["Speed"].good is False
    assert "10 times as long as the model" in slow["Speed"].text
