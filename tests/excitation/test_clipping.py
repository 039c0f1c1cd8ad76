"""Kinds of excitation that leave the ranges of their inputs often are remarked."""

from __future__ import annotations

from pathlib import Path

from pydantic import TypeAdapter

from slide_fmu.core.signals import Signal
from slide_fmu.excitation.clipping import clipped
from slide_fmu.excitation.kinds import Excitation
from slide_fmu.recipe.against_system import remarks_on_clipping
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.default_excitation import default_excitation
from tests.excitation.test_recorded import FORCE, ROAD, recorded, write_record
from tests.recipes import tiny_recipe

STEP = 0.01


def remark_on(**table: object) -> str | None:
    kind = TypeAdapter(Excitation).validate_python({"weight": 1.0, **table})
    return clipped(kind, (ROAD,), STEP)


def test_amplitude_far_above_one_is_remarked_with_its_share() -> None:
    noise = {"kind": "filtered_random", "angular_frequency": [5.0, 50.0]}
    assert remark_on(**noise, amplitude=[0.1, 0.4]) is None
    found = remark_on(**noise, amplitude=[0.5, 4.0])
    assert found is not None
    assert "leave their ranges in" in found
    assert "amplitude = [0.5, 4] is a factor" in found
    assert remark_on(kind="box", duration=[0.1, 1.0], ramp=[0.1, 1.0]) is None


def test_amplitude_of_bands_far_above_one_is_remarked() -> None:
    bands = {"kind": "band_sines", "bands": [[5.0, 50.0]]}
    assert remark_on(**bands, amplitude=[0.1, 1.0], offset=[0.0, 0.0]) is None
    found = remark_on(**bands, amplitude=[0.5, 4.0])
    assert found is not None
    assert "amplitude = [0.5, 4] is a factor" in found


def test_recorded_input_beyond_its_range_is_remarked_by_name(tmp_path: Path) -> None:
    path = write_record(tmp_path, count=5001)
    assert clipped(recorded(path), (ROAD,), STEP) is None
    found = clipped(recorded(path, scale=[0.5, 2.0]), (ROAD, FORCE), STEP)
    assert found is not None
    assert found.startswith("drive.csv: road leaves its range in ")
    assert found.endswith("and they are clipped")
    wide = Signal("road", "m", -1.0, 1.0, hold="first_order")
    assert clipped(recorded(path, scale=[0.5, 2.0]), (wide,), STEP) is None


def test_kind_of_a_recipe_is_named_by_table_and_number() -> None:
    high = {"kind": "steps", "weight": 1.0, "duration": [0.1, 1.0], "amplitude": [2.0, 3.0]}
    recipe = tiny_recipe(data={"excitation": [high]})
    (remark,) = remarks_on_clipping(recipe, case_of(recipe).source)
    assert remark.startswith("data.excitation, number 1 (steps): its inputs leave")


def test_mix_of_init_has_no_remark() -> None:
    for table in default_excitation(STEP, "moving"):
        assert remark_on(**table) is None
