"""What is said about the sample step of a recipe."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from slide_fmu.memory.step_remark import after_jumps, between_samples, step_remark
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.reading import load_recipe
from tests.memory.test_lengths import of_lag
from tests.memory.test_sizing import DUFFING
from tests.own_models import quarter_car_corner
from tests.recipes import tiny_recipe, whole_recipe


def test_error_between_samples_is_that_of_each_output() -> None:
    time = np.linspace(0.0, 20.0, 401)
    outputs = np.stack([np.sin(time), np.sin(40.0 * time)], axis=1)
    slow, fast = between_samples(outputs, 4)
    assert slow < 1e-4
    assert fast > 0.1


def test_step_of_a_released_recipe_has_no_remark() -> None:
    assert step_remark(case_of(load_recipe(DUFFING))) is None


def test_step_that_is_too_coarse_has_a_remark_and_a_fine_one_has_none() -> None:
    model = {"model": "mbs_models.oscillators:LinearOscillator", "parameters": {"damping": 8.0}}
    coarse = tiny_recipe(
        system=model,
        window={"step": 0.08},
        data={"duration": 9.0},
    )
    remark = step_remark(case_of(coarse))
    assert remark is not None
    assert remark.startswith("window.step = 0.08 s: between its samples position differs by")
    slow = {"kind": "harmonic", "weight": 1.0, "angular_frequency": [1.0, 2.0]}
    fine = of_lag(window={"step": 0.01, "n_in": 90}, data={"excitation": [slow]}).guess
    assert step_remark(case_of(fine)) is None  # importers take such steps


def test_step_of_a_system_that_has_its_own_has_no_remark() -> None:
    assert (
        step_remark(case_of(of_lag("FixedStep", window={"step": 0.01, "n_in": 90}).guess)) is None
    )


def of_here(name: str, step: float, kind: dict[str, Any], **parameters: float) -> str | None:
    """The remark on a recipe of a plain system, with one kind of excitation."""
    data = {"excitation": [{"weight": 1.0, **kind}]}
    return step_remark(
        case_of(of_lag(name, parameters, window={"step": step, "n_in": 90}, data=data).guess)
    )


HELD = {"kind": "held_random", "amplitude": [0.5, 1.0], "samples": [1, 5]}
SLOW = {"kind": "harmonic", "angular_frequency": [1.0, 2.0]}


def test_jump_with_a_held_input_is_no_loss_between_samples() -> None:
    assert of_here("HighPass", 0.1, HELD) is None


def test_outputs_that_follow_rates_of_inputs_jump_without_a_remark() -> None:
    """Rates of straight lines jump at samples, and so does the force of a damper."""
    recipe = whole_recipe(
        {
            "name": "corner",
            "description": "Corner of a car.",
            "system": {
                "kind": "function",
                "model": quarter_car_corner.__name__,
                "outputs": {"force": {"range": [-9000.0, 9000.0]}},
            },
            "window": {"step": 0.005, "n_in": 40, "n_out": 20},
            "data": {"duration": 1.0, "burn_in": 0.2, "train": 2, "validation": 2},
        }
    )
    assert step_remark(case_of(recipe)) is None


def test_course_after_a_jump_that_samples_miss_is_a_loss() -> None:
    remark = of_here("HighPass", 0.1, HELD, time_constant=0.02)
    assert remark is not None
    assert "between its samples x differs by" in remark


SAMPLED = """
import numpy as np

hold = "{hold}"
inputs = {{"u": {{"unit": "1", "range": [-1.0, 1.0]}}}}
outputs = {{"y": {{"unit": "1", "range": [-1.0, 1.0]}}}}


def simulate(t, u, p):
    kept, y = np.exp(-(t[1] - t[0]) / 0.2), np.empty(len(t))
    y[0] = u[0, 0]
    for k in range(1, len(t)):
        y[k] = kept * y[k - 1] + (1 - kept) * u[k, 0]
    return y
"""


@pytest.mark.parametrize("hold", ["zero_order", "first_order"])
def test_simulation_that_holds_its_inputs_must_say_so(tmp_path: Path, hold: str) -> None:
    path = tmp_path / "sampled.py"
    path.write_text(SAMPLED.format(hold=hold), encoding="utf-8")
    recipe = whole_recipe(
        {
            "name": "sampled",
            "description": "Lag.",
            "system": {"kind": "function", "model": str(path)},
            "window": {"step": 0.05, "n_in": 40, "n_out": 20},
            "data": {"duration": 3.0, "burn_in": 1.0, "train": 2, "validation": 2},
        }
    )
    remark = step_remark(case_of(recipe)) or ""
    assert ("differs by" in remark and 'write hold = "zero_order"' in remark) == (
        hold == "first_order"
    )


def test_outputs_that_do_not_move_say_nothing_about_the_step() -> None:
    assert of_here("Threshold", 1.5, SLOW) is None
    remark = of_here("Threshold", 1.5, SLOW, level=0.0)
    assert remark is not None
    assert "between its samples" in remark


def test_line_after_a_jump_holds_what_is_straight_between_samples() -> None:
    jumps = np.repeat(np.random.default_rng(0).uniform(-1.0, 1.0, 50), 4)
    outputs = np.concatenate([[0.0], jumps])[:, None]
    assert after_jumps(outputs, 4) == pytest.approx(0.0)
    assert between_samples(outputs, 4) > 0.2
