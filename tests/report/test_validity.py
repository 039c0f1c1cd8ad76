"""In words where a surrogate is valid, on card and report."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from slide_fmu.recipe.reading import parse_open_recipe
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.report.accuracy_sections import validation_sections
from slide_fmu.report.model_card import model_card
from slide_fmu.report.table import markdown
from slide_fmu.report.validity import (
    RULE,
    Judgement,
    judgement_sentences,
    judgement_table,
    judgements,
)
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation.error_figures import ValidationFigures
from slide_fmu.validation.results import Validation
from tests.figures import filled
from tests.own_records import RECIPE as RECORDS
from tests.recipes import tiny_state_space_recipe
from tests.validation.handmade import KINDS, surrogate_of
from tests.validation.tiny_validation import FINER, figures_of

RANDOM = "u takes random values of up to 1 N, each for 0.015625 s"
SWEEP = "u is a sine that sweeps from 1 to 9 rad/s, or back, with an amplitude of 1 N"
BINARY = "u switches between plus and minus 1 N, each for 0.1 to 0.5 s"
MEASURED = {"amplitude": [1.0, 1.0], "outputs": [{"relative_rmse": 0.02}]}
HARMLESS = {
    **{"harmful": 0.0, "harmful_flagged": None},
    **{"harmless_flagged": 0.0, "harmful_unnoticed": 0.0},
}


def surrogate() -> Surrogate:
    own = surrogate_of()
    (signal,) = own.inputs
    named = replace(signal, name="u", unit="N", low=-1.0, high=1.0, start=None)
    return replace(own, inputs=(named,), window=replace(own.window, step=0.015625))


def recipe() -> Recipe:
    held_out = [{"kind": "binary", "weight": 1.0, "duration": [0.1, 0.5]}]
    return tiny_state_space_recipe(data={"excitation": KINDS}, validation={"excitation": held_out})


def of_kind(name: str, harm: dict[str, Any] | None = None, **more: Any) -> dict[str, Any]:
    """Figures of a validation with one kind of excitation, of which perhaps harm is known."""
    row = {"name": name, "kind": name, "relative_rmse": [0.01, 0.03]}
    found = {**MEASURED, "excitations": [row], **more}
    if harm is not None:
        kind = {"name": name, "trajectories": 2, "harm": {**HARMLESS, **harm}}
        found["error_bound"] = {"excitations": [kind], "harm": kind["harm"]}
    return found


def judged(**validations: dict[str, Any]) -> list[Judgement]:
    known = {name: filled(ValidationFigures, **v) for name, v in validations.items()}
    return judgements(surrogate(), recipe(), known)


@pytest.mark.parametrize(
    ("harm", "verdict"),
    [
        ({"harmful": 0.02, "harmful_unnoticed": 0.01}, "valid"),
        ({"harmful": 0.0201}, "not valid, and the FMU says so"),
        (
            {"harmful": 0.011, "harmful_unnoticed": 0.0101},
            "not valid, and the FMU does not always say so",
        ),
        (
            {"harmful": 0.2, "harmful_unnoticed": 0.0101},
            "not valid, and the FMU does not always say so",
        ),
        ({"harmless_flagged": 0.5}, "valid"),
        ({"harmless_flagged": 0.51}, "valid, but flagged"),
        ({"harmless_flagged": None, "harmful": 1.0}, "not valid, and the FMU says so"),
    ],
)
def test_verdict_follows_from_harmful_and_unnoticed_shares(
    harm: dict[str, Any], verdict: str
) -> None:
    known = {"harmful_flagged": 0.5, **harm}
    found = judged(a=of_kind("binary", known, held_out=True))[0]
    assert (found.verdict, found.inputs) == (verdict, BINARY)


def test_judgement_of_a_kind_that_was_held_out_has_what_was_measured() -> None:
    harm = {
        **{"harmful": 0.12, "harmful_flagged": 0.97},
        **{"harmless_flagged": 0.3, "harmful_unnoticed": 0.004},
    }
    sentences = judgement_sentences(judged(a=of_kind("binary", harm, held_out=True)))
    assert sentences[0] == (
        f"Not valid, and the FMU says so: binary: {BINARY} (not trained on, 2 trajectories, "
        "relative RMSE 3 %, 12 % of the samples harmful, 97 % of these flagged, 0.4 % of all "
        "unnoticed, 30 % of the harmless ones flagged)."
    )
    assert sentences[-1] == RULE


def test_kind_of_moving_inputs_names_the_call_and_what_the_bound_covers() -> None:
    moving = of_kind("held_random", {})
    moving["outputs"] = [{"relative_rmse": 0.02, "plain_relative_rmse": 0.3}]
    moving["error_bound"]["excitations"][0]["coverage"] = [0.96, 0.78]
    first, *_ = judgement_sentences(judged(a=moving))
    assert "relative RMSE 3 %, known to the step's end, in the plain call 78 % of the" in first
    assert "78 % of the samples covered by the bound, 0 % of the samples harmful)." in first


def test_table_has_a_column_for_each_share_that_was_measured() -> None:
    harm = {"harmful": 0.12, "harmful_flagged": 0.97, "harmful_unnoticed": 0.004}
    moving = of_kind("binary", harm, held_out=True)
    moving["outputs"] = [{"relative_rmse": 0.02, "plain_relative_rmse": 0.3}]
    moving["error_bound"]["excitations"][0]["coverage"] = [0.96, 0.78]
    table = judgement_table(judged(a=moving))
    assert table.heading == (
        *("", "inputs", "trajectories", "relative RMSE, known to the step's end"),
        *("covered by the bound, in the plain call", "harmful", "of these flagged", "unnoticed"),
        "harmless ones flagged",
    )
    verdict = "not valid, and the FMU says so (not trained on)"
    kind = f"binary: {BINARY}"
    assert table.rows[0] == (verdict, kind, "2", "3 %", "78 %", "12 %", "97 %", "0.4 %", "0 %")
    bare = judgement_table(judged(a=of_kind("sweep")))
    assert bare.heading == ("", "inputs", "relative RMSE")


def test_kinds_of_the_training_are_judged_and_those_without_trajectories_are_named() -> None:
    first, second, _ = judgement_sentences(judged(a=of_kind("held_random", {})))
    measured = "2 trajectories, relative RMSE 3 %, 0 % of the samples harmful"
    assert first == f"Valid: held_random: {RANDOM} ({measured})."
    assert second == f"Trained on: {SWEEP} (not measured)."


def test_inputs_beyond_the_range_are_judged_together() -> None:
    harm = {"harmful": 0.3, "harmful_flagged": 1.0}
    beyond = of_kind("sweep", harm, amplitude=[1.0, 3.0], trajectories=7)
    beyond["error_bound"]["outputs"] = [{"coverage": 0.9}, {"coverage": 0.8}]
    found = judged(a=beyond)[0]
    assert found.verdict == "not valid, and the FMU says so"
    assert found.inputs == "inputs of the same kinds at 1 to 3 times the amplitude"
    measured = "7 trajectories, relative RMSE 2 %, 80 % of the samples covered by the bound, 30 %"
    assert found.measured.startswith(measured)
    held_out = judged(a={**beyond, "held_out": True})[0]
    assert held_out.inputs.startswith("inputs of the kinds that were held out at 1 to 3 times")


def test_without_harm_there_is_no_verdict_and_no_rule() -> None:
    found = judged(
        a=of_kind("sweep"),
        b=of_kind("binary", held_out=True),
        c=of_kind("sweep", amplitude=[2.0, 2.0]),
    )
    assert judgement_sentences(found) == [
        f"Trained on: {SWEEP} (relative RMSE 3 %).",
        f"Not trained on: {BINARY} (relative RMSE 3 %).",
        "Beyond the range: inputs of the same kinds at 2 times the amplitude (relative RMSE 2 %).",
        f"Trained on: {RANDOM} (not measured).",
    ]


def test_records_are_named_by_their_files() -> None:
    of_records = parse_open_recipe(RECORDS, "bench.toml").guess
    (found,) = judgements(surrogate(), of_records, {})
    assert found == Judgement("trained on", "inputs like those of the file bench.csv")
    assert found.measured == "not measured"


def test_card_and_report_say_where_the_surrogate_is_valid(finer: Validation) -> None:
    measured = figures_of(finer)
    found = judgements(finer.surrogate, FINER, measured.validation)
    assert len(found) == len(FINER.data.excitation)
    assert found[0].inputs.startswith("force takes random values of up to ")
    card = model_card(finer.surrogate, FINER, measured, "picture.png")
    part = card.split("## Where it is valid\n\n")[1].split("\n\n## Measured error")[0]
    assert part == markdown(judgement_table(found))
    (section,) = [
        s for s in validation_sections({"in range": finer}) if s.title == "Where it is valid"
    ]
    assert section.table == judgement_table(found)
    assert section.text == ""
