"""A file of inputs is added to the text of a recipe, as if the recipe named it."""

from __future__ import annotations

from pathlib import Path

import pytest

from slide_fmu.excitation.recorded import Recorded
from slide_fmu.recipe.reading import parse_open_recipe
from slide_fmu.recipe.recipe import RecipeError, tables_of_training
from slide_fmu.recipe.your_inputs import with_inputs
from tests.recipes import TINY
from tests.refusals import refused

WITHOUT_KINDS = """
name = "tiny"
description = "Linear oscillator"
[system]
model = "mbs_models.oscillators:LinearOscillator"
[window]
step = 0.03125
"""


@pytest.fixture
def drive(tmp_path: Path) -> str:
    path = tmp_path / "drive.csv"
    path.write_text("t,force\n0,1\n30,2\n", encoding="utf-8")
    return str(path)


@pytest.mark.parametrize("text", [TINY, WITHOUT_KINDS])
def test_file_becomes_a_quarter_of_the_mix_that_decides_the_training(
    text: str, drive: str
) -> None:
    before, more = parse_open_recipe(text, "recipe").guess, with_inputs(text, "recipe", drive)
    after = parse_open_recipe(more, "recipe").guess
    *others, file = after.data.excitation
    assert tuple(others) == before.data.excitation
    assert isinstance(file, Recorded)
    assert (file.path, file.learnt) == (drive, 0.5)
    total = sum(kind.weight for kind in after.data.excitation)
    assert file.weight / total == pytest.approx(0.25, abs=0.01)
    keys = [tables_of_training(one.model_dump(mode="json")) for one in (before, after)]
    assert keys[0] != keys[1]
    assert str(file.digest) in str(keys[1])
    assert with_inputs(more, "recipe", drive) == more  # it names the file already


def test_a_recipe_with_another_file_or_of_records_is_refused(tmp_path: Path, drive: str) -> None:
    more = with_inputs(TINY, "recipe", drive)
    other = tmp_path / "other.csv"
    other.write_text("t,force\n0,1\n30,3\n", encoding="utf-8")
    with refused(RecipeError, "drive.csv' as your inputs", "leave out --inputs"):
        with_inputs(more, "recipe", str(other))


def test_kinds_within_one_line_cannot_be_added_to(drive: str) -> None:
    inline = '[data]\nexcitation = [{ kind = "held_random", weight = 1.0 }]\n'
    with refused(RecipeError, "cannot be added", "[[data.excitation]]: write its kinds so"):
        with_inputs(WITHOUT_KINDS + inline, "recipe", drive)
