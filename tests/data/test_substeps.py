"""Inputs that bend between samples do so for the model too, where a recipe asks for it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from slide_fmu.core.signals import FloatArray
from slide_fmu.data.draws import TEST, Draw, Stream, draw, drawn_outputs, simulate_draw
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.systems.errors import LoadError
from tests.recipes import whole_recipe
from tests.refusals import refused

STEP, DURATION = 0.1, 40.0
MODEL = """
inputs = {"force": {"unit": "N", "range": [-1.0, 1.0]}}
outputs = {"position": {"unit": "m", "range": [-1.0, 1.0]}}
hold = "first_order"
start = [0.0, 0.0]

def f(x, u, p):
    return [x[1], u[0] - 9.0 * x[0] - 0.8 * x[1]]

def g(x, u, p):
    return [x[0]]
"""
SINE = {"kind": "harmonic", "weight": 1.0, "angular_frequency": (5.0, 6.0)}
STAIRS = {"kind": "held_random", "weight": 1.0}


@pytest.fixture
def model(tmp_path: Path) -> str:
    path = tmp_path / "mass.py"
    path.write_text(MODEL)
    return str(path)


def recipe(model: str, kind: dict[str, Any], substeps: int) -> Recipe:
    data = {"duration": DURATION, "burn_in": 1.0, "train": 2, "validation": 2}
    return whole_recipe(
        {
            "name": "mass",
            "description": "A mass on a spring.",
            "system": {"kind": "function", "model": model},
            "window": {"step": STEP, "n_in": 20, "n_out": 10},
            "data": {**data, "substeps": substeps, "excitation": [kind]},
        }
    )


def drawn(made: Recipe) -> Draw:
    return draw(made, case_of(made).system, Stream(TEST, 7, (1.0, 1.0), DURATION), 0)


def true_positions(model: str) -> FloatArray:
    """Integrate the mass by scipy under the sine itself, from its rest."""
    one = drawn(recipe(model, SINE, 8))
    assert one.between is not None
    start = [one.between[0, 0] / 9.0, 0.0]  # at rest under the first input
    time = STEP / 8 * np.arange(len(one.between) + 1)
    force = np.append(one.between[:1, 0], one.between[:, 0])
    solution = solve_ivp(
        lambda t, x: [x[1], np.interp(t, time, force) - 9.0 * x[0] - 0.8 * x[1]],
        (0.0, time[-1]), start, t_eval=time[::8], rtol=1e-8, atol=1e-10,
        max_step=STEP / 8,
    )  # fmt: skip
    return np.asarray(solution.y[:1].T)


@pytest.mark.extended
def test_finer_steps_show_the_model_how_sines_bend(model: str) -> None:
    """Chords through a sine lower it by (omega h)^2 / 12, 2.5 %; of a fourth, by a sixteenth."""
    errors = {}
    for substeps in (1, 4):
        made, true = recipe(model, SINE, substeps), true_positions(model)
        outputs = drawn_outputs(case_of(made).system, drawn(made))
        settled = slice(len(outputs) // 2, None)
        errors[substeps] = np.std((outputs - true)[settled]) / np.std(true[settled])
    assert errors[1] > 0.015
    assert errors[4] < errors[1] / 10


def test_samples_are_the_last_of_their_parts(model: str) -> None:
    one = drawn(recipe(model, SINE, 4))
    assert one.between is not None
    np.testing.assert_array_equal(one.between[3::4], one.inputs)
    made = recipe(model, SINE, 4)
    trajectory = simulate_draw(case_of(made).system, one)
    assert len(trajectory.outputs) == len(trajectory.inputs) + 1 == DURATION / STEP + 1


def test_inputs_known_at_samples_alone_go_straight_between_them(model: str) -> None:
    finer, plain = (drawn(recipe(model, STAIRS, n)) for n in (4, 1))
    assert finer.between is None
    np.testing.assert_array_equal(finer.inputs, plain.inputs)


def test_inputs_that_are_held_do_not_bend(model: str) -> None:
    Path(model).write_text(MODEL.replace("first_order", "zero_order"))
    assert drawn(recipe(model, SINE, 4)).between is None


OWN_STEP = """
import numpy as np
from slide_fmu.core.signals import Signal
from slide_fmu.systems.base import System

class Mass(System):
    def __init__(self, step):
        self.step = 0.1

    inputs = (Signal("force", "N", -1.0, 1.0, hold="first_order"),)
    outputs = (Signal("position", "m", -1.0, 1.0),)

    def simulate(self, inputs):
        return np.zeros((len(inputs) + 1, 1))
"""


def of_a_class(made: Recipe) -> Recipe:
    system = made.system.model_copy(update={"kind": "class", "model": f"{made.system.model}:Mass"})
    return made.model_copy(update={"system": system})


def test_system_that_was_not_made_for_parts_is_refused(model: str) -> None:
    Path(model).write_text(OWN_STEP)
    finer, plain = (of_a_class(recipe(model, SINE, n)) for n in (4, 1))
    with refused(ValueError, "4 parts of", "system that"):
        drawn_outputs(case_of(plain).system, drawn(finer))


def test_class_with_a_step_of_its_own_is_refused(model: str) -> None:
    Path(model).write_text(OWN_STEP)
    system = case_of(of_a_class(recipe(model, SINE, 4))).system
    assert system.finer is not None
    with refused(LoadError, "0.1 s; expected 0.025 s", "or set data.substeps = 1"):
        _ = system.finer.system


RATES = """
inputs = {"base": {"unit": "m", "range": [-1.0, 1.0]}}
outputs = {"force": {"unit": "N", "range": [-9.0, 9.0]}}
hold = "first_order"
start = [0.0]

def f(x, u, p, du):
    return [du[0] - x[0]]

def g(x, u, p, du):
    return [du[0]]
"""


def test_rates_of_inputs_that_bend_are_those_of_the_moment(model: str) -> None:
    """A straight line through the step would give the rate in its middle."""
    Path(model).write_text(RATES)
    one = drawn(recipe(model, SINE, 8))
    assert one.between is not None
    outputs = drawn_outputs(case_of(recipe(model, SINE, 8)).system, one)[
        2:-1, 0
    ]  # the first step begins at rest
    # central differences about the samples, an eighth of a step to both sides
    true = (one.between[16::8, 0] - one.between[14:-2:8, 0]) / (2 * STEP / 8)
    np.testing.assert_allclose(outputs, true, atol=1e-2 * np.abs(true).max())
