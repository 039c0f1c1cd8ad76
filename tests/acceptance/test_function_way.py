"""The whole way from a file of functions: recipe to FMU, with the models of the tutorials."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from slide_fmu.cosim.whole_run import run_fmu
from slide_fmu.importer.file import unpacked
from slide_fmu.systems.base import Stepping
from slide_fmu.systems.loading import load_system
from tests.acceptance.conftest import invoke
from tests.marks import needs_app
from tests.systems.function_models import specifications as models

SHORT = """
[training]
expert.part = 1
starts = 2
expert.start_iterations = 10
expert.kept = 1
expert.kept_iterations = 20
iterations = 40

[validation]
trajectories = 4
"""
"""A training of seconds."""


def recipe_of(folder: Path, model: str, window: str, tables: str) -> Path:
    """The recipe of a tutorial with a window and tables of its own, beside a copy of the model."""
    for suffix in (".py", ".toml"):
        path = (models.TUTORIALS / model).with_suffix(suffix)
        (folder / path.name).write_text(path.read_text(encoding="utf-8"), encoding="utf-8")
    recipe = folder / f"{model}.toml"
    text = recipe.read_text(encoding="utf-8")
    recipe.write_text(f"{text}{window}{tables}{SHORT}", encoding="utf-8")
    return recipe


def errors_of_a_run(recipe: Path) -> dict[str, float]:
    """RMSE over the standard deviation of every output, as ``run`` measures it."""
    runs = recipe.parent / "runs"
    result = invoke("run", recipe, "--runs", runs, "--workers", 1, "--json", "-")
    assert result.exit_code == 0, result.output
    outputs = json.loads(result.stdout)["validation"]["in range"]["outputs"]
    return {output["name"]: output["relative_rmse"] for output in outputs}


@pytest.mark.extended
def test_system_of_first_order_is_learnt_from_its_equations(tmp_path: Path) -> None:
    tables = """
[data]
duration = 6000.0
burn_in = 2000.0
train = 6
validation = 2

[network]
order = 3
hidden = 4
"""
    recipe = recipe_of(tmp_path, "thermal_masses_function", "n_in = 240\nn_out = 80\n", tables)
    errors = errors_of_a_run(recipe)
    assert set(errors) == {"left", "middle", "right"}
    assert max(errors.values()) < 0.1  # six trajectories, also held at the ends of the ranges


@needs_app("reference")
def test_functions_run_as_reference_fmu_beside_the_surrogate(tmp_path: Path) -> None:
    recipe = recipe_of(
        tmp_path,
        "quarter_car_function",
        "n_in = 640\nn_out = 128\n",
        "\n[data]\nduration = 12.0\nburn_in = 5.0\ntrain = 2\nvalidation = 1\n",
    )
    fmu = tmp_path / "reference.fmu"
    result = invoke("reference", recipe, "-o", fmu)
    assert result.exit_code == 0, result.output
    system = load_system(models.quarter_car())
    assert isinstance(system, Stepping)
    names = [signal.name for signal in system.outputs]
    road = np.array([0.0, 0.01, 0.02, -0.01, 0.0])
    with unpacked(fmu) as files:
        run = run_fmu(files, {"road": road}, names, step=0.01)
    expected = system.simulate(road[:, None])
    assert run.values == pytest.approx(expected, abs=1e-12)
