"""The large numbers of a verdict: a bound shows what it covers in the user's own call."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from slide_fmu.fmu.export import read_fmu
from slide_fmu.report.html_report import Fact
from slide_fmu.report.run_figures import released_figures
from slide_fmu.report.validity import is_valid
from slide_fmu.report.verdict import Subject
from slide_fmu.report.verdict_facts import MISSING, verdict_of
from slide_fmu.validation.task import IN_RANGE
from slide_fmu.validation.trust_figures import Covered

FMUS = Path(__file__).parents[2] / "fmus"


def fact_and_coverage(name: str, in_plain_call: float | None = None) -> tuple[Fact, list[float]]:
    """Return the fact on the bound of a released FMU, and its shares in both ways of calling.

    The share in the plain call may be another one than was measured.
    """
    surrogate, provenance = read_fmu(FMUS / name / f"{name}.fmu")
    measured = released_figures(provenance)
    assert measured is not None
    bound = measured.in_range.error_bound
    assert bound is not None
    if in_plain_call is not None:
        other = Covered(coverage=tuple(in_plain_call for _ in bound.outputs), untrusted=0.1)
        bound = replace(bound, plain=other)
        in_range = replace(measured.in_range, error_bound=bound)
        measured = replace(measured, validation={**measured.validation, IN_RANGE: in_range})
    shares = [min(output.coverage for output in bound.outputs)]
    shares += [] if bound.plain is None else [min(bound.plain.coverage)]
    (fact,) = (f for f in verdict_of(measured, Subject.of(surrogate)).facts if f.name == "Bound")
    return fact, shares


@pytest.mark.parametrize("share", [0.6, 0.95 - MISSING - 1e-4])
@pytest.mark.parametrize("name", ["robot_6r", "slider_crank"])
def test_bound_shows_the_smaller_share_of_the_plain_call(name: str, share: float) -> None:
    fact, (known, plain) = fact_and_coverage(name, share)
    assert plain < 0.95 - MISSING < known
    assert fact.value == f"{100 * plain:.3g} %"
    assert not fact.good
    assert f"With inputs known to the step's end: {100 * known:.3g} %." in fact.text


@pytest.mark.parametrize("name", ["robot_6r", "slider_crank"])
def test_bounds_of_released_machines_hold_in_the_plain_call(name: str) -> None:
    fact, (known, plain) = fact_and_coverage(name)
    assert min(known, plain) > 0.94
    assert fact.value == f"{100 * min(known, plain):.3g} %"
    assert fact.good


@pytest.mark.parametrize("name", ["robot_6r", "slider_crank"])
def test_card_says_how_often_each_call_is_trusted(name: str) -> None:
    _, provenance = read_fmu(FMUS / name / f"{name}.fmu")
    measured = released_figures(provenance)
    assert measured is not None
    bound = measured.in_range.error_bound
    assert bound is not None
    assert bound.plain is not None
    assert bound.plain.untrusted is not None
    assert bound.untrusted is not None
    card = (FMUS / name / "README.md").read_text("utf-8")
    plain, known = (f"{100 * share:.3g} %" for share in (bound.plain.untrusted, bound.untrusted))
    assert (
        f"Samples where trusted is false: {plain} in the plain call, {known} with inputs" in card
    )
    assert (
        "There is one bound of the plain call, and one of inputs known to the step's end" in card
    )
    assert "False alarms with inputs known to the step's end, with the tolerances" in card


def test_bound_of_held_inputs_shows_its_only_share() -> None:
    fact, (covered,) = fact_and_coverage("duffing")
    assert fact.value == f"{100 * covered:.3g} %"
    assert fact.good
    assert fact.text.endswith("below the error bound of 95 %.")


def test_validity_counts_kinds_that_no_training_saw() -> None:
    surrogate, provenance = read_fmu(FMUS / "robot_6r" / "robot_6r.fmu")
    measured = released_figures(provenance)
    assert measured is not None
    (unseen,) = (one for one in measured.validation.values() if one.held_out)
    assert unseen.error_bound is not None
    judged = [kind.harm for kind in unseen.error_bound.excitations if kind.harm is not None]
    valid = sum(map(is_valid, judged))
    assert valid < len(judged)  # else the number would be green, rightly
    (fact,) = (
        f for f in verdict_of(measured, Subject.of(surrogate)).facts if f.name == "Validity"
    )
    assert f"{valid} of {len(judged)} others" in fact.text
    assert not fact.good
