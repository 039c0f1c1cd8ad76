"""What credentials say about a surrogate, by what was measured of it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from slide_fmu.apps.credentials.metadata import OWN, Entry
from slide_fmu.apps.credentials.statements import statements
from slide_fmu.recipe.reading import parse_open_recipe
from slide_fmu.report.fmu_description import FmuDescription
from slide_fmu.report.limits import limits
from slide_fmu.validation.results import Validation
from tests.own_records import RECIPE
from tests.recipes import tiny_state_space_recipe
from tests.report.descriptions import described
from tests.report.made_rows import MEASURED
from tests.validation.tiny_validation import FINER, PLAIN, figures_of


def told(found: Validation, provenance: dict[str, Any]) -> dict[str, Any]:
    """Values by keyword."""
    entries = statements(FmuDescription.of(found.surrogate, provenance), FINER)
    return {e.keyword: e.value for e in entries}


def test_statements_have_the_measured_error_of_every_output(finer: Validation) -> None:
    figures = figures_of(finer)
    accuracy = told(finer, {"measured": figures.dump()})["accuracy"]
    (output,) = accuracy.iter(f"{{{OWN}}}Output")
    expected = figures.in_range.outputs[0]
    assert (output.get("name"), output.get("unit")) == (expected.name, expected.unit)
    for key in ("rmse", "relative_rmse", "max_error"):
        assert float(output.get(key)) == getattr(expected, key)


def test_statements_have_the_error_of_the_model_beside_a_finer_reference(
    finer: Validation,
) -> None:
    figures = figures_of(finer)
    (error,) = told(finer, {"measured": figures.dump()})["reference.error"]
    known = figures.in_range.outputs[0].model_relative_rmse
    assert float(error.get("relative_rmse_of_data_model")) == known
    unknown = {e.keyword: e.value for e in statements(described(finer.surrogate), PLAIN)}
    assert unknown["reference.error"] == [
        "The reference is the model that made the data; its own error is not known here."
    ]


def test_statements_have_range_excitations_and_data(finer: Validation) -> None:
    values = told(finer, {"seeds": {"data": 3, "training": None}, "versions": {"numpy": "2.0"}})
    (row,) = values["validity.inputs"]
    (signal,) = finer.surrogate.inputs
    assert (row.get("name"), row.get("unit")) == (signal.name, signal.unit)
    assert (float(row.get("low")), float(row.get("high"))) == (signal.low, signal.high)
    assert len(values["validity.excitations"]) == len(FINER.data.excitation)
    parts = {part.get("name"): part.get("trajectories") for part in values["data.trajectories"]}
    assert parts["train"] == str(FINER.data.train)
    assert [dict(row.attrib) for row in values["training"]] == [{"of": "data", "value": "3"}]
    assert [dict(r.attrib) for r in values["versions"]] == [{"package": "numpy", "version": "2.0"}]


def test_seeds_of_an_error_bound_are_told(finer: Validation) -> None:
    recipe = tiny_state_space_recipe(bound={"expert": {"seed": 7}}, data={"duration": 4.0})
    entries = statements(described(finer.surrogate, seeds={"training": 3}), recipe)
    (found,) = (entry.value for entry in entries if entry.keyword == "training")
    seeds = {row.get("of"): row.get("value") for row in found}
    assert seeds == {"training": "3", "error_bound": "7"}


def test_order_of_kept_figures_does_not_matter(finer: Validation) -> None:
    """An FMU keeps its provenance with sorted keys."""
    one = {"seeds": {"training": 1, "data": 3}, "start": {"sha256": "x", "file": "y"}}
    other = {"start": {"file": "y", "sha256": "x"}, "seeds": {"data": 3, "training": 1}}
    assert texts(finer, one) == texts(finer, other)


def texts(found: Validation, provenance: dict[str, Any]) -> list[Any]:
    entries: list[Entry] = statements(FmuDescription.of(found.surrogate, provenance), FINER)
    return [
        list(map(str, e.value)) if isinstance(e.value, list) else [r.items() for r in e.value]
        for e in entries
    ]


def test_limits_say_that_nothing_was_measured_where_it_was_not(finer: Validation) -> None:
    sentence = "The error of this surrogate has not been measured."
    assert sentence in limits(described(finer.surrogate), FINER)
    assert sentence not in limits(described(finer.surrogate, figures_of(finer)), FINER)


def test_limits_know_of_other_kinds_only_what_was_held_out(finer: Validation) -> None:
    figures = figures_of(finer)
    assert limits(described(finer.surrogate, figures), FINER)[0].endswith(
        "trained on is not known."
    )
    others = replace(figures.in_range, held_out=True)
    figures = replace(figures, validation={**figures.validation, "others": others})
    first = limits(described(finer.surrogate, figures), FINER)[0]
    assert first.endswith("is known of those alone that were held out and measured.")


@pytest.mark.parametrize(("error", "warned"), [(0.3, True), (0.1, False)])
def test_limits_warn_of_amplitudes_as_the_card_does(
    finer: Validation, error: float, warned: bool
) -> None:
    figures = figures_of(finer)
    output = replace(figures.in_range.outputs[0], relative_rmse=error)
    beyond = replace(figures.in_range, outputs=(output,), amplitude=(1.0, 2.0))
    figures = replace(figures, validation={**figures.validation, "beyond": beyond})
    sentence = (
        "Do not use the surrogate there: at 1.0 to 2.0 times the amplitude its relative RMSE is "
        "up to 30 %."
    )
    assert (sentence in limits(described(finer.surrogate, figures), FINER)) == warned


def test_statements_have_all_rows_and_say_for_which_inputs_the_fmu_is_valid(
    finer: Validation,
) -> None:
    values = told(finer, {"measured": figures_of(finer, rows=MEASURED).dump()})
    (first, *others) = values["accuracy.rows"]
    assert len(others) + 1 == len(MEASURED)
    assert (first.get("group"), first.get("call")) == ("in range", "plain")
    assert float(first.get("communication_step_s")) == 0.02
    assert float(first.get("covered")) == 0.95
    outputs = list(values["accuracy.outputs"])
    assert (outputs[0].get("name"), outputs[0].get("unit")) == ("position", "m")
    words = values["validity.in_words"]
    assert "in range: valid at 20 ms, relative RMSE 2 %." in words
    of_sines = "not valid, not always reported at 20 ms, relative RMSE 30 %."
    assert f"smooth inputs: sines of 1 Hz: {of_sines}" in words


def test_limits_tell_how_far_stability_was_tested_and_what_was_remarked(
    finer: Validation,
) -> None:
    figures = figures_of(
        finer,
        stability=[{"amplitude": 1.0}, {"amplitude": 1.5}],
        record_remarks=["few records"],
        sizes_tried=[],
        remark="more units may help",
    )
    sentences = limits(described(finer.surrogate, figures), FINER)
    assert any("not tested at more than 1.5 times" in sentence for sentence in sentences)
    assert sentences[-2:] == ["Few records.", "More units may help."]


def test_statements_of_records_name_their_files_and_hashes(finer: Validation) -> None:
    origin: dict[str, Any] = {
        "records": [{"file": "bench.csv", "sha256": "1a"}],
        "noise_record": {"file": "rest.csv", "sha256": "2b"},
    }
    recipe = parse_open_recipe(RECIPE, "bench.toml").guess
    values = {e.keyword: e.value for e in statements(described(finer.surrogate, **origin), recipe)}
    for keyword, row in (
        ("data.records", origin["records"][0]),
        ("data.noise_record", origin["noise_record"]),
    ):
        assert [dict(element.attrib) for element in values[keyword]] == [row]
    assert values["reference.model"] == ["The reference is what was measured."]
    assert "data.trajectories" not in values
