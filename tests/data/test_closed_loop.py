"""Inputs are drawn as they occur where an output of the system decides one of them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from slide_fmu.core.progress import quiet
from slide_fmu.core.signals import FloatArray
from slide_fmu.data.closed_loop import ClosedLoop
from slide_fmu.data.draws import Draw, draw, split_stream
from slide_fmu.data.failures import kept_failures
from slide_fmu.data.generation import generate
from slide_fmu.excitation.loop import LoopRecipe, Partner
from slide_fmu.recipe.case import Case, case_of
from slide_fmu.recipe.recipe import Recipe, RecipeError
from slide_fmu.systems.errors import SimulationError
from tests.data.loop_systems import MASS, STIFFNESS, Oscillator, Spring
from tests.recipes import whole_recipe
from tests.refusals import refused

STEP = 0.01
MOVED: dict[str, Any] = {"output": "force", "input": "place", "weight": 1e9, "mass": (2.0, 50.0)}
DEFORMED: dict[str, Any] = {
    "output": "place", "input": "push", "weight": 1.0, "stiffness": (500.0, 5000.0)
}  # fmt: skip
SINES = {
    "kind": "multisine", "weight": 1.0, "amplitude": (0.1, 0.5), "angular_frequency": (1.0, 20.0)
}  # fmt: skip


def recipe_of(system: str = "Spring", loop: dict[str, Any] = MOVED, **changes: Any) -> Recipe:
    """A recipe whose motions are nearly all in a loop."""
    data = {"duration": 2.0, "burn_in": 0.5, "train": 4, "validation": 1, "excitation": (SINES,)}
    parameters = changes.pop("parameters", {})
    return whole_recipe(
        {
            "name": "spring",
            "description": "spring in a loop",
            "system": {"model": f"tests.data.loop_systems:{system}", "parameters": parameters},
            "window": {"step": STEP, "n_in": 8, "n_out": 2},
            "data": {**data, **changes},
            "loop": (loop,),
        }
    )


def drawn(case: Case, index: int = 0) -> Draw:
    recipe = case.recipe
    return draw(recipe, case.system, split_stream(recipe, "train", index), index)


def frequency_of(motion: FloatArray) -> float:
    """Frequency in Hz of a free vibration, between its first and last zero crossing."""
    k = np.flatnonzero(np.diff(np.sign(motion)) != 0)
    at = k + motion[k] / (motion[k] - motion[k + 1])
    return float((len(at) - 1) / (2 * STEP * (at[-1] - at[0])))


def free_vibration(loop: LoopRecipe, system: Any, partner: Partner, start: float) -> FloatArray:
    """Let go of a partner that was held by an outer force or displacement."""
    outer = np.zeros((1000, len(system.inputs)))
    outer[0, -1] = start
    return ClosedLoop([(loop, partner)], system).inputs(outer)[:, -1]


@pytest.mark.parametrize("hold", ["first_order", "zero_order"])
@pytest.mark.parametrize("mass", [5.0, 100.0])
def test_mass_on_a_spring_has_its_natural_frequency(hold: str, mass: float) -> None:
    way = free_vibration(
        LoopRecipe(**MOVED), Spring(STEP, hold=hold), Partner(mass, 500.0, 0.0), 20.0
    )
    true = np.sqrt((STIFFNESS + 500.0) / mass) / (2 * np.pi)
    assert frequency_of(way) == pytest.approx(true, rel=0.02)
    assert np.abs(way[-200:]).max() == pytest.approx(20.0, rel=0.05)  # it neither grows nor decays


def test_damped_partner_comes_to_rest() -> None:
    way = free_vibration(LoopRecipe(**MOVED), Spring(STEP), Partner(5.0, 0.0, 20.0), 20.0)
    whole = np.abs(way).max()
    assert np.abs(way[500:]).max() < 2.0 * whole * np.exp(-20.0 / 10.0 * 5.0)


def test_share_of_the_outer_force_moves_a_partner_by_this_share() -> None:
    """Without it, only the other inputs move the partner; both systems are linear."""
    whole, half, none = (
        free_vibration(LoopRecipe(**MOVED), Spring(STEP), Partner(5.0, 0.0, 20.0, outer), 20.0)
        for outer in (1.0, 0.5, 0.0)
    )
    np.testing.assert_allclose(half, 0.5 * whole, atol=1e-9)
    np.testing.assert_allclose(none, 0.0, atol=1e-12)


def test_spring_on_an_oscillator_has_the_natural_frequency_of_both() -> None:
    way = free_vibration(LoopRecipe(**DEFORMED), Oscillator(STEP), Partner(0, 1000.0, 0.0), 20.0)
    true = np.sqrt((STIFFNESS + 1000.0) / MASS) / (2 * np.pi)
    assert frequency_of(way) == pytest.approx(true, rel=0.02)


def test_draw_depends_on_recipe_and_index_alone() -> None:
    one, other = case_of(recipe_of()), case_of(recipe_of())
    first = drawn(one, 1).inputs
    drawn(other, 0)
    np.testing.assert_array_equal(drawn(other, 1).inputs, first)
    assert not np.array_equal(drawn(one, 2).inputs, first)


@pytest.mark.parametrize("substeps", [1, 4])
def test_inputs_of_a_loop_stay_in_their_ranges_and_bend_between_samples(substeps: int) -> None:
    case = case_of(recipe_of(substeps=substeps, excitation=({**SINES, "amplitude": (1.0, 1.0)},)))
    for index in range(4):
        motion = drawn(case, index)
        assert motion.kind == 1
        for channel, signal in enumerate(case.system.inputs):
            assert np.abs(motion.inputs[:, channel]).max() <= signal.high
            assert np.ptp(motion.inputs[:, channel]) > 0.01 * signal.high
        if substeps > 1:
            assert motion.between is not None
            np.testing.assert_array_equal(motion.between[substeps - 1 :: substeps], motion.inputs)


def test_motions_without_a_loop_are_as_without_the_table() -> None:
    rare = case_of(recipe_of(loop={**MOVED, "weight": 1e-12}))
    without = case_of(rare.recipe.without_loops())
    np.testing.assert_array_equal(drawn(rare).inputs, drawn(without).inputs)


def test_light_partner_of_a_stiff_spring_stays_stable() -> None:
    loop = LoopRecipe(**{**MOVED, "mass": (0.01, 0.01)})  # a step is 4.5 radians of its vibration
    way = free_vibration(loop, Spring(STEP), Partner(0.01, 0.0, 0.0), 20.0)
    assert np.abs(way).max() < 25.0


def test_output_of_the_wrong_sign_is_refused() -> None:
    with refused(SimulationError, "'force' drives input 'place' on", "give the output the other"):
        drawn(case_of(recipe_of(parameters={"sign": -1.0})))


def test_loops_that_leave_the_range_are_counted_as_failures(tmp_path: Path) -> None:
    """A partner without damping, driven at its resonance, leaves the range however small."""
    steps = {"kind": "harmonic", "weight": 1.0, "angular_frequency": (19.5, 20.5)}
    mass = STIFFNESS / 20.0**2
    recipe = recipe_of(
        loop={**MOVED, "mass": (mass, mass)},
        excitation=(steps,), duration=200.0, train=2, most_failures=1.0,
    )  # fmt: skip
    folder = tmp_path / "trajectories"
    with refused(SimulationError, "trajectories could not be simulated", "leaves its range"):
        generate(case_of(recipe), folder, None, quiet)
    failures = kept_failures(case_of(recipe), folder)
    assert "in a loop with a mass of 5 kg, input 'place' leaves its range" in failures[0].error
    assert list((tmp_path / "failures").glob(f"{failures[0].name}-*.csv"))


def test_loop_that_fails_once_is_drawn_again_and_counted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn_inputs, calls = ClosedLoop.inputs, list[int]()

    def fails_once(self: ClosedLoop, *arguments: Any) -> FloatArray:
        calls.append(1)
        if len(calls) == 1:
            raise SimulationError("the loop left its range", 0.5)
        return drawn_inputs(self, *arguments)

    monkeypatch.setattr(ClosedLoop, "inputs", fails_once)
    case = case_of(recipe_of(train=3))
    generate(case, tmp_path / "trajectories", None, quiet)
    (failure,) = kept_failures(case, tmp_path / "trajectories")
    assert (failure.attempt, failure.error) == (0, "the loop left its range")
    assert len(calls) == 5  # of three trajectories and one for validation


def test_damper_without_a_spring_is_moved_through_much_of_its_range() -> None:
    class Damper(Spring):
        """It answers to the rate of its place alone."""

        def advance(self, inputs: FloatArray) -> FloatArray:
            self._rate = (inputs[1] - self._u[1]) / self.step
            self._u = np.array(inputs)
            return np.array([-1e-6 * 20.0 * self._rate])  # kN, mm

        def output(self) -> FloatArray:
            return np.zeros(1)

    slow = 80.0 * np.sin(0.05 * np.arange(400))
    outer = np.stack([np.zeros(400), slow], axis=1)
    loop = LoopRecipe(**MOVED)
    closed = ClosedLoop([(loop, Partner(5.0, 0.0, 1.0))], Damper(STEP))
    closed_inputs = closed.inputs(outer)[:, 1]
    assert 10.0 < np.abs(closed_inputs).max() <= 100.0


@pytest.mark.parametrize(
    ("system", "loop", "words"),
    [
        ("Whole", MOVED, ["simulates whole motions only", "give f and g"]),
        ("Spring", {**MOVED, "input": "palce"}, ["1st [[loop]]", "input = 'palce'", "'place'"]),
        ("Spring", {**MOVED, "output": "f"}, ["output = 'f'", "expected one of ['force']"]),
        ("Oscillator", DEFORMED | {"mass": (1.0, 2.0)}, ["a displacement deforms", "remove mass"]),
        ("Spring", MOVED | {"mass": (0.0, 0.0), "damping": (1.0, 1.0)}, ["give a range of mass"]),
    ],
)
def test_loops_that_do_not_fit_are_refused(
    system: str, loop: dict[str, Any], words: list[str]
) -> None:
    with refused(RecipeError, *words):
        _ = case_of(recipe_of(system, loop)).system


def test_loop_of_an_input_that_is_known_ahead_is_refused() -> None:
    recipe = recipe_of()
    planned = recipe.window.model_copy(update={"planned": True})
    with refused(RecipeError, "1st [[loop]] with window.planned = true", "'place'"):
        _ = case_of(recipe.model_copy(update={"window": planned})).system
