"""Studies over seeds and numbers of trajectories."""

from __future__ import annotations

import argparse
from pathlib import Path

import pytest
from matplotlib.image import imread
from seed_study import draw_curve, studies

from slide_fmu.validation.task import IN_RANGE
from tests.libraries import build_libraries
from tests.progress import no_stages
from tests.recipes import TINY


def arguments(folder: Path, train: list[int] | None) -> argparse.Namespace:
    recipe = folder / "tiny.toml"
    recipe.write_text(TINY, encoding="utf-8")
    return argparse.Namespace(
        recipe=recipe, runs=folder / "runs", train=train, surrogate_only=True, seeds=2, seed=1,
        trajectories=2, workers=1,
    )  # fmt: skip


@pytest.mark.extended
def test_learning_curve_has_a_study_for_each_number_of_trajectories(tmp_path: Path) -> None:
    """One study for each number of trajectories, the smallest first, on the same data."""
    build_libraries()
    found = studies(arguments(tmp_path, [3, 2]), no_stages)
    fewer, more = found["studies"]
    assert [study["simulated_seconds"] for study in found["studies"]] == [4.0, 6.0]
    assert [study["trajectories"] for study in found["studies"]] == [2, 3]
    assert [seed["training_seed"] for seed in fewer["seeds"]] == [0, 1]
    summary = more["summary"][IN_RANGE]["position_relative_rmse"]
    errors = [seed[IN_RANGE]["outputs"][0]["relative_rmse"] for seed in more["seeds"]]
    assert summary["smallest"] == min(errors) < max(errors) == summary["largest"]
    alone = studies(arguments(tmp_path, [3]), no_stages)["studies"]
    assert alone[0]["summary"] == more["summary"]
    draw_curve(found, tmp_path / "curve.png")
    assert imread(tmp_path / "curve.png").std() > 0.05
