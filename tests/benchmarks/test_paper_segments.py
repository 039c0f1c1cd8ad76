"""Segments of test motions, of the whole mix or of one excitation alone."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np
import paper_segments
import pytest
from paper_segments import measure, with_excitation
from samples_of_tiny import held_by_an_fmu

from slide_fmu.data.draws import TEST, Stream, draw
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.reading import parse_recipe
from slide_fmu.systems.simulation import simulate
from tests.progress import no_stages
from tests.refusals import refused


def measured(monkeypatch: pytest.MonkeyPatch, **changes: Any) -> dict[str, Any]:
    monkeypatch.setattr(paper_segments, "read_fmu", lambda path: held_by_an_fmu())
    values = {
        "fmu": Path("tiny.fmu"), "trajectories": 5, "duration": None, "seed": 3,
        "excitation": None, "amplitude": (1.0, 1.0), "through_fmu": False, **changes,
    }  # fmt: skip
    return measure(argparse.Namespace(**values), no_stages)


@pytest.mark.parametrize("number", [1, 2])
def test_one_excitation_alone_has_all_motions(
    monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    found = measured(monkeypatch, excitation=number)
    (kind,) = found["kinds"]
    assert (kind["excitation"], kind["trajectories"], kind["seed"]) == (number, 5, 3)
    assert kind["kind"] == ["held_random", "harmonic"][number - 1]
    assert found["excitation"] == number
    assert kind["rmse"] == found["all"]["rmse"]
    statistics = kind["relative_rmse"]["of_segment"]
    assert {"median", "mean", "standard_deviation"} <= set(statistics)
    assert kind["e_95_mm"] > 0


def test_the_mix_names_its_excitations_by_their_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    kinds = measured(monkeypatch)["kinds"]
    assert [kind["excitation"] for kind in kinds] == [1, 2]
    assert sum(kind["trajectories"] for kind in kinds) == 5


def test_rmse_is_that_of_the_newest_outputs(monkeypatch: pytest.MonkeyPatch) -> None:
    surrogate, provenance = held_by_an_fmu()
    recipe = with_excitation(parse_recipe(provenance["recipe"], "tiny"), 2)
    system, errors = case_of(recipe).reference, []
    for index in range(5):
        drawn = draw(recipe, system, Stream(TEST, 3, (1.0, 1.0), 2.0), index)
        true = simulate(system, drawn.inputs, drawn.initial).outputs
        first = max(drawn.burn_in + 1, surrogate.network.memory_length)
        error = surrogate.predict_newest(drawn.inputs)[first - 1 :] - true[first:]
        errors.append(error[: len(error) // 8 * 8])
    expected = np.sqrt(np.mean(np.concatenate(errors) ** 2))
    assert measured(monkeypatch, excitation=2)["all"]["rmse"] == pytest.approx(expected)


@pytest.mark.parametrize("number", [0, 3])
def test_excitation_that_is_not_there_is_refused(
    monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    message = rf"--excitation {number}: .* 2 excitations; expected one of 1 \(held_random\), 2 \("
    with pytest.raises(SystemExit, match=message):
        measured(monkeypatch, excitation=number)


def test_motion_without_a_whole_segment_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    with refused(SystemExit, "duration = 0.40625", "expected at least 0.5 s"):
        measured(monkeypatch, duration=0.4)
