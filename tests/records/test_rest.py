"""Records that begin at rest lose no lead, and are found by looking."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.reading import parse_open_recipe
from slide_fmu.recipe.recipe import Recipe, RecipeError
from slide_fmu.records.model import MeasuredRecords
from slide_fmu.records.parts import divided
from slide_fmu.records.proposal import RecordOptions, propose_record
from slide_fmu.records.remarks import remarks_on_division
from slide_fmu.records.rest import begins_at_rest, begins_in_motion
from slide_fmu.records.segments import segments, unseen_blocks
from slide_fmu.systems.errors import LoadError
from tests.own_records import RECIPE, STEP, write_record
from tests.refusals import refused

MOVE, FILES, LEAD = 120, 16, 160
"""Samples of a file, all shorter than the window's lead."""
POLES = np.array([1.0, -1.8, 0.82])


def move(seed: int, rest: int = 10, level: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Force and travel of one move from rest at a level."""
    rng = np.random.default_rng(seed)
    force = np.append(np.zeros(rest), np.repeat(rng.uniform(-1, 1, 12), 10))[:MOVE]
    return force, level + lfilter([0.0, 0.02], POLES, force)


def moves(folder: Path, noise: float = 0.0, rest: int = 10) -> list[Path]:
    rng, paths = np.random.default_rng(9), []
    for seed in range(FILES):
        force, travel = move(seed, rest, level=3.0)
        travel = travel + noise * rng.normal(size=MOVE)
        table = np.stack([STEP * np.arange(MOVE), force, travel], axis=1)
        paths.append(folder / f"{seed}.csv")
        np.savetxt(paths[-1], table, "%.9g", ",", header="time [s],force,travel", comments="")
    return paths


def recipe_of(paths: list[Path], parameters: str = "", by: str = "record") -> Recipe:
    model = f'model = "{paths[0]}"\nfurther = {[str(path) for path in paths[1:]]}\n{parameters}'
    text = RECIPE.replace('model = "bench.csv"', model) + f'\n[data]\nby = "{by}"\n'
    lengths = {"data": {"duration": 2.4, "burn_in": 2.4}}
    return parse_open_recipe(text, "bench.toml").with_found(lengths, "bench.toml").guess


def source_of(recipe: Recipe) -> MeasuredRecords:
    source = case_of(recipe).source
    assert isinstance(source, MeasuredRecords)
    return source


AT_REST = 'parameters = { start = "rest" }\n'


def test_files_shorter_than_the_window_are_learnt_from_rest_alone(tmp_path: Path) -> None:
    paths = moves(tmp_path)
    with refused(RecipeError, "0 samples to score"):
        divided(recipe_of(paths), source_of(recipe_of(paths)))
    recipe = recipe_of(paths, AT_REST)
    source = source_of(recipe)
    scored = {
        (block.piece, k)
        for blocks in divided(recipe, source).values()
        for block in blocks
        for k in range(block.scored, block.stop)
    }
    assert scored == {(piece, k) for piece in range(FILES) for k in range(MOVE - 1)}
    assert not any("no longer than" in remark for remark in remarks_on_division(recipe, source))


def test_window_before_a_record_has_its_resting_values(tmp_path: Path) -> None:
    recipe = recipe_of(moves(tmp_path), AT_REST)
    source = source_of(recipe)
    [first, *_] = segments(recipe, source, "train")
    force, travel = move(0, level=3.0)
    assert first.lead == LEAD
    np.testing.assert_array_equal(first.trajectory.inputs[:LEAD], 0.0)
    np.testing.assert_allclose(first.trajectory.outputs[: LEAD + 1], 3.0)
    count = len(first.trajectory.inputs) - LEAD
    np.testing.assert_allclose(first.trajectory.inputs[LEAD:, 0], force[1 : count + 1])
    np.testing.assert_allclose(first.trajectory.outputs[LEAD:, 0], travel[: count + 1], rtol=1e-8)
    tested = unseen_blocks(recipe, source)
    assert all(block.lead == recipe.window.n_in for block in tested)


def test_input_that_moves_at_the_second_sample_was_at_the_first_before(tmp_path: Path) -> None:
    """The first one belongs to no output, where outputs answer at once."""
    recipe = recipe_of(moves(tmp_path, rest=1), AT_REST)
    [first, *_] = segments(recipe, source_of(recipe), "train")
    np.testing.assert_array_equal(first.trajectory.inputs[:LEAD], 0.0)
    assert first.trajectory.inputs[LEAD, 0] == pytest.approx(move(0, rest=1)[0][1], rel=1e-8)


def test_piece_behind_a_gap_begins_at_rest_where_it_shows_it(tmp_path: Path) -> None:
    force, travel = (np.concatenate(both) for both in zip(move(0), move(1), move(2), strict=True))
    time = STEP * np.arange(3 * MOVE)
    time[MOVE:] += 5.0
    time[2 * MOVE + 30 :] += 5.0
    table = np.stack([time, force, travel], axis=1)
    path = tmp_path / "a.csv"
    np.savetxt(path, table, "%.9g", ",", header="time [s],force,travel", comments="")
    source = source_of(recipe_of([path], AT_REST, by="block"))
    assert [piece.rest is not None for piece in source.pieces] == [True, True, False]


@pytest.mark.parametrize("noise", [0.0, 1e-3, 1e-2])
def test_init_finds_that_all_files_begin_at_rest(tmp_path: Path, noise: float) -> None:
    paths = tuple(map(str, moves(tmp_path, noise, rest=40)))
    proposal = propose_record(RecordOptions(paths, {"force": None}, ("travel",)))
    assert 'start = "rest"' in proposal.text
    assert any("every file begins at rest" in remark for remark in proposal.remarks)
    write_record(tmp_path / "moving.csv")
    options = RecordOptions((str(tmp_path / "moving.csv"),), {"force": None})
    assert "start =" not in propose_record(options).text.partition("[system.inputs")[0]


def test_file_that_moves_before_its_inputs_does_not_begin_at_rest(tmp_path: Path) -> None:
    paths = moves(tmp_path)
    force, travel = move(3)
    travel = travel + np.exp(-np.arange(MOVE) / 30)
    table = np.stack([STEP * np.arange(MOVE), force, travel], axis=1)
    np.savetxt(paths[2], table, "%.9g", ",", header="time [s],force,travel", comments="")
    with refused(LoadError, "2.csv", "outputs move in the first 10 samples", "remove this key"):
        source_of(recipe_of(paths, AT_REST))


def test_other_starts_are_refused(tmp_path: Path) -> None:
    with refused(LoadError, "start = 'motion'", "expected 'rest'"):
        source_of(recipe_of(moves(tmp_path), 'parameters = { start = "motion" }\n'))


@pytest.mark.parametrize("noise", [0.0, 0.01, 0.1])
@pytest.mark.parametrize("drift", [0.0, 2.0])
def test_rest_is_told_from_motion_under_noise(noise: float, drift: float) -> None:
    force, travel = move(0, rest=40)
    rng = np.random.default_rng(1)
    size = travel.std()
    outputs = travel + noise * size * rng.normal(size=MOVE) + drift * size * np.arange(MOVE) / MOVE
    both = force[:, None], outputs[:, None]
    assert begins_at_rest(*both) == (drift == 0.0)
    assert begins_in_motion(*both) == (drift != 0.0)


def test_input_that_moves_at_once_shows_neither() -> None:
    force, travel = move(0, rest=1)
    both = force[:, None], travel[:, None]
    assert not begins_at_rest(*both)
    assert not begins_in_motion(*both)


def test_noise_of_many_files_is_no_motion() -> None:
    rng = np.random.default_rng(3)
    force, travel = move(0, rest=40)
    moving = 0
    for _ in range(1000):
        outputs = travel + 0.02 * travel.std() * rng.normal(size=MOVE)
        both = force[:, None], outputs[:, None]
        moving += not begins_at_rest(*both)
        assert not begins_in_motion(*both)
        assert not begins_in_motion(force[32:, None], outputs[32:, None])
    assert moving <= 5


def test_slow_machine_whose_input_has_changed_before_is_not_at_rest() -> None:
    """It hardly moves while its input is held for the first time, and moves on after that."""
    force = np.repeat([1.0, -0.5, 0.8, -1.0], 6)
    travel = lfilter([0.002], [1, -0.998], np.append(force, np.zeros(400)))
    both = np.append(force, np.zeros(400))[:, None], travel[:, None]
    assert not begins_at_rest(*both)
