"""Records of several specimens: every segment has the values of its file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from slide_fmu.data.generation import generate
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.reading import parse_open_recipe
from slide_fmu.recipe.recipe import Recipe, RecipeError
from slide_fmu.records.model import MeasuredRecords
from slide_fmu.records.parts import divided
from slide_fmu.records.remarks import remarks_on_division
from slide_fmu.records.segments import learnt_pieces, unseen_blocks
from slide_fmu.records.sizing import size_records
from tests.own_records import RECIPE, write_record
from tests.progress import silent
from tests.trajectories import read_split

MASSES = (1.0, 2.2, 1.5)
SAMPLES = 3000
TRAIN = 27
"""Number of segments that are learnt from."""


def recipe_of(folder: Path, data: str = "") -> Recipe:
    """The files are written where they are not there."""
    paths = [folder / f"mass_{mass}.csv" for mass in MASSES]
    for seed, (path, mass) in enumerate(zip(paths, MASSES, strict=True)):
        if not path.exists():
            write_record(path, SAMPLES, seed, mass=mass)
    first, *further = (path.as_posix() for path in paths)
    text = RECIPE.replace('model = "bench.csv"', f'model = "{first}"\nfurther = {further}')
    if "[network]" in data:
        text = text.replace("[network]\norder = 2\nhidden = 4\n", "")
    text += (
        f"\n[parameters.mass]\nvalues = {list(MASSES)}\n[data]\nblocks = 1\nduration = 4.0\n{data}"
    )
    resolved = {"data": {"burn_in": 2.4, "train": TRAIN, "validation": 6}}
    return parse_open_recipe(text, "recipe").with_found(resolved, "recipe").guess


def source_of(recipe: Recipe) -> MeasuredRecords:
    source = case_of(recipe).source
    assert isinstance(source, MeasuredRecords)
    return source


def test_every_part_has_every_specimen(tmp_path: Path) -> None:
    recipe = recipe_of(tmp_path)
    source = source_of(recipe)
    for part, blocks in divided(recipe, source).items():
        assert [block.piece for block in blocks] == [0, 1, 2], part
    assert len(learnt_pieces(recipe, source)) == 3
    found = [(segment.file, segment.parameters) for segment in unseen_blocks(recipe, source)]
    assert found == [(file, {"mass": mass}) for file, mass in enumerate(MASSES)]
    few, learnt = remarks_on_division(recipe, source)
    assert "3 specimens for polynomials of degree 1 in ['mass']; expected at least 4" in few
    assert "measured on specimens that were learnt from" in learnt


def test_trajectories_have_the_values_of_each_file(tmp_path: Path) -> None:
    recipe = recipe_of(tmp_path)
    generate(case_of(recipe), tmp_path / "trajectories", None, silent)
    split = read_split(recipe, tmp_path / "trajectories", "train")
    assert split.parameters is not None
    assert split.parameters.tolist() == [[MASSES[file]] for file in split.kinds]
    assert set(split.kinds.tolist()) == {0, 1, 2}


def test_slowest_specimen_sizes_the_window(tmp_path: Path) -> None:
    """Its rate is 4 / 2.2 in 1/s; all records together show none."""
    recipe = recipe_of(tmp_path)
    decay = size_records(recipe, source_of(recipe)).decay
    assert decay.rate == pytest.approx(-4.0 / max(MASSES), rel=0.15)
    assert decay.frequency == pytest.approx(20.0 / np.sqrt(max(MASSES)), rel=0.05)


def test_whole_files_leave_too_few_specimens_to_learn_from(tmp_path: Path) -> None:
    recipe = recipe_of(tmp_path, 'by = "record"')
    message = r"data.by = 'record': parameters \['mass'\] have 1 different values"
    with pytest.raises(RecipeError, match=message):
        divided(recipe, source_of(recipe))


def test_specimens_on_which_nothing_is_measured_are_named(tmp_path: Path) -> None:
    recipe = recipe_of(tmp_path, 'by = "block"\nshares = {train=0.7, validation=0.1, test=0.2}')
    remarks = " ".join(remarks_on_division(recipe, source_of(recipe)))
    assert "no error is measured at mass = 1; mass = 2.2:" in remarks


def test_few_specimens_for_a_polynomial_are_remarked(tmp_path: Path) -> None:
    recipe = recipe_of(tmp_path, "[network]\norder = 2\nhidden = 4\nparameter_degree = 2\n")
    remarks = " ".join(remarks_on_division(recipe, source_of(recipe)))
    assert "3 specimens for polynomials of degree 2 in ['mass']; expected at least 6" in remarks
