"""A reference system runs at a finer step than the samples of its recipe."""

from __future__ import annotations

import tomllib
from pathlib import Path

import fmpy
import numpy as np
import pytest

from slide_fmu.recipe.case import case_of
from slide_fmu.systems.base import System
from slide_fmu.systems.errors import LoadError
from slide_fmu.systems.simulation import simulate
from tests.own_models.quarter_car import build_in_c
from tests.recipes import TINY, merged, tiny_recipe, whole_recipe
from tests.refusals import refused


def test_a_finer_reference_moves_alike_under_the_same_held_input() -> None:
    recipe = tiny_recipe()
    case = case_of(recipe)
    times, coarse, fine = case.finer_steps, case.reference, case.reference_as_it_runs()
    assert (times, fine.step) == (8, recipe.window.step / 8)
    held = np.random.default_rng(1).uniform(-1, 1, (40, len(coarse.inputs)))
    wanted = simulate(coarse, held).outputs
    found = simulate(fine, np.repeat(held, times, axis=0)).outputs[::times]
    assert np.abs(found - wanted).max() < 1e-3 * np.abs(wanted).max()


@pytest.mark.parametrize(("own", "times"), [(0.005, 3), (0.5, 1)])
def test_a_model_that_names_its_step_goes_on_by_that(
    own: float, times: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(System, "own_step", own)
    assert case_of(tiny_recipe()).finer_steps == times


def test_a_class_with_a_step_of_its_own_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    recipe = tiny_recipe()
    case = case_of(recipe)
    coarse = case.reference
    monkeypatch.setattr("slide_fmu.recipe.case.load_system", lambda _: coarse)
    with refused(LoadError, "expected 0.00195312 s", "of window.step"):
        case.reference_as_it_runs()


@pytest.mark.parametrize("hold", ["zero_order", "first_order"])
def test_an_fmu_runs_at_its_own_step_as_fmpy_runs_it(tmp_path: Path, hold: str) -> None:
    """Its input is held over its own step, whatever the hold is between samples."""
    path = build_in_c(tmp_path / "car.fmu", co_simulation=True)
    system = {
        "model": str(path),
        "kind": "fmu",
        "inputs": {"road": {"range": [-0.1, 0.1], "hold": hold}},
        "outputs": {"suspension_travel": {"range": [-0.2, 0.2]}},
    }
    tables = merged(tomllib.loads(TINY), {"window": {"step": 0.02}})
    recipe = whole_recipe({**tables, "system": system})
    assert case_of(recipe).finer_steps == 4
    fine = case_of(recipe).reference_as_it_runs()
    times = 0.005 * np.arange(201)
    road = 0.02 * np.sin(9 * times)
    table = np.array([*zip(times, road, strict=True)], dtype=[("time", float), ("road", float)])
    wanted = fmpy.simulate_fmu(
        str(path), stop_time=1.0, output_interval=0.005, input=table, output=["suspension_travel"],
        fmi_type="CoSimulation",
    )["suspension_travel"]  # fmt: skip
    column = [signal.name for signal in fine.outputs].index("suspension_travel")
    found = simulate(fine, road[:-1, None]).outputs[:, column]
    assert np.abs(found - wanted).max() < 1e-9 * np.abs(wanted).max()
