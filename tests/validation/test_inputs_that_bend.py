"""An FMU beside a model that is given inputs as they bend between samples."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from slide_fmu.core.window import Window
from slide_fmu.fmu.export import export_fmu
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.validation import validate as measuring
from slide_fmu.validation.results import Validation
from slide_fmu.validation.task import Task
from slide_fmu.validation.validate import validate
from tests.fmu.moving_inputs import forecasting
from tests.fmu.samples import sum_surrogate
from tests.libraries import build_libraries
from tests.progress import silent
from tests.recipes import recipe_of_model

STEP, WALL = 0.1, 2e-3
"""A sample step in s, and what every step of the model takes, whether it is a part of that or not.
"""
MODEL = f"""
import time

import numpy as np

from slide_fmu.core.signals import Signal
from slide_fmu.systems.base import System

class Slow(System):
    inputs = (Signal("force", "N", -1.0, 1.0, hold="first_order"),)
    outputs = (Signal("position", "m", -1.0, 1.0),)

    def __init__(self, step):
        self.step = step

    def simulate(self, inputs):
        time.sleep({WALL} * len(inputs))
        return np.concatenate([inputs[:1], inputs])
"""
SINE = {"kind": "harmonic", "weight": 1.0, "angular_frequency": (5.0, 6.0)}
STAIRS = {"kind": "held_random", "weight": 1.0}


def measured(folder: Path, kinds: list[dict[str, Any]], trajectories: int) -> Validation:
    recipe = slow_recipe(folder, kinds)
    system = case_of(recipe).system
    surrogate = forecasting(
        replace(
            sum_surrogate(4, "first_order"),
            name="tiny",
            window=Window(STEP, 4, 1),
            inputs=system.inputs,
            outputs=system.outputs,
        ),
        True,
    )
    build_libraries()
    fmu = export_fmu(surrogate, folder / "tiny.fmu")
    return validate(fmu, surrogate, case_of(recipe), Task(3, trajectories), silent)


def slow_recipe(folder: Path, kinds: list[dict[str, Any]]) -> Recipe:
    (folder / "slow.py").write_text(MODEL)
    return recipe_of_model(
        folder / "slow.py",
        system={"model": f"{folder / 'slow.py'}:Slow", "kind": "class"},
        window={"step": STEP, "n_in": 8, "n_out": 4},
        data={"burn_in": 0.0, "duration": 4.0, "substeps": 4, "excitation": kinds},
    )


def test_model_under_inputs_that_bend_is_timed_by_whole_steps(tmp_path: Path) -> None:
    """It goes by four parts of a step, which are no steps that its user would wait for."""
    timing = measured(tmp_path, [SINE], 2).figures().timing
    assert 1e6 * WALL <= timing.reference_step_us < 2e6 * WALL


@pytest.mark.extended
def test_straight_inputs_beside_those_that_bend_tell_the_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Then nothing is simulated for that alone."""
    drawn: list[int] = []
    once = measuring.first_that_runs

    def counted(*arguments: Any) -> Any:
        drawn.append(arguments[3])
        return once(*arguments)

    monkeypatch.setattr(measuring, "first_that_runs", counted)
    found = measured(tmp_path, [SINE, STAIRS], 6)
    assert {c.kind for c in found.comparisons} == {0, 1}
    assert drawn == [0, 1, 2, 3, 4, 5]
    for comparison in found.comparisons:
        assert len(comparison.step_seconds[1]) == (0 if comparison.kind == 0 else 40)
    assert 1e6 * WALL <= found.figures().timing.reference_step_us < 2e6 * WALL
