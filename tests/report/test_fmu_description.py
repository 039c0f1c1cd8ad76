"""An FMU is described once; all that shows it says the same of it."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from slide_fmu.apps.page.facts import page_facts
from slide_fmu.cli.app import app
from slide_fmu.core.readable import quantity
from slide_fmu.fmu.export import read_fmu
from slide_fmu.pipeline.run_folder import recipe_of_provenance
from slide_fmu.report.fmu_description import FmuDescription
from slide_fmu.report.limits import limits
from slide_fmu.report.model_card import model_card
from slide_fmu.surrogate.description import SurrogateDescription
from tests.report.descriptions import described

FMUS = Path(__file__).parents[2] / "fmus"
BOUNDED = "duffing", "robot_6r", "mass_chain_10ms"
WITHOUT_BOUND = "linear", "slider_crank_payload"


@pytest.mark.parametrize("name", BOUNDED)
def test_tolerances_are_those_of_the_fmu_everywhere(name: str) -> None:
    fmu = FMUS / name / f"{name}.fmu"
    surrogate, provenance = read_fmu(fmu)
    pairs = zip(surrogate.error_tolerances, surrogate.outputs, strict=True)
    expected = ", ".join(f"{quantity(size, one.unit)} of {one.name}" for size, one in pairs)
    recipe = recipe_of_provenance(provenance, str(fmu))
    of_credentials = " ".join(limits(FmuDescription.of(surrogate, provenance), recipe))
    of_info = CliRunner().invoke(app, ["info", str(fmu)]).stdout
    for text in (repr(surrogate), of_info, of_credentials):
        assert expected in text


@pytest.mark.parametrize("name", [*BOUNDED, *WITHOUT_BOUND])
def test_repr_of_a_surrogate_has_its_signals_and_no_arrays(name: str) -> None:
    surrogate, _ = read_fmu(FMUS / name / f"{name}.fmu")
    first, *lines = repr(surrogate).splitlines()
    assert first == f"Surrogate {name!r}"
    named = [line.split()[1].rstrip(":") for line in lines]
    signals = [*surrogate.inputs, *surrogate.outputs, *surrogate.parameters]
    assert named[: len(signals)] == [signal.name for signal in signals]
    assert ("tolerances" in lines[-1]) == (name in BOUNDED)
    assert "array(" not in repr(surrogate)


@pytest.mark.parametrize("name", [*BOUNDED, *WITHOUT_BOUND])
def test_page_and_info_have_the_same_memory_and_spans(name: str) -> None:
    surrogate, provenance = read_fmu(FMUS / name / f"{name}.fmu")
    page = page_facts(surrogate, provenance)
    described = FmuDescription.of(surrogate, provenance).dump()
    assert page.memory == described["memory_s"]
    assert page.estimated == described.get("estimate_span_s")
    assert page.past >= page.memory


def test_verdict_of_card_and_info_is_that_of_the_description() -> None:
    fmu = FMUS / "duffing" / "duffing.fmu"
    one = FmuDescription.of(*read_fmu(fmu))
    card, printed = model_card(one), CliRunner().invoke(app, ["info", str(fmu)]).stdout
    assert len(one.verdict) == 3
    assert all(sentence in card and sentence in printed for sentence in one.verdict)


def test_fmu_without_provenance_has_no_verdict_and_no_seeds() -> None:
    surrogate, _ = read_fmu(FMUS / "linear" / "linear.fmu")
    bare = FmuDescription.of(surrogate, None)
    assert (bare.verdict, bare.measured, bare.origin.known_seeds) == ((), None, {})
    assert bare.dump()["provenance"] is None
    known = described(surrogate, seeds={"data": 3, "training": None})
    assert known.origin.known_seeds == {"data": 3}


def test_outputs_have_the_ranges_of_the_training_where_they_are_known() -> None:
    surrogate, _ = read_fmu(FMUS / "duffing" / "duffing.fmu")
    assert surrogate.output_ranges is not None
    one = SurrogateDescription.of(surrogate)
    (output,) = one.trained_outputs
    assert [output.low, output.high] == pytest.approx(surrogate.output_ranges[0], rel=1e-3)
    assert one.outputs == surrogate.outputs
