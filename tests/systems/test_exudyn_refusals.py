"""Mistakes in model files of exudyn, parameters that do not fit, and motions that fail."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from slide_fmu.systems.errors import LoadError, SimulationError
from slide_fmu.systems.exudyn.model import describe
from slide_fmu.systems.simulation import simulate
from tests.refusals import refused
from tests.systems.exudyn_models import LOAD, OSCILLATOR, SPRING, model, system_of

TO_FORCE = '"force": {"unit": "N", '
LOAD_7 = 'mbs.AddLoad(item.LoadCoordinate("force", 7))'
NO_DIRECTION = """mbs.AddLoad(item.Force("force", mbs.AddMarker(
        item.MarkerNodePosition(nodeNumber=mbs.AddNode(item.NodePointGround()))), [0, 0, 0]))"""
OWN_LOAD = LOAD.replace("mark", "mark, loadUserFunction=lambda *_: 1.0")
OWN_SPRING = f"{SPRING[:-1]}, springForceUserFunction=lambda *_: "
MISTAKES = [
    (LOAD, "pass", "'force' acts on nothing", "(loads: [])"),
    ('"force", mark', '"push", mark', "'force' acts on nothing", "(loads: ['push'])"),
    ('SensorNode("position"', 'SensorNode("place"', "no sensor 'position'", "['acceleration', "),
    ('"force": "N"', '"force": 3', "inputs.force.unit = 3", "expected a text"),
    ('"force": "N"', TO_FORCE + '"parameter": "spring"}', "'spring'", "'OBJECT.PARAMETER'"),
    ('"force": "N"', TO_FORCE + '"parameter": "a.b"}', "'a.b' is not there", "'spring'"),
    ('"force": "N"', TO_FORCE + '"parameter": "spring.b"}', "'spring.b'", "'offset'"),
    ('"force": "N"', TO_FORCE + '"sensor": "b"}', "inputs.force.sensor = 'b'", "'parameter'"),
    ('"force": "N"', TO_FORCE + '"range": 3}', "inputs.force.range = 3", "[LOW, HIGH]"),
    ('"position": "m"', '"position": {"sensor": "position[1]"}', "measures 1 values", "expected"),
    ('inputs = {"force": "N"}', "inputs = {}", "inputs = {}", "at least 1 value"),
    ('outputs = {"position": "m", "acceleration": "m/s^2"}', "", "outputs is missing", "give it"),
    ("parameters = {", "parameters = {'list': [1], ", "parameters.list = [1]", "a number"),
    ("def build(mbs, p)", "def build(mbs)", "build(mbs);", "expected a function build(mbs, p)"),
    ("def build(", "def other(", "build = None", "expected a function"),
    ("p.mass", "p.weight", "no parameter 'weight'", "model.py, line 14)"),
    ('"N"}', '"N"', "SyntaxError", "correct the model"),
    ("def build(mbs, p):", "def build(mbs, p):\n    return None", "added no object", "expected"),
    (LOAD, "mbs.SetPreStepUserFunction(lambda mbs, t: True)", "pre-step user", "expected none"),
    (LOAD, LOAD_7, "ModelError: ", "invalid marker number 7"),
    (LOAD, NO_DIRECTION, "the vector of the load of that name is [0.0, 0.0, 0.0]", "give load"),
    (LOAD, OWN_LOAD, "has a user function", "expected none"),
    (SPRING, OWN_SPRING + "[][1])", "IndexError", "line 17"),
    (SPRING, OWN_SPRING + "float('nan'))", "= nan", "expected"),
]
"""What is replaced in the oscillator, by what, and two key words of what is then said."""


@pytest.mark.parametrize(("before", "after", "found", "expected"), MISTAKES)
def test_mistake_in_a_model_file_is_named(
    tmp_path: Path, before: str, after: str, found: str, expected: str
) -> None:
    path = model(tmp_path, OSCILLATOR, (before, after))
    with refused(LoadError, found, expected):
        describe(path)


@pytest.mark.parametrize(
    ("parameters", "found", "expected"),
    [
        ({"weight": 3.0}, "unknown parameters ['weight']", "expected some of ['damping'"),
        ({"integrator": "euler"}, "integrator = 'euler'", "'auto'"),
        ({"start": 1}, "start = 1", "expected the type of"),
        ({"start": "here"}, "start = 'here'", "'equilibrium' or 'initial'"),
        ({"substeps": -1}, "substeps = -1", "expected at least 0"),
        ({"substeps": "auto"}, "substeps = 'auto'", "expected the type of the model's value, 0"),
        ({"substeps": 2.5}, "substeps = 2.5", "expected a whole number"),
        ({"substeps": True}, "substeps = True", "expected"),
    ],
)
def test_parameter_that_does_not_fit_is_named(
    tmp_path: Path, parameters: dict[str, Any], found: str, expected: str
) -> None:
    with refused(LoadError, found, expected):
        system_of(model(tmp_path, OSCILLATOR), **parameters)


def test_explicit_integrator_refuses_parameters_that_move(tmp_path: Path) -> None:
    declared = '{"force": {"unit": "m", "parameter": "spring.offset"}}'
    path = model(tmp_path, OSCILLATOR, ('{"force": "N"}', declared), (LOAD, "pass"))
    with refused(LoadError, "moves within a step"):
        system_of(path, "first_order", integrator="explicit")


def test_angle_that_turns_within_a_step_is_refused(tmp_path: Path) -> None:
    pair = """{"force": {"unit": "1", "angle": "cosine"}, "sine": {"unit": "1", "angle": "sine"}}
hold = "first_order\""""
    path = model(tmp_path, OSCILLATOR, ('{"force": "N"}', pair))
    with refused(LoadError, "['force', 'sine'] are cosine", "cosine and"):
        describe(path)


def test_failure_of_a_step_says_when_and_under_what_input(tmp_path: Path) -> None:
    function = "lambda mbs, t, n, u, v, k, d, o: [k * u + d * v][u > 0.3]"
    spring = f"{SPRING[:-1]}, springForceUserFunction={function})"
    system = system_of(model(tmp_path, OSCILLATOR, (SPRING, spring)))
    with refused(SimulationError, "in sample 17 (t = 0.17 s) under [90.0]: exudyn", "IndexError"):
        simulate(system, np.concatenate([np.zeros((5, 1)), np.full((200, 1), 90.0)]))
    assert np.isfinite(simulate(system, np.zeros((5, 1))).outputs).all()


def test_motion_that_diverges_is_an_error(tmp_path: Path) -> None:
    function = "lambda mbs, t, n, u, v, k, d, o: k * u + d * v - 1e9 * u * u * u"
    spring = f"{SPRING[:-1]}, springForceUserFunction={function})"
    system = system_of(model(tmp_path, OSCILLATOR, (SPRING, spring)))
    with refused(SimulationError, "in sample 5 (t = 0.05 s) under [50.0]", "diverged"):
        simulate(system, np.concatenate([np.zeros((2, 1)), np.full((300, 1), 50.0)]))
