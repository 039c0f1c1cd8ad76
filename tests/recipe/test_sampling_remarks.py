"""Remarks on excitation that samples cannot show."""

from __future__ import annotations

from pathlib import Path

import pytest

from slide_fmu.recipe.checks import remarks_on_sampling
from slide_fmu.recipe.reading import load_open_recipe
from tests.recipes import tiny_state_space_recipe

RELEASED = sorted(Path(__file__).parents[2].joinpath("training").glob("*.toml"))
NYQUIST = 3.141592653589793 * 64
"""In rad/s: the tiny recipe has 64 samples in a second."""


def test_sine_beyond_the_frequency_of_nyquist_is_remarked_on() -> None:
    kinds = [
        {"kind": "held_random", "weight": 1.0},
        {
            "kind": "harmonic",
            "weight": 1.0,
            "amplitude": [0.1, 0.5],
            "angular_frequency": [4.0, 250.0],
        },
    ]
    (remark,) = remarks_on_sampling(tiny_state_space_recipe(data={"excitation": kinds}))
    assert remark.startswith("data.excitation, number 2 (harmonic): angular_frequency up to 250")
    assert "0.015625 s apart show at most 201.1 rad/s" in remark


@pytest.mark.parametrize("table", ["bound", "validation"])
def test_other_tables_of_kinds_are_looked_at_too(table: str) -> None:
    kind = {"kind": "harmonic", "weight": 1.0, "angular_frequency": [4.0, 250.0]}
    tables = {"bound": {}, "data": {"duration": 4.0}} | {table: {"excitation": [kind]}}
    (remark,) = remarks_on_sampling(tiny_state_space_recipe(**tables))
    assert remark.startswith(f"{table}.excitation, number 1 (harmonic)")


def test_sine_up_to_the_frequency_of_nyquist_is_not() -> None:
    kind = {
        "kind": "harmonic",
        "weight": 1.0,
        "amplitude": [0.1, 0.5],
        "angular_frequency": [4.0, 0.999 * NYQUIST],
    }
    assert not remarks_on_sampling(tiny_state_space_recipe(data={"excitation": [kind]}))


@pytest.mark.parametrize("path", RELEASED, ids=lambda path: path.stem)
def test_released_recipes_ask_for_no_such_frequency(path: Path) -> None:
    assert not remarks_on_sampling(load_open_recipe(path).guess)
