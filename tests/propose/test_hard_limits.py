"""Declared ranges of inputs are hard limits on the whole way, unless a recipe asks for more."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
from typer.testing import CliRunner, Result

from slide_fmu.cli.app import app
from slide_fmu.core.signals import Signal
from slide_fmu.core.window import Window
from slide_fmu.fmu.export import export_fmu
from slide_fmu.memory import motions
from slide_fmu.memory.sizing import _rate_near_rest
from slide_fmu.pipeline.measurement import BEYOND, IN_RANGE, remarks_of_beyond, tasks
from slide_fmu.propose import first_look
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.systems.errors import SimulationError
from slide_fmu.systems.function.system import FunctionSystem
from slide_fmu.validation.task import Task
from slide_fmu.validation.validate import validate
from tests.fmu.samples import sum_surrogate
from tests.libraries import build_libraries
from tests.own_models import two_tanks
from tests.progress import silent
from tests.recipes import ESTIMATOR, tiny_recipe, tiny_state_space_recipe, whole_recipe
from tests.refusals import refused

STRICT = '''
"""A tank that cannot be asked for anything outside of the ranges of its inputs."""

from pathlib import Path

inputs = {
    "pump": {"unit": "L/min", "range": [-0.66, 5.42], "start": 5.42},
    "valve": {"unit": "1", "range": [0.5, 1.0], "start": 0.5},
}
outputs = {"level": "m"}
start = [0.5]
hold = "HOLD"


def require(u):
    if not (-0.66 <= u[0] <= 5.42 and 0.5 <= u[1] <= 1.0):
        Path(__file__).with_name("outside.txt").write_text(f"asked for {u.tolist()}")


def f(x, u, p):
    require(u)
    return [u[0] - 4.0 * u[1] * x[0]]


def g(x, u, p):
    require(u)
    return [x[0]]
'''
"""Ends of the ranges are rounded outwards by kinds of excitation, and inputs begin at an end."""

SMALL = """
[data]
duration = 10
burn_in = 2
train = 4
validation = 2
companion = 2
bound = 6
calibration = 40

[network]
family = "state_space"
order = 1
hidden = 2

[training]
starts = 1
iterations = 2
expert.start_iterations = 2

[validation]
trajectories = 2
adversarial = 1

[stability]
allow_unstable = true

[bound]
expert.steps = 20
expert.attempts = 1

[[bound.excitation]]
kind = "binary"
weight = 1.0
duration = [0.3, 2.0]
"""


LENGTHS = """[window]
n_in = 200
n_out = 60
allow_short = true"""
DATA = """
[data]
duration = 1000
burn_in = 300
train = 1
validation = 1
estimator = 2
estimator_validation = 1

[[data.excitation]]
kind = "binary"
weight = 1.0
duration = [100, 400]
"""


def invoke(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture(autouse=True)
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(first_look, "SAMPLES", 300)
    for name in ("MOTIONS", "LEAST_MEASURED", "LINEARIZED_MOTIONS"):
        monkeypatch.setattr(motions, name, 2)


def proposed(folder: Path, text: str) -> Path:
    """The recipe that is proposed for a model, without what it proposes to learn of errors."""
    model, recipe = folder / "strict.py", folder / "strict.toml"
    model.write_text(text)
    done = invoke("init", model, "-o", recipe)
    assert done.exit_code == 0, done.output
    return recipe


def before_data(text: str) -> str:
    """What a proposed recipe says before its data."""
    start = "[data]" if "[data]" in text else "# Each of these tables"
    return text[: text.index(start)]


def with_bends(data: str) -> str:
    """Tables of data whose sines bend between samples, where inputs move."""
    return data.replace("[data]\n", "[data]\nsubsteps = 4\n")


@pytest.mark.extended
@pytest.mark.parametrize(
    ("hold", "commands"), [("zero_order", ["run"]), ("first_order", ["try", "run"])]
)
def test_whole_way_never_leaves_the_ranges(hold: str, commands: list[str], tmp_path: Path) -> None:
    """Proposal, trial, window, data, networks, bound, validation, search and credentials."""
    recipe = proposed(tmp_path, STRICT.replace("HOLD", hold))
    recipe.write_text(before_data(recipe.read_text()) + with_bends(SMALL))
    for command in commands:
        alone = ("--workers", 1) if command == "run" else ()
        done = invoke(command, recipe, "--runs", tmp_path, *alone)
        assert done.exit_code == 0, done.output
    assert not (tmp_path / "outside.txt").exists()
    assert (tmp_path / "strict" / "strict.fmu").exists()


@pytest.mark.extended
def test_a_model_that_fails_beyond_its_ranges_is_tried_and_hears_of_what_is_left_out(
    tmp_path: Path,
) -> None:
    recipe = proposed(tmp_path, Path(two_tanks.__file__).read_text())
    text = before_data(recipe.read_text()).replace("[window]", LENGTHS)
    for name, table in (("within", ""), ("beyond", "[estimator]\nbeyond = true\n")):
        recipe.write_text(text + with_bends(DATA) + table)
        done = invoke("try", recipe, "--runs", tmp_path, "--json", tmp_path / "figures.json")
        assert done.exit_code == 0, done.output
        told = " ".join(json.loads((tmp_path / "figures.json").read_text())["remarks"])
        asked = "times the amplitude, for which estimator.beyond asks; trajectories that fail"
        assert (asked in told) is (name == "beyond")
        assert (" lies outside of its range 0.2..1" in told) is (name == "beyond")
    done = invoke("generate", recipe, "--runs", tmp_path, "--json", tmp_path / "data.json")
    assert done.exit_code == 0, done.output
    remark = json.loads((tmp_path / "data.json").read_text())["remark"]
    assert remark.startswith("1 of 1 trajectories beyond the ranges of the inputs, which")


def test_what_is_measured_beyond_the_range_is_what_a_recipe_asks_for() -> None:
    data = {"estimator": 2, "estimator_validation": 2}
    assert list(tasks(tiny_recipe(data=data, estimator=ESTIMATOR), 1)) == [IN_RANGE]
    asked = tiny_recipe(data=data, estimator={**ESTIMATOR, "beyond": True})
    assert tasks(asked, 1)[BEYOND].amplitude == (1.0, 3.0)
    bound = {"duration": 4.0, "bound": 4}
    assert list(tasks(tiny_state_space_recipe(data=bound, bound={}), 1)) == [IN_RANGE]
    learnt = {**bound, "beyond": 2, "beyond_factor": (1.0, 2.0)}
    of_bound = tasks(tiny_state_space_recipe(data=learnt, bound={}), 1)
    assert of_bound[BEYOND].amplitude == (1.0, 2.0)


def failing_recipe(level: float) -> Recipe:
    """The tiny recipe of a system that fails above an input of so much, whose range ends at 1."""
    tables = tiny_recipe(data={"burn_in": 0.0}).model_dump(mode="json")
    tables["system"].update(
        model="tests.data.failing_system:FailingSystem", parameters={"fail": level}
    )
    return whole_recipe(tables)


@pytest.mark.parametrize("level", [1.0, 1.4])
def test_trajectories_beyond_the_range_that_fail_are_not_measured(
    level: float, tmp_path: Path
) -> None:
    build_libraries()
    recipe = failing_recipe(level)
    system = case_of(recipe).system
    surrogate = replace(
        sum_surrogate(20),
        name="tiny",
        window=Window(recipe.window.step, 20, 1),
        inputs=system.inputs,
        outputs=system.outputs,
    )
    fmu = export_fmu(surrogate, tmp_path / "tiny.fmu")
    task = Task(3, trajectories=6, amplitude=(1.3, 3.0))
    if level == 1.0:
        with refused(SimulationError, "lies outside"):
            validate(fmu, surrogate, case_of(recipe), task, silent)
        return
    found = validate(fmu, surrogate, case_of(recipe), task, silent)
    assert found.left_out
    assert len(found.left_out) + len(found.comparisons) == 6
    assert found.figures().left_out == found.left_out
    (remark,) = remarks_of_beyond(found)
    assert remark.startswith(f"{len(found.left_out)} of 6 trajectories beyond the range could")
    inside = validate(fmu, surrogate, case_of(recipe), Task(3, trajectories=6), silent)
    assert inside.left_out == ()
    assert remarks_of_beyond(inside) == []


def test_a_kick_near_rest_stays_in_a_range_at_whose_end_the_input_starts() -> None:
    seen: list[float] = []

    def f(x: Any, u: Any, p: Any) -> list[float]:
        seen.append(float(u[0]))
        return [2.0 * (u[0] - x[0])]

    signal = Signal("drive", "m", 0.2, 1.0, start=1.0)
    level = Signal("level", "m", 0.0, 1.0)
    system = FunctionSystem(
        f, lambda x, u, p: [x[0]], inputs=[signal], outputs=[level], start=[0.5], step=0.1
    )
    rate = _rate_near_rest(cast(Any, SimpleNamespace(system=system)), 1.0)
    assert rate == pytest.approx(-2.0, rel=0.2)
    assert min(seen) >= 0.2
    assert max(seen) == 1.0
