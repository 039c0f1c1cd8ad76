"""Inputs that move jump for the model too, at any time of a step, where a recipe asks for it."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from slide_fmu.core.signals import FloatArray, Hold
from slide_fmu.data.draws import (
    TEST,
    Draw,
    Stream,
    draw,
    drawn_outputs,
    shortened,
    split_stream,
)
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import Recipe, RecipeError
from slide_fmu.systems.base import Finer, System
from slide_fmu.systems.declared import SignalTable
from slide_fmu.systems.loading import load_system
from slide_fmu.systems.simulation import simulate, simulate_jumping
from slide_fmu.systems.specification import Specification
from tests.own_models.quarter_car import build_in_c
from tests.recipes import whole_recipe
from tests.refusals import refused
from tests.systems.exudyn_models import OSCILLATOR, specification
from tests.systems.exudyn_models import model as model_of_exudyn

STEP, DURATION = 0.1, 20.0
DYNAMICS = """
def rates(x, force, push):
    return [x[1], force + 0.5 * push - 9.0 * x[0] - 0.8 * x[1]]
"""
SIGNALS = """
inputs = {"force": {"unit": "N", "range": [-1.0, 1.0]}, "push": {"unit": "N", "range": [0.0, 1.0]}}
outputs = {"position": {"unit": "m", "range": [-1.0, 1.0]}}
hold = "first_order"
"""
FUNCTION = f"""{SIGNALS}{DYNAMICS}
start = [0.0, 0.0]
f = lambda x, u, p: rates(x, u[0], u[1])
g = lambda x, u, p: [x[0]]
"""
WHOLE = f"""{SIGNALS}{DYNAMICS}
import numpy as np
from scipy.integrate import solve_ivp

def simulate(t, u, p):
    def f(time, x):
        return rates(x, *(np.interp(time, t, column) for column in u.T))

    start = [(u[0, 0] + 0.5 * u[0, 1]) / 9.0, 0.0]
    return solve_ivp(f, (t[0], t[-1]), start, t_eval=t, rtol=1e-7, max_step=0.05).y[:1].T
"""
JUMPS = {"kind": "steps", "weight": 1.0, "duration": (0.5, 2.0)}


def recipe(model: Path, kind: dict[str, Any] = JUMPS, **data: Any) -> Recipe:
    made = {"duration": DURATION, "burn_in": 1.0, "train": 2, "validation": 2, "substeps": 4}
    return whole_recipe(
        {
            "name": "mass",
            "description": "A mass on a spring.",
            "system": {"model": str(model), "kind": "function"},
            "window": {"step": STEP, "n_in": 20, "n_out": 10},
            "data": {**made, "excitation": [kind], **data},
        }
    )


@pytest.fixture
def model(tmp_path: Path) -> Path:
    path = tmp_path / "mass.py"
    path.write_text(FUNCTION)
    return path


def drawn(made: Recipe, index: int = 0) -> Draw:
    return draw(made, case_of(made).system, Stream(TEST, 7, (1.0, 1.0), DURATION), index)


def true_positions(one: Draw) -> FloatArray:
    """Integrate the mass by scipy from jump to jump, from its rest under the first inputs."""
    assert one.jumps is not None
    last = one.inputs[0]
    x = np.array([(last[0] + 0.5 * last[1]) / 9.0, 0.0])
    positions = [x[0]]
    for row, at in zip(one.inputs, one.jumps, strict=True):
        assert np.array_equal(np.isnan(at), row == last)  # constant but for jumps
        times = [0.0, *np.sort(at[~np.isnan(at)]), 1.0]
        for begin, end in itertools.pairwise(times):
            held = np.where(at <= begin, row, last)

            def rates(_: float, x: FloatArray, u: FloatArray = held) -> list[float]:
                return [x[1], u[0] + 0.5 * u[1] - 9.0 * x[0] - 0.8 * x[1]]

            x = solve_ivp(rates, (0, STEP * (end - begin)), x, rtol=1e-9, atol=1e-12).y[:, -1]
        positions.append(x[0])
        last = row
    return np.array(positions)[:, None]


def relative(outputs: FloatArray, true: FloatArray) -> float:
    return float(np.std(outputs - true) / np.std(true))


@pytest.mark.parametrize(("text", "tolerance"), [(FUNCTION, 1e-5), (WHOLE, 0.02)])
def test_model_sees_jumps_at_their_times_within_a_step(
    model: Path, text: str, tolerance: float
) -> None:
    """A ramp over the step is late or early by up to half of one: ten times that error."""
    one = drawn(recipe(model, jumps=True))
    true = true_positions(one)
    model.write_text(text)
    system = case_of(recipe(model, jumps=True)).system
    assert relative(drawn_outputs(system, one), true) < tolerance
    assert relative(drawn_outputs(system, shortened(one, None)), true) > 0.03


def test_jumps_are_drawn_at_samples_or_at_any_time_of_a_step(model: Path) -> None:
    made = recipe(model, jumps=True)
    times = np.concatenate([drawn(made, index).jumps for index in range(20)])  # type: ignore[misc]
    jumping = times[~np.isnan(times)]
    assert len(jumping) > 300
    at_samples = jumping == 1.0
    assert 0.25 < at_samples.mean() < 0.75  # in half of the motions
    counts = np.histogram(jumping[~at_samples], 4, (0.0, 1.0))[0]
    assert counts.min() > 0.6 * np.sum(~at_samples) / 4


def test_recipe_without_jumps_draws_the_same_samples(model: Path) -> None:
    with_jumps, without = drawn(recipe(model, jumps=True)), drawn(recipe(model))
    np.testing.assert_array_equal(with_jumps.inputs, without.inputs)
    assert without.jumps is None
    assert with_jumps.jumps is not None


@pytest.mark.parametrize(
    ("split", "jumping"),
    [
        ("train", False),
        ("validation", False),
        ("companion", False),
        ("bound", True),
        ("calibration", True),
    ],
)
def test_jumps_are_straight_lines_where_networks_learn(
    model: Path, split: str, jumping: bool
) -> None:
    """The time of a jump would be noise to them; a bound must know what it costs."""
    made = recipe(model, jumps=True)
    one = draw(made, case_of(made).system, split_stream(made, split, 0), 0)
    assert (one.jumps is not None) is jumping


def test_sines_do_not_jump(model: Path) -> None:
    sine = {"kind": "harmonic", "weight": 1.0, "angular_frequency": (5.0, 6.0)}
    assert drawn(recipe(model, sine, jumps=True)).jumps is None


def test_inputs_that_are_held_do_not_jump_within_a_step(model: Path) -> None:
    model.write_text(FUNCTION.replace("first_order", "zero_order"))
    assert drawn(recipe(model, jumps=True)).jumps is None


def test_motions_jump_where_they_stop_and_go_on_alone(model: Path) -> None:
    kind = {
        "kind": "stops", "weight": 1.0, "duration": (0.5, 2.0), "angular_frequency": (1.0, 3.0)
    }  # fmt: skip
    one = drawn(recipe(model, kind, jumps=True))
    assert one.jumps is not None
    jumped = ~np.isnan(one.jumps[:, 0])
    moved = np.diff(one.inputs[:, 0], prepend=one.inputs[0, 0]) != 0
    assert 5 < jumped.sum() < 0.3 * moved.sum()
    assert not (jumped & ~moved).any()


def test_model_that_follows_rates_cannot_jump(model: Path) -> None:
    model.write_text(FUNCTION.replace("u, p: [x[0]]", "u, p, du: [du[0]]"))
    with refused(RecipeError, "data.jumps = true", "follows the rates"):
        _ = case_of(recipe(model, jumps=True)).system


def test_model_without_parts_of_a_step_cannot_jump(model: Path) -> None:
    model.write_text(WHOLE)
    with refused(RecipeError, "data.substeps = 1", "set data.substeps = 4"):
        _ = case_of(recipe(model, jumps=True, substeps=1)).system


def test_system_that_was_not_made_for_jumps_is_refused(model: Path) -> None:
    model.write_text(WHOLE)
    plain = case_of(recipe(model, substeps=1)).system
    model.write_text(FUNCTION)
    one = drawn(recipe(model, jumps=True))
    with refused(ValueError, "jump within a sample step", "not made for them"):
        drawn_outputs(plain, one)


def compare_with_finer_held_inputs(system: System, held: System, tolerance: float) -> None:
    """Jumps at quarters of a step are those of the same model that holds its inputs over them."""
    rng = np.random.default_rng(3)
    inputs = np.repeat(rng.uniform(-0.1, 0.1, (12, 1)), 8, axis=0)
    before = np.concatenate([inputs[:1], inputs[:-1]])
    jumps = np.where(inputs != before, rng.integers(0, 4, inputs.shape) / 4, np.nan)
    late = np.arange(4) / 4 < jumps  # of a part of each step, (N, 4)
    true = simulate(held, np.where(late, before, inputs).reshape(-1, 1)).outputs[::4]
    outputs = simulate_jumping(system, inputs, jumps)
    assert relative(outputs[:, :1], true[:, :1]) < tolerance
    straight = simulate(system, inputs).outputs
    assert relative(straight[:, :1], true[:, :1]) > 10 * tolerance


def test_exudyn_model_sees_jumps_between_samples(tmp_path: Path) -> None:
    made = specification(model_of_exudyn(tmp_path, OSCILLATOR), "first_order")
    system = load_system(replace(made, step=0.08))
    system.finer = Finer(4, lambda: load_system(replace(made, step=0.02, part_of=4)))
    inputs = {name: table.model_copy(update={"hold": "zero_order"})
              for name, table in made.inputs.items()}  # fmt: skip
    held = load_system(replace(made, step=0.02, inputs=inputs))
    compare_with_finer_held_inputs(system, held, 1e-3)


@pytest.mark.parametrize("interface", ["co_simulation", "model_exchange"])
def test_fmu_sees_jumps_between_samples(tmp_path: Path, interface: str) -> None:
    car = str(build_in_c(tmp_path / "car.fmu", co_simulation=True))
    outputs = {"suspension_travel": SignalTable(range=(-1.0, 1.0))}

    def made(step: float, hold: Hold) -> System:
        inputs = {"road": SignalTable(unit="m", range=(-0.1, 0.1), hold=hold)}
        parameters = {"fmu-interface": interface}
        return load_system(Specification(car, parameters, step, "fmu", inputs, outputs))

    system = made(0.04, "first_order")
    system.finer = Finer(4, lambda: made(0.01, "first_order"))
    # a second run begins with an instance that was reset
    for _ in range(2):
        compare_with_finer_held_inputs(system, made(0.01, "zero_order"), 2e-3)
