"""A user's model of exudyn goes the whole way, from its file to an FMU with a measured error."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.acceptance.conftest import run_recipe

TUTORIALS = Path(__file__).parents[2] / "docs" / "tutorials"

SHORT = """
n_in = 800
n_out = 80

[data]
duration = 12.0
burn_in = 7.0
train = 8
validation = 3

[network]
order = 4
hidden = 12

[training]
part = 2
starts = 2
start_iterations = 10
kept = 1
kept_iterations = 10
iterations = 50

[validation]
duration = 12.0
"""
"""What the recipe of the tutorial leaves open: enough for a first surrogate."""


@pytest.mark.extended
def test_quarter_car_of_exudyn_becomes_an_fmu(tmp_path: Path) -> None:
    shutil.copy(TUTORIALS / "quarter_car_exudyn.py", tmp_path)
    recipe = (TUTORIALS / "quarter_car_exudyn.toml").read_text(encoding="utf-8")
    finished = run_recipe(tmp_path, "quarter_car", recipe.rstrip() + SHORT)
    measured = finished.figures["validation"]["in range"]
    errors = [output["relative_rmse"] for output in measured["outputs"]]
    assert len(errors) == 3
    assert max(errors) < 0.08  # three to four times what the same short fit reaches elsewhere
