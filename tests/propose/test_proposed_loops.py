"""``init --loop`` finds partners from what the model answers, and says where a loop is stiff."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from slide_fmu.core.progress import quiet
from slide_fmu.excitation.loop import LoopRecipe
from slide_fmu.propose.proposal import InitOptions, propose, propose_unsimulated
from slide_fmu.propose.proposed_loops import proposed_loops
from slide_fmu.recipe.reading import parse_open_recipe
from slide_fmu.recipe.recipe import RecipeError
from slide_fmu.recipe.writing import DraftLoop
from slide_fmu.systems.specification import Specification
from tests.refusals import refused

SPRING = """
inputs = {{"place": {{"unit": "m", "range": [-0.1, 0.1]}}}}
outputs = {{"force": {{"unit": "N", "range": [-999.0, 999.0]}}}}
hold = "first_order"
start = [0.0]


def f(x, u, p{du}):
    return [(u[0] - x[0]) / 0.05]  # a spring in a row with a damper


def g(x, u, p{du}):
    return [{force}]
"""
FORCE = "-1000.0 * u[0] - 200.0 * (u[0] - x[0])"
OSCILLATOR = """
inputs = {"push": {"unit": "N", "range": [-100.0, 100.0]}}
outputs = {"place": {"unit": "m", "range": [-1.0, 1.0]}}
start = [0.0, 0.0]


def f(x, u, p):
    return [x[1], (u[0] - 10.0 * x[1] - 2000.0 * x[0]) / 5.0]


def g(x, u, p):
    return [x[0]]
"""


def written(folder: Path, text: str) -> str:
    path = folder / "part.py"
    path.write_text(text, encoding="utf-8")
    return str(path)


def proposed(folder: Path, text: str, pair: str) -> tuple[LoopRecipe, DraftLoop]:
    made = Specification(written(folder, text), kind="function")
    (draft,) = proposed_loops((pair,), made, 0.01)
    return LoopRecipe(**draft.table), draft


def spring(force: str = FORCE, du: str = "") -> str:
    return SPRING.format(force=force, du=du)


@pytest.mark.extended
def test_init_writes_loops_and_repeats_their_warnings(tmp_path: Path) -> None:
    path = written(tmp_path, spring("-1000.0 * u[0] - 400.0 * du[0]", ", du"))
    found = propose(InitOptions(path, step=0.01, folder=tmp_path, loops=("force:place",)), quiet)
    (loop,) = parse_open_recipe(found.text, "part.toml").guess.loop
    assert (loop.output, loop.input) == ("force", "place")
    (remark,) = [remark for remark in found.remarks if remark.startswith("The interface is stiff")]
    assert "the gain round the loop in one step of 0.01 s is" in remark
    assert remark in found.text.replace("\n# ", " ")
    assert "# Displacement in, force out: force acts on a partner with a mass" in found.text


def test_masses_have_natural_frequencies_that_the_step_shows(tmp_path: Path) -> None:
    loop, draft = proposed(tmp_path, spring(), "force:place")
    low, high = (1000.0 / (2 * np.pi * hz) ** 2 for hz in (6.25, 6.25 / 6))
    assert loop.mass[0] == pytest.approx(low, rel=0.35)
    assert loop.mass[1] == pytest.approx(high, rel=0.1)
    assert loop.stiffness == (0.0, 0.0)
    assert draft.warnings == ()


def test_springs_follow_from_the_mass_of_the_system(tmp_path: Path) -> None:
    loop, draft = proposed(tmp_path, OSCILLATOR, "place:push")
    assert loop.stiffness[1] == pytest.approx(5.0 * (2 * np.pi * 6.25) ** 2 - 2000.0, rel=0.1)
    assert loop.mass == (0.0, 0.0)
    assert draft.comments[0].startswith("Force in, displacement out: place deforms a partner")


def test_damper_without_a_spring_gets_partners_with_springs(tmp_path: Path) -> None:
    loop, _ = proposed(tmp_path, spring("-200.0 * du[0]", ", du"), "force:place")
    assert loop.stiffness[0] > 0


def test_force_that_pushes_on_is_refused(tmp_path: Path) -> None:
    with refused(RecipeError, "--loop force:place", "give the output the other sign"):
        proposed(tmp_path, spring("1000.0 * u[0]"), "force:place")


@pytest.mark.parametrize("force", ["3.0", "-1e-9 * u[0]"])
def test_output_that_does_not_follow_its_input_is_refused(tmp_path: Path, force: str) -> None:
    with refused(RecipeError, "--loop force:place", "name an output that follows the input"):
        proposed(tmp_path, spring(force), "force:place")


@pytest.mark.parametrize(
    ("loop", "words"),
    [
        ("force", ["--loop 'force'", "expected OUTPUT:INPUT"]),
        ("way:place", ["--loop way:place", "expected one of ['force']"]),
        ("force:plaec", ["input = 'plaec'"]),
    ],
)
def test_pairs_that_are_no_loop_are_refused(tmp_path: Path, loop: str, words: list[str]) -> None:
    with refused(RecipeError, *words):
        proposed(tmp_path, spring(), loop)


def test_wrong_pairs_are_refused_before_the_model_is_simulated(tmp_path: Path) -> None:
    with refused(RecipeError, "--loop 'force'", "expected OUTPUT:INPUT"):
        propose(InitOptions(str(tmp_path / "none.py"), loops=("force",)), quiet)

    def simulated(*_: int) -> None:
        raise AssertionError

    model = written(tmp_path, spring())
    with refused(RecipeError, "--loop force:plaec", "expected one of ['place']"):
        propose(InitOptions(model, loops=("force:plaec",)), simulated)


def test_whole_simulations_are_refused(tmp_path: Path) -> None:
    text = spring().split("start =")[0] + (
        "\n\ndef simulate(t, u, p):\n    return -1000.0 * u[:, :1]\n"
    )
    with refused(RecipeError, "simulates whole motions only", "give f and g"):
        proposed(tmp_path, text, "force:place")


def test_records_have_no_loops(tmp_path: Path) -> None:
    options = InitOptions(str(tmp_path / "a.csv"), kind="record", loops=("force:place",))
    with refused(ValueError, "--loop force:place for records", "expected none"):
        propose_unsimulated(options)


@pytest.mark.parametrize("loops", [(), ("force:place",)], ids=["alone", "in a loop"])
def test_angle_that_a_partner_decides_is_no_set_point_of_a_drive(
    tmp_path: Path, loops: tuple[str, ...]
) -> None:
    text = (
        spring("-1000.0 * u[0] - 20.0 * du[0]", ", du")
        .replace('"m"', '"rad"')
        .replace('"N"', '"N.m"')
    )
    found = propose(
        InitOptions(written(tmp_path, text), step=0.01, folder=tmp_path, loops=loops), quiet
    )
    recipe = parse_open_recipe(found.text, "part.toml").guess
    of_drives = {"point_to_point", "axis_moves"} & {one.kind for one in recipe.data.excitation}
    assert bool(of_drives) == (not loops)
    assert recipe.data.substeps == (4 if loops else 1)
