"""Where a command line lets trajectories be made, and what is refused."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from slide_fmu.data.workplace import Workplace
from slide_fmu.pipeline.generate import generate_recipe, workplace
from slide_fmu.pipeline.run_folder import StageError
from slide_fmu.recipe.recipe import RecipeError
from tests.pipeline.test_numbers import OPEN, opened, with_data

WITH_NUMBERS = with_data("train = 2\nvalidation = 1")


def test_shard_that_would_overwrite_is_refused() -> None:
    with pytest.raises(ValueError, match="--shard 1/2 and --overwrite; expected one of them"):
        workplace(None, None, "1/2", overwrite=True)
    assert workplace(3, None, None, overwrite=True) == Workplace(3)


def test_shard_of_a_number_that_is_open_is_refused_with_the_remedy(tmp_path: Path) -> None:
    place = workplace(None, None, "1/2", overwrite=False)
    with pytest.raises(RecipeError, match=r"leaves data\.train open, and --shard 1/2 cannot"):
        generate_recipe(opened(tmp_path, OPEN), place, overwrite=False)


def test_data_are_made_beside_another_program_that_makes_some_and_not_beside_one_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("slide_fmu.pipeline.run_folder.TOGETHER_PATIENCE", 0.1)
    job, place = opened(tmp_path, WITH_NUMBERS), Workplace(0)
    with job.folder.alone(), pytest.raises(StageError, match="another program works in"):
        generate_recipe(job, place, overwrite=False)
    with job.folder.together(), pytest.raises(StageError, match=rf"\(process {os.getpid()}\)"):
        generate_recipe(job, place, overwrite=True)
    assert generate_recipe(job, place, overwrite=False)["made_now"] == 3
    assert generate_recipe(job, place, overwrite=True)["made_now"] == 3
