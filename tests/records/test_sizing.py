"""The window of records follows from a linear fit, and is held against it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from slide_fmu.memory.lengths import Lengths
from slide_fmu.memory.sizing import NotForgettingError, ShortWindowError, require_window
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.reading import parse_open_recipe
from slide_fmu.recipe.recipe import Recipe, RecipeError
from slide_fmu.records.model import MeasuredRecords
from slide_fmu.records.sizing import RecordSizing, lengths_of_records, size_records
from slide_fmu.report.quality import remedy
from tests.own_records import RATE, RECIPE, STEP, force_and_travel, write_record
from tests.refusals import refused

OPEN = RECIPE.replace("n_in = 240\nn_out = 80\n", "remaining_amplitude = 0.01\n")


def recipe_of(path: Path, text: str = RECIPE) -> Recipe:
    return parse_open_recipe(text.replace('"bench.csv"', f'"{path}"'), "bench.toml").guess


def sized(path: Path, text: str = RECIPE) -> RecordSizing:
    recipe = recipe_of(path, text)
    return size_records(recipe, source_of(recipe))


def source_of(recipe: Recipe) -> MeasuredRecords:
    source = case_of(recipe).source
    assert isinstance(source, MeasuredRecords)
    return source


def lengths(path: Path, text: str = OPEN) -> Lengths:
    read = parse_open_recipe(text.replace('"bench.csv"', f'"{path}"'), "bench.toml")
    return lengths_of_records(read, source_of(read.guess))


def drifting(path: Path) -> Path:
    """A position under force: the sum of what a rate would be."""
    force, travel = force_and_travel(6000)
    table = np.stack([STEP * np.arange(6000), force, np.cumsum(travel)], axis=1)
    np.savetxt(path, table, "%.9g", ",", header="time,force,travel", comments="")
    return path


def test_window_is_found_from_the_slowest_pole_and_holds_it(tmp_path: Path) -> None:
    found = lengths(write_record(tmp_path / "a.csv", 8000, noise=0.01))
    window, sizing = found.recipe.guess.window, found.sizing
    assert sizing is not None
    truncated = (window.n_in - window.n_out) * STEP
    assert np.log(100) / RATE < truncated < 2.0 * np.log(100) / RATE
    assert sizing.window.n_in == window.n_in
    require_window(found.recipe.guess, sizing)


def test_segments_are_no_longer_than_the_shortest_part(tmp_path: Path) -> None:
    found = lengths(write_record(tmp_path / "a.csv", 2500, noise=0.01))
    window, duration = found.recipe.guess.window, found.recipe.guess.data.duration
    samples = round(duration / STEP) - (window.n_in - window.n_out)
    assert samples <= 0.15 * 2500
    assert found.values["data"]["duration"] == duration


def test_lengths_that_are_given_stay(tmp_path: Path) -> None:
    text = RECIPE + "[data]\nduration = 5.0\n"
    found = lengths(write_record(tmp_path / "a.csv"), text)
    assert (found.recipe.guess.window.n_in, found.recipe.guess.data.duration) == (240, 5.0)
    assert found.sizing is None


def test_window_that_is_too_short_is_refused_with_the_one_that_is_needed(tmp_path: Path) -> None:
    text = RECIPE.replace("n_in = 240", "n_in = 100")
    path = write_record(tmp_path / "a.csv", 8000)
    sizing = sized(path, text)
    recommended = sizing.figures().recommended_n_in
    with pytest.raises(ShortWindowError, match=f"give n_in >= {recommended}"):
        require_window(recipe_of(path, text), sizing)


def test_position_under_force_is_refused_as_an_integral(tmp_path: Path) -> None:
    path = drifting(tmp_path / "a.csv")
    with refused(NotForgettingError, "free direction"):
        lengths(path)
    with refused(NotForgettingError, "output instead"):
        require_window(recipe_of(path), sized(path))
    figures = sized(path).figures()
    assert (figures.sufficient, figures.recommended_n_in) == (False, None)


def test_few_windows_are_remarked_with_their_number(tmp_path: Path) -> None:
    short, long = (sized(write_record(tmp_path / f"{n}.csv", n)) for n in (3000, 9000))
    assert short.remark is not None
    assert "the part to learn from has 2099 samples, 8.75 windows of 240" in short.remark
    assert long.remark is None


def test_record_without_enough_samples_for_a_fit_is_refused(tmp_path: Path) -> None:
    path = write_record(tmp_path / "a.csv", 40)
    with refused(RecipeError, "27 samples with", "recipe 'bench'"):
        sized(path)


def test_remedies_of_records_name_no_keys_that_they_do_not_have(tmp_path: Path) -> None:
    path = write_record(tmp_path / "a.csv")
    problem = sized(path, RECIPE.replace("n_in = 240", "n_in = 100")).problem
    assert problem is not None
    assert "100 - 80 = 20 samples (0.2 s) are truncated" in problem
    for text in (problem, remedy(recipe_of(path))):
        assert not any(word in text for word in ("seed", "data.train", "data.excitation"))
