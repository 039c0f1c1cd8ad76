"""Loops close with a model of the user, and several loops close in one motion."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from slide_fmu.core.progress import quiet
from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.data.closed_loop import ClosedLoop
from slide_fmu.data.failures import kept_failures
from slide_fmu.data.generation import generate
from slide_fmu.data.model_answers import identity, same_motion
from slide_fmu.excitation.loop import LoopRecipe, Partner
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import RecipeError
from slide_fmu.systems.base import Stepping
from slide_fmu.systems.errors import LoadError, SimulationError
from tests.data.loop_systems import STIFFNESS, Oscillator, Spring
from tests.data.test_closed_loop import (
    DEFORMED,
    STEP,
    drawn,
    free_vibration,
    frequency_of,
    recipe_of,
)
from tests.refusals import refused

BODY = """
inputs = {{"push": {{"unit": "kN", "range": [-1.0, 1.0]}},
    "load": {{"unit": "kN", "range": [-0.1, 0.1]}}}}
outputs = {{"height": "mm"}}
parameters = {{"m": 5.0, "k": 500.0, "d": 0.0, "sign": 1.0}}
hold = "{hold}"


def start(u, p):
    return [1e3 * (u[0] + u[1]) / p.k if p.k > 0 else 20e-3, 0.0]


def f(x, u, p):
    return [x[1], (p.sign * 1e3 * (u[0] + u[1]) - p.k * x[0] - p.d * x[1]) / p.m]


def g(x, u, p):
    return [1e3 * x[0]]
"""


def body(folder: Path, hold: str = "first_order") -> dict[str, Any]:
    """A loop around the spring whose partner is a body of the user."""
    path = folder / "body.py"
    path.write_text(BODY.format(hold=hold), encoding="utf-8")
    own = {"partner": str(path), "through": ("push", "height")}
    return {"output": "force", "input": "place", "weight": 1e9, **own}


@pytest.mark.parametrize("hold", ["first_order", "zero_order"])
def test_own_body_vibrates_as_a_simple_mass(tmp_path: Path, hold: str) -> None:
    loop = LoopRecipe(**body(tmp_path, hold), ranges={"m": (4.0, 9.0), "k": (0.0, 500.0)})
    partner = Partner(0.0, 0.0, 0.0, own=(("m", 8.0), ("k", 0.0)))
    way = free_vibration(loop, Spring(STEP), partner, 0.0)
    assert way[0] == pytest.approx(20.0)
    true = np.sqrt(STIFFNESS / 8.0) / (2 * np.pi)
    assert frequency_of(way) == pytest.approx(true, rel=0.02)
    assert np.abs(way[-200:]).max() == pytest.approx(20.0, rel=0.05)


def test_own_body_that_is_light_stays_stable(tmp_path: Path) -> None:
    """A step is 2.6 radians of its vibration."""
    loop = LoopRecipe(**body(tmp_path))
    partner = Partner(0.0, 0.0, 0.0, own=(("m", 0.03), ("k", 0.0)))
    assert np.abs(free_vibration(loop, Spring(STEP), partner, 0.0)).max() < 25.0


def test_other_input_of_a_partner_moves_as_what_is_drawn_for_the_loop(tmp_path: Path) -> None:
    loop = LoopRecipe(**body(tmp_path))
    outer = np.zeros((600, 2))
    outer[200:, 1] = 50.0  # half of its range, so the load is 50 N
    partner = Partner(0.0, 0.0, 0.0, outer=0.4, own=(("d", 100.0),))
    way = ClosedLoop([(loop, partner)], Spring(STEP)).inputs(outer)[:, 1]
    np.testing.assert_allclose(way[:200], 0.0, atol=1e-6)
    assert way[-1] == pytest.approx(0.4 * 1e3 * 50.0 / (STIFFNESS + 500.0), rel=0.01)


def test_values_of_parameters_are_drawn_in_their_ranges(tmp_path: Path) -> None:
    loop = LoopRecipe(**body(tmp_path), ranges={"m": (1.0, 100.0), "load": (-0.1, 0.3)})
    rng = np.random.default_rng(0)
    masses = [dict(loop.drawn_partner(rng, alone=False).own)["m"] for _ in range(200)]
    assert 1.0 <= min(masses) < 2.0 < 50.0 < max(masses) <= 100.0
    assert loop.described((), STEP).startswith("in a loop with the model")
    assert "with m 1 to 100, load -0.1 to 0.3: force acts on it" in loop.described((), STEP)
    assert loop.settings()["m"] == "1.0 .. 100.0"
    assert [dict(one.own)["m"] for one in loop.typical_partners()] == pytest.approx([1, 10, 100])


@pytest.mark.extended
def test_motions_with_an_own_partner_are_data(tmp_path: Path) -> None:
    loop = {**body(tmp_path), "ranges": {"m": [4.0, 9.0], "d": [20.0, 90.0]}}
    case = case_of(recipe_of(loop=loop, substeps=2))
    first, again = drawn(case, 0).inputs, drawn(case, 0).inputs
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, drawn(case, 1).inputs)
    generate(case, tmp_path / "trajectories", None, quiet)
    assert kept_failures(case, tmp_path / "trajectories") == []


@pytest.mark.extended
def test_partner_that_drives_its_input_on_is_left_out_and_counted(tmp_path: Path) -> None:
    loop = {**body(tmp_path), "ranges": {"sign": (-1.0, -1.0), "k": (100.0, 100.0)}}
    case, folder = case_of(recipe_of(loop=loop, most_failures=1.0)), tmp_path / "trajectories"
    words = ["model", "leaves its range", "1000 times smaller", "correct the sign"]
    with refused(SimulationError, *words):
        generate(case, folder, None, quiet)
    assert len(kept_failures(case, folder)) > 1


def test_change_of_a_partner_is_a_change_of_the_data(tmp_path: Path) -> None:
    case = case_of(recipe_of(loop=body(tmp_path)))
    before = identity(case.source, case.recipe)
    heavy = {**body(tmp_path), "ranges": {"m": (50.0, 60.0)}}
    assert not same_motion(before, identity(case.source, recipe_of(loop=heavy)))
    assert same_motion(before, identity(case.source, case.recipe))
    place = tmp_path / "body.py"
    place.write_text(place.read_text("utf-8").replace('"m": 5.0', '"m": 50.0'), encoding="utf-8")
    assert not same_motion(before, identity(case.source, case.recipe))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"partner": "no_body.py"}, ["1st [[loop]]: partner 'no_body.py'"]),
        ({"through": ("pull", "height")}, ["the input 'pull'", "'push'"]),
        ({"through": None}, ["through is not given", "['push', 'load']"]),
        ({"ranges": {"m": [2.0, 1.0]}}, ["smaller one first"]),
        ({"ranges": {"mas": (1.0, 2.0)}}, ["ranges name ['mas']", "'m'", "'load'"]),
        ({"output": "f"}, ["output = 'f'", "expected one of ['force']"]),
        ({"mass": (1.0, 2.0)}, ["and mass", "one of both"]),
        ({"partner": None}, ["through without partner"]),
    ],
)
def test_partners_that_do_not_fit_are_refused(
    tmp_path: Path, change: dict[str, Any], words: list[str]
) -> None:
    with refused(ValueError, *words):
        _ = case_of(recipe_of(loop={**body(tmp_path), **change})).system


def test_partner_in_another_unit_is_refused(tmp_path: Path) -> None:
    loop = body(tmp_path)
    text = Path(loop["partner"]).read_text("utf-8").replace('"mm"', '"m"')
    other = tmp_path / "metres.py"
    other.write_text(text, encoding="utf-8")
    words = ["'height' is in m, and 'place' of the system in mm", "convert"]
    with refused(RecipeError, *words):
        _ = case_of(recipe_of(loop={**loop, "partner": str(other)})).system


class TwoSprings(Stepping):
    """Two springs that push two places towards the middle; the second one also by the first."""

    def __init__(self, step: float, silent: bool = False) -> None:
        """Take the step, and whether the second force does not follow its place."""
        self.step, self._silent = step, silent
        self.inputs = tuple(
            Signal(name, "m", -0.1, 0.1, hold="first_order") for name in ("one", "two")
        )
        self.outputs = tuple(Signal(name, "N", -500.0, 500.0) for name in ("first", "second"))
        self._u = np.zeros(2)

    def begin(self, held_input: FloatArray) -> None:
        """Take the first inputs."""
        self._u = np.array(held_input)

    def output(self) -> FloatArray:
        """Give the forces."""
        second = 0.0 if self._silent else -1000.0 * self._u[1] + 100.0 * self._u[0]
        return np.array([-STIFFNESS * self._u[0] + 100.0 * self._u[1], second])

    def advance(self, inputs: FloatArray) -> FloatArray:
        """Take the next inputs."""
        self._u = np.array(inputs)
        return self.output()


def masses(*names: str) -> list[tuple[LoopRecipe, Partner]]:
    """Loops around the two springs, with masses of 2 kg."""
    outputs = {"one": "first", "two": "second"}
    return [
        (LoopRecipe(output=outputs[n], input=n, weight=1.0, mass=(2.0, 2.0)), Partner(2.0, 0, 0))
        for n in names
    ]


def test_two_masses_vibrate_together_at_their_common_frequencies() -> None:
    outer = np.zeros((2000, 2))
    outer[0] = 0.05
    way = ClosedLoop(masses("one", "two"), TwoSprings(STEP)).inputs(outer)
    stiffness = np.array([[STIFFNESS, -100.0], [-100.0, 1000.0]])
    values, modes = np.linalg.eigh(stiffness / 2.0)
    for value, parts in zip(values, (way @ modes).T, strict=True):
        assert frequency_of(parts) == pytest.approx(np.sqrt(value) / (2 * np.pi), rel=0.02)


def test_loops_of_different_inputs_act_together_in_half_of_their_motions() -> None:
    tables = [loop for loop, _ in masses("one", "two")]
    recipe = recipe_of(loop=tables[0].model_dump(exclude_none=True))
    system = {"model": f"{__name__}:TwoSprings"}
    moved = recipe.system.model_copy(update=system)
    case = case_of(recipe.model_copy(update={"system": moved, "loop": tuple(tables)}))
    alone = case_of(case.recipe.model_copy(update={"loop": (tables[0],)}))
    kinds = len(recipe.data.excitation)
    from slide_fmu.data.draws import draw, split_stream

    differ = []
    for index in range(12):
        stream = split_stream(recipe, "train", index)
        one = draw(case.recipe, case.system, stream, index, kind=kinds).inputs[:, 1]
        other = draw(alone.recipe, alone.system, stream, index, kind=kinds).inputs[:, 1]
        differ.append(not np.array_equal(one, other))
    assert 2 <= sum(differ) <= 10


def test_output_that_does_not_follow_its_input_is_refused() -> None:
    with refused(LoadError, "[[loop]] of 'second' and 'two'", "name an output that follows"):
        ClosedLoop(masses("two"), TwoSprings(STEP, silent=True))
    gap = TwoSprings(STEP)
    inner = gap.output
    gap.output = lambda: np.sign(inner()) * np.maximum(np.abs(inner()) - 20.0, 0.0)  # type: ignore[method-assign]
    ClosedLoop(masses("two"), gap)  # it answers outside of a gap


@pytest.mark.extended
def test_own_spring_deforms_as_a_simple_one(tmp_path: Path) -> None:
    """Its other input adds a force, as the motion of the other end of a simple one."""
    path = tmp_path / "spring.py"
    path.write_text(
        'inputs = {"way": "m", "add": {"unit": "N", "range": [-100.0, 100.0]}}\n'
        'outputs = {"pull": "N"}\nhold = "first_order"\nstart = [0.0]\n\n\n'
        "def f(x, u, p):\n    return [-x[0]]\n\n\n"
        "def g(x, u, p):\n    return [u[1] - 900.0 * u[0]]\n",
        encoding="utf-8",
    )
    own = LoopRecipe(
        output="place", input="push", weight=1.0, partner=str(path), through=("way", "pull")
    )
    simple = LoopRecipe(**DEFORMED)
    inputs, expected = (
        free_vibration(loop, Oscillator(STEP), Partner(0.0, 900.0, 0.0), 20.0)
        for loop in (own, simple)
    )
    np.testing.assert_allclose(inputs, expected, atol=1e-6)
