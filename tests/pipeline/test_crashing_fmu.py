"""An FMU whose library crashes ends the program that simulates it, and no other: it is named."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from slide_fmu.cli.app import app
from slide_fmu.data.draws import probe_draws
from slide_fmu.data.generation import generate
from slide_fmu.data.pool import process_pool
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.reading import parse_open_recipe
from slide_fmu.systems.errors import SimulationError
from tests.own_models.quarter_car import build_in_c
from tests.progress import silent
from tests.recipes import FMU_RECIPE

SLOW = FMU_RECIPE.replace(
    'kind = "held_random"', 'kind = "held_random"\nsamples = [200, 200]'
).replace("duration = 0.5", "seed = SEED\nduration = 0.5")
"""The inputs of a short motion have one value or two."""
HIGH = 0.02
"""With a fitting seed, the motion on which a recipe is checked is lower, in m, and others are not.
"""
ENDED = "ended the process that simulated it: its library crashed"


@pytest.fixture(scope="module")
def trap(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build_in_c(tmp_path_factory.mktemp("fmus") / "trap.fmu", co_simulation=True, traps=True)


def recipe_text(trap: Path, crash_above: float, text: str = SLOW) -> str:
    parameters = f"parameters = {{ crash_above = {crash_above} }}\n\n[system.inputs"
    text = text.replace("MODEL", str(trap)).replace("[system.inputs", parameters, 1)
    return next(
        found
        for found in (text.replace("SEED", str(seed)) for seed in range(100))
        if highest_of_probe(found) < HIGH
    )


def highest_of_probe(text: str) -> float:
    """Give the highest road, in m, of the short motion on which every recipe is checked."""
    recipe = parse_open_recipe(text, "recipe").guess
    drawn = next(probe_draws(recipe, case_of(recipe).system))
    return float(np.max(np.abs(drawn.inputs)))


def invoke(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def assert_named(done: Result, model: str) -> None:
    assert done.exit_code == 1
    assert done.output.count("error: ") == 1
    assert model in done.output
    assert ENDED in done.output
    assert "Traceback" not in done.output


def test_init_names_an_fmu_that_crashes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    built = build_in_c(tmp_path / "bomb.fmu", co_simulation=True, traps=True, crash_above=0.03)
    done = invoke("init", built, "--input", "road=-0.05..0.05")
    assert_named(done, "bomb.fmu")


@pytest.mark.extended
@pytest.mark.parametrize("command", ["try", "window", "generate"])
def test_crash_at_once_is_named(command: str, trap: Path, tmp_path: Path) -> None:
    recipe = tmp_path / "recipe.toml"
    recipe.write_text(recipe_text(trap, 1e-4))
    assert_named(invoke(command, recipe, "--runs", tmp_path), "trap.fmu")


@pytest.mark.extended
@pytest.mark.parametrize("command", ["try", "window"])
@pytest.mark.parametrize("open_window", [False, True], ids=["given", "open"])
def test_crash_while_the_window_is_sized_is_named(
    command: str, open_window: bool, trap: Path, tmp_path: Path
) -> None:
    text = (
        SLOW.replace("n_in = 16\nn_out = 8\n", "").replace("duration = 0.5\nburn_in = 0.1\n", "")
        if open_window
        else SLOW
    )
    recipe = tmp_path / "recipe.toml"
    recipe.write_text(recipe_text(trap, HIGH, text))
    assert_named(invoke(command, recipe, "--runs", tmp_path), "trap.fmu")


@pytest.mark.extended
def test_crash_in_a_worker_that_makes_data_is_named(trap: Path, tmp_path: Path) -> None:
    recipe = parse_open_recipe(recipe_text(trap, HIGH), "recipe").guess
    with (
        process_pool(1) as pool,
        pytest.raises(SimulationError, match=rf"trap\.fmu' \(kind 'fmu'\) {ENDED}"),
    ):
        generate(case_of(recipe), tmp_path / "trajectories", pool, silent)
