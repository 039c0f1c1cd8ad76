"""An error bound of records is calibrated by held-out blocks, and refused where they are few."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import slide_fmu as slide
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.open_recipe import OpenRecipe
from slide_fmu.recipe.reading import parse_open_recipe
from slide_fmu.recipe.recipe import RecipeError
from slide_fmu.records.answers import numbers_of_segments
from slide_fmu.records.model import MeasuredRecords
from slide_fmu.records.parts import divided
from slide_fmu.records.remarks import about_bound
from slide_fmu.records.segments import segments, unseen_blocks
from slide_fmu.records.sizing import lengths_of_records
from tests.acceptance.conftest import invoke
from tests.libraries import build_libraries
from tests.own_records import RECIPE, STEP, force_and_travel, write_record
from tests.refusals import refused

NOISE = 0.02
SHORT = RECIPE.replace("n_in = 240", "n_in = 90").replace("n_out = 80", "n_out = 30")


def with_lengths(path: Path, text: str = SHORT) -> tuple[OpenRecipe, MeasuredRecords]:
    """The recipe with a bound, whose numbers are open, and its records."""
    read = parse_open_recipe(text.replace('"bench.csv"', f'"{path}"') + "[bound]\n", "bench.toml")
    source = case_of(read.guess).source
    assert isinstance(source, MeasuredRecords)
    return lengths_of_records(read, source).recipe, source


def test_blocks_of_the_bound_are_held_out_and_long_enough(tmp_path: Path) -> None:
    recipe, source = with_lengths(write_record(tmp_path / "a.csv", 14_000))
    guess = recipe.guess
    assert guess.bound is not None
    found = numbers_of_segments(source, case_of(guess), recipe.open_keys, None)  # type: ignore[arg-type]
    assert found["data"]["calibration"] >= 20
    assert guess.data.duration / guess.window.step >= guess.bound.samples(guess.window)
    parts = divided(guess, source)
    scored = [
        {(block.piece, k) for block in blocks for k in range(block.scored, block.stop)}
        for blocks in parts.values()
    ]
    assert len(set().union(*scored)) == sum(map(len, scored))
    remark = about_bound(guess, source)
    assert remark is not None
    assert f"by {found['data']['calibration']} held-out blocks" in remark
    assert "allow a confidence of 95 % at most" in remark
    filling = guess.bound.filling(guess.window)
    assert all(block.lead == filling for block in unseen_blocks(guess, source))


def test_few_blocks_are_refused_with_what_they_allow(tmp_path: Path) -> None:
    recipe, source = with_lengths(write_record(tmp_path / "a.csv", 4000))
    blocks = len(segments(recipe.guess, source, "calibration"))
    assert 0 < blocks < 20
    words = f"{blocks} held-out blocks", f"{100 * blocks / (blocks + 1):.3g} % at most", "for 95 %"
    with refused(RecipeError, *words, "record more"):
        numbers_of_segments(source, case_of(recipe.guess), recipe.open_keys, None)  # type: ignore[arg-type]


@pytest.mark.extended
def test_bound_covers_the_half_of_a_record_that_nobody_gave(tmp_path: Path) -> None:
    build_libraries()
    half = 24_000
    force, travel = force_and_travel(2 * half)
    measured = travel + NOISE * travel.std() * np.random.default_rng(7).normal(size=2 * half)
    table = np.stack([STEP * np.arange(half), force[:half], measured[:half]], axis=1)
    header = "time [s],force [N],travel [m]"
    np.savetxt(tmp_path / "bench.csv", table, "%.9g", ",", header=header, comments="")
    quick = "starts = 2\nexpert.start_iterations = 10\nexpert.kept = 1\n"
    (tmp_path / "bench.toml").write_text(f"{RECIPE}{quick}[bound]\n")
    done = invoke("run", tmp_path / "bench.toml", "--runs", tmp_path / "runs", "--json", "-")
    assert done.exit_code == 0, done.output
    card = (tmp_path / "runs/bench/card.md").read_text(encoding="utf-8")
    assert "held-out blocks" in card
    surrogate = slide.load(tmp_path / "runs/bench/bench.fmu")
    unseen = force[half + 1 :, None]
    error = np.abs(surrogate.predict_newest(unseen)[:, 0] - measured[half + 1 :])
    covered = error <= surrogate.trust(unseen).bounds(0.95)[:, 0]
    assert 0.93 < covered[1000:].mean() < 0.985
    report = json.loads((tmp_path / "runs/bench/report.json").read_text(encoding="utf-8"))
    [row] = [r for r in report["rows"] if r["call"] == "known" and r["inputs"] == "bench.csv"]
    assert 0.92 < row["outputs"][0]["covered"] < 0.99
