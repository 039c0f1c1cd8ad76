"""The large numbers of a verdict: a bound shows what it covers in the user's own call."""

from __future__ import annotations

from pathlib import Path

import pytest

from slide_fmu.fmu.export import read_fmu
from slide_fmu.report.html_report import Fact
from slide_fmu.report.run_figures import released_figures
from slide_fmu.report.validity import is_valid
from slide_fmu.report.verdict import Subject
from slide_fmu.report.verdict_facts import MISSING, verdict_of

FMUS = Path(__file__).parents[2] / "fmus"


def fact_and_coverage(name: str) -> tuple[Fact, list[float]]:
    """Return the fact on the bound of a released FMU, and its shares in both ways of calling."""
    surrogate, provenance = read_fmu(FMUS / name / f"{name}.fmu")
    measured = released_figures(provenance)
    assert measured is not None
    bound = measured.in_range.error_bound
    assert bound is not None
    shares = [min(output.coverage for output in bound.outputs)]
    shares += [] if bound.plain is None else [min(bound.plain.coverage)]
    (fact,) = (f for f in verdict_of(measured, Subject.of(surrogate)).facts if f.name == "Bound")
    return fact, shares


@pytest.mark.parametrize("name", ["robot_6r", "slider_crank"])
def test_bound_shows_the_smaller_share_of_the_plain_call(name: str) -> None:
    fact, (known, plain) = fact_and_coverage(name)
    assert plain < 0.95 - MISSING < known
    assert fact.value == f"{100 * plain:.3g} %"
    assert not fact.good
    assert f"With inputs known to the step's end: {100 * known:.3g} %." in fact.text


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
