"""Trajectories of records: no sample is tested that was learnt from, and none is lost."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from slide_fmu.core.progress import Progress
from slide_fmu.data.generation import generate
from slide_fmu.data.trajectories import Trajectories
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.open_recipe import OpenRecipe
from slide_fmu.recipe.reading import parse_open_recipe
from slide_fmu.recipe.recipe import Recipe, RecipeError
from slide_fmu.records.model import MeasuredRecords
from slide_fmu.records.parts import divided, longest_scored
from slide_fmu.records.remarks import left_out, remarks_on_division
from slide_fmu.records.segments import inputs_beyond, segments, unseen_blocks
from tests.marks import needs_app
from tests.own_records import RECIPE, write_record
from tests.progress import silent
from tests.refusals import refused
from tests.trajectories import read_split

LEAD = 160
ROUNDING = 1e-12
"""A value from which the mean was taken, and to which it was added again, differs by less."""


def recipe_of(path: Path, more: str = "", **values: object) -> Recipe:
    text = RECIPE.replace('"bench.csv"', f'"{path}"') + more
    keys = {"blocks": 1, **values}
    text += "\n[data]\n" + "\n".join(f"{key} = {value}" for key, value in keys.items()) + "\n"
    read = parse_open_recipe(text, "bench.toml")
    lengths = {"data": {"duration": 4.0, "burn_in": 2.4}}
    given = {key for key in ("duration",) if key in values}
    lengths["data"] = {k: v for k, v in lengths["data"].items() if k not in given}
    return read.with_found(lengths, "bench.toml").guess


def with_numbers(recipe: Recipe, train: int, validation: int) -> Recipe:
    read = OpenRecipe(recipe, ("data.train", "data.validation"))
    values = {"data": {"train": train, "validation": validation}}
    return read.with_found(values, "bench.toml").resolved()


def source_of(recipe: Recipe) -> MeasuredRecords:
    source = case_of(recipe).source
    assert isinstance(source, MeasuredRecords)
    return source


def starts(recipe: Recipe, part: str) -> list[int]:
    """Numbers of the first inputs of all segments of a part; inputs of the record are unlike."""
    source = source_of(recipe)
    inputs = source.pieces[0].trajectory.inputs[:, 0]
    found = segments(recipe, source, part)
    return [int(np.flatnonzero(inputs == one.trajectory.inputs[0, 0])[0]) for one in found]


def test_segments_score_every_sample_of_their_part_behind_the_first_lead(tmp_path: Path) -> None:
    recipe = recipe_of(write_record(tmp_path / "a.csv"))
    scored = 400 - LEAD
    for part, begin, end in (("train", 0, 2799), ("validation", 2799, 3399)):
        firsts = starts(recipe, part)
        covered = set().union(*(range(s + LEAD, s + LEAD + scored) for s in firsts))
        assert covered == set(range(max(begin, LEAD), end))


def test_each_part_has_blocks_that_are_spread_over_the_record(tmp_path: Path) -> None:
    path = write_record(tmp_path / "a.csv")
    recipe = recipe_of(path, blocks=3)
    source, sizes = source_of(recipe), {"train": 0.7, "validation": 0.15, "test": 0.15}
    split, count = divided(recipe, source), len(source.pieces[0].trajectory.inputs)
    for part, share in sizes.items():
        assert len(split[part]) == 3
        middles = [0.5 * (block.scored + block.stop) / count for block in split[part]]
        np.testing.assert_allclose(np.diff(middles), 1 / 3, atol=0.03)
        scored = sum(block.stop - block.scored for block in split[part])
        assert scored > share * count - 3 * LEAD - 2  # samples at cuts
    ends = [block.stop for block in split["test"]]
    begun = [block.start for block in split["train"][1:]]
    assert begun == ends[:2]  # what follows a tested block still answers its inputs


def test_blocks_are_as_many_as_the_window_leaves_room_for(tmp_path: Path) -> None:
    """The smallest part has 0.15 of 4000 samples, and the lead 160 of them."""
    path = write_record(tmp_path / "a.csv")
    text = RECIPE.replace('"bench.csv"', f'"{path}"')
    for n_in, n_out, blocks in ((240, 80, 3), (120, 40, 5), (700, 200, 1)):
        changed = text.replace("n_in = 240", f"n_in = {n_in}").replace(
            "n_out = 80", f"n_out = {n_out}"
        )
        lengths = {"data": {"duration": 8.0, "burn_in": 2.4}}
        recipe = parse_open_recipe(changed, "bench.toml").with_found(lengths, "bench.toml").guess
        assert [len(own) for own in divided(recipe, source_of(recipe)).values()] == [blocks] * 3


def test_segments_have_one_length_and_outputs_that_belong_to_their_inputs(tmp_path: Path) -> None:
    recipe = recipe_of(write_record(tmp_path / "a.csv"))
    source = source_of(recipe)
    whole = source.pieces[0].trajectory
    for segment, first in zip(
        segments(recipe, source, "train"), starts(recipe, "train"), strict=True
    ):
        assert segment.lead == LEAD
        np.testing.assert_array_equal(segment.trajectory.inputs, whole.inputs[first : first + 400])
        np.testing.assert_array_equal(
            segment.trajectory.outputs, whole.outputs[first : first + 401]
        )


def test_tested_block_is_led_in_by_a_window_and_was_not_learnt_from(tmp_path: Path) -> None:
    recipe = recipe_of(write_record(tmp_path / "a.csv"))
    source = source_of(recipe)
    [block] = unseen_blocks(recipe, source)
    assert block.lead == recipe.window.n_in
    scored = set(block.trajectory.outputs[block.lead + 1 :, 0].tolist())
    for part in ("train", "validation"):
        for segment in segments(recipe, source, part):
            assert scored.isdisjoint(segment.trajectory.outputs[:, 0].tolist())


def test_blocks_that_are_shorter_than_a_segment_are_left_out(tmp_path: Path) -> None:
    recipe = recipe_of(write_record(tmp_path / "a.csv"), duration=30.0)
    assert segments(recipe, source_of(recipe), "validation") == []


def test_blocks_that_are_left_out_are_remarked_with_their_samples(tmp_path: Path) -> None:
    path = write_record(tmp_path / "a.csv")
    assert left_out(recipe_of(path), source_of(recipe_of(path))) is None
    recipe = recipe_of(path, duration=10.0)
    remark = left_out(recipe, source_of(recipe))
    assert remark is not None
    assert "1 of 2 blocks of the records, with 600 samples to learn from" in remark


def test_part_that_is_too_short_is_refused_with_the_recipe(tmp_path: Path) -> None:
    recipe = recipe_of(write_record(tmp_path / "a.csv", 500))
    with refused(RecipeError, "75 samples to", "validation has"):
        divided(recipe, source_of(recipe))


def test_inputs_beyond_are_those_of_the_record_with_a_larger_amplitude(tmp_path: Path) -> None:
    recipe = recipe_of(write_record(tmp_path / "a.csv"))
    source = source_of(recipe)
    one, two = (inputs_beyond(recipe, source, 300, 5, factor) for factor in (1.0, 2.0))
    whole = source.pieces[0].trajectory.inputs
    mean = whole.mean(axis=0)
    np.testing.assert_allclose(two - mean, 2 * (one - mean))
    assert one.shape == (5, 300, 1)
    apart = np.abs(one.ravel()[:, None] - whole.ravel()).min(axis=1)
    assert apart.max() < ROUNDING
    assert abs(one[-1, -1, 0] - whole[-1, 0]) < ROUNDING  # to the end of the record
    assert len({row[0, 0] for row in one}) == 5


def test_inputs_run_to_and_fro_where_the_record_is_shorter_than_asked(tmp_path: Path) -> None:
    recipe = recipe_of(write_record(tmp_path / "a.csv"))
    found = inputs_beyond(recipe, source_of(recipe), 9000, 2, 1.0)
    jumps = np.abs(np.diff(found[0, :, 0])).max()
    assert found.shape == (2, 9000, 1)
    assert jumps <= np.abs(np.diff(found[0, :3900, 0])).max()


def made(recipe: Recipe, folder: Path, progress: Progress = silent) -> int:
    return generate(case_of(recipe), folder, None, progress)


def test_segments_are_cut_once_and_again_after_a_change_of_the_file(tmp_path: Path) -> None:
    path, folder = write_record(tmp_path / "a.csv"), tmp_path / "data"
    recipe = with_numbers(recipe_of(path), 11, 3)
    assert made(recipe, folder) == 14
    assert made(recipe, folder) == 0
    split = read_split(recipe, folder, "train")
    source = source_of(recipe)
    expected = np.stack([s.trajectory.outputs for s in segments(recipe, source, "train")])
    np.testing.assert_array_equal(split.outputs, expected)
    write_record(path, seed=3)
    assert made(recipe, folder) == 14
    assert not np.array_equal(read_split(recipe, folder, "train").outputs, expected)


def test_another_window_cuts_other_segments(tmp_path: Path) -> None:
    recipe = with_numbers(recipe_of(write_record(tmp_path / "a.csv")), 11, 3)
    assert made(recipe, tmp_path / "d") == 14
    window = recipe.window.model_copy(update={"n_in": recipe.window.n_in - 8})
    assert made(recipe.model_copy(update={"window": window}), tmp_path / "d") == 14


def test_estimator_takes_its_share_so_all_parts_are_cut_anew(tmp_path: Path) -> None:
    path = write_record(tmp_path / "a.csv")
    plain, with_estimator = recipe_of(path), recipe_of(path, more="[estimator]\n")
    assert starts(plain, "validation") != starts(with_estimator, "validation")
    one, other = (
        Trajectories(tmp_path, case_of(recipe), "model").key("validation", 0)
        for recipe in (plain, with_estimator)
    )
    assert one != other


def without_outputs(path: Path, rows: slice, count: int = 4000) -> Path:
    """Write a record in which the outputs of some rows are empty."""
    write_record(path, count, noise=0.01)
    header, *lines = path.read_text().splitlines()
    for index in range(count)[rows]:
        lines[index] = lines[index].rpartition(",")[0] + ","
    path.write_text("\n".join([header, *lines]) + "\n")
    return path


def test_outputs_that_are_missing_cut_what_is_scored_but_not_what_leads_in(tmp_path: Path) -> None:
    recipe = recipe_of(without_outputs(tmp_path / "a.csv", slice(100, None, 200)), duration=3.5)
    source = source_of(recipe)
    assert len(source.pieces) == 1
    assert longest_scored(recipe, source) == 99  # three in ten of the validation part are so few
    whole, parts = divided(recipe, source), ("train", "validation")
    for part in parts:
        found = segments(recipe, source, part)
        assert all(np.isfinite(one.trajectory.outputs[LEAD + 1 :]).all() for one in found)
        assert any(np.isnan(one.trajectory.outputs).any() for one in found)
        assert len(found) >= sum(b.stop - b.scored for b in whole[part]) // 200 - 1 > 0
    tested = unseen_blocks(recipe, source)
    assert all(np.isfinite(one.trajectory.outputs[one.lead + 1 :]).all() for one in tested)
    count = sum(len(one.trajectory.inputs) - one.lead for one in tested)
    assert count == whole["test"][0].stop - whole["test"][0].scored - 3


def test_outputs_that_are_missing_nearly_everywhere_are_refused_with_a_remedy(
    tmp_path: Path,
) -> None:
    recipe = recipe_of(without_outputs(tmp_path / "a.csv", slice(None, None, 2)))
    with refused(RecipeError, "1 samples in", "at most", "leave out the lines"):
        longest_scored(recipe, source_of(recipe))


def test_pieces_that_are_no_longer_than_the_lead_are_counted_in_the_remarks(
    tmp_path: Path,
) -> None:
    path = write_record(tmp_path / "a.csv")
    header, *lines = path.read_text().splitlines()
    path.write_text("\n".join([header, *lines[:101], *lines[151:201], *lines[211:]]) + "\n")
    recipe = recipe_of(path)
    [remark] = remarks_on_division(recipe, source_of(recipe))[:1]
    assert "2 of 3 pieces of the records, with 149 of 3937 samples" in remark
    assert f"no longer than the {LEAD} samples" in remark


@needs_app("compare")
def test_outputs_that_are_missing_are_refused_where_other_models_need_them(tmp_path: Path) -> None:
    from slide_fmu.apps.compare.compare import require_comparable

    recipe = recipe_of(without_outputs(tmp_path / "a.csv", slice(100, None, 400)), duration=3.5)
    with refused(RecipeError, "other kinds"):
        require_comparable(case_of(recipe))
    require_comparable(case_of(recipe_of(write_record(tmp_path / "b.csv"))))


def test_missing_outputs_are_refused_where_an_estimator_needs_them(
    tmp_path: Path,
) -> None:
    path = without_outputs(tmp_path / "c.csv", slice(100, None, 400), 12_000)
    text = RECIPE.replace('"bench.csv"', f'"{path}"') + "\n[estimator]\n"
    begun = parse_open_recipe(text, "bench.toml")
    lengths = {"data": {"duration": 3.5, "burn_in": 2.4}}
    estimated = begun.with_found(lengths, "bench.toml").guess
    with refused(RecipeError, "expected all of", "error estimator"):
        segments(estimated, source_of(estimated), "estimator")


def test_missing_outputs_of_records_are_kept(tmp_path: Path) -> None:
    recipe = recipe_of(without_outputs(tmp_path / "a.csv", slice(100, None, 200)), duration=3.5)
    recipe = with_numbers(recipe, 2, 1)
    made(recipe, tmp_path / "trajectories")
    outputs = read_split(recipe, tmp_path / "trajectories", "train").outputs
    assert 0 < np.isnan(outputs).sum() < 5
