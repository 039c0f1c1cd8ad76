"""Solvers of all kinds of systems are loosened, as far as they can be."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.base import System
from slide_fmu.systems.declared import SignalTable
from slide_fmu.systems.function.whole_motion import WHOLE
from slide_fmu.systems.loading import load_system
from slide_fmu.systems.looser import Rung, ladders
from slide_fmu.systems.simulation import simulate
from slide_fmu.systems.specification import Specification
from tests.systems.exudyn_models import OSCILLATOR

STEP = 0.1

DUFFING = """
inputs = {"u": {"unit": "N", "range": [-9, 9]}}
outputs = {"y": {"unit": "m", "range": [-9, 9]}}
start = [0.0, 0.0]

def f(x, u, p):
    return [x[1], u[0] - 20 * x[0] - x[1] - 3 * x[0] ** 3]

def g(x, u, p):
    return [x[0]]
"""

RECORD = """
inputs = {"u": {"unit": "1", "range": [-9, 9]}}
outputs = {"y": {"unit": "1", "range": [-9, 9]}}
PARAMETERS

def simulate(t, u, p):
    return u
"""

INPUTS = 3 * np.sin(np.arange(60.0))[:, None]


def made_from(folder: Path, text: str, kind: str = "function") -> Specification:
    path = folder / "model.py"
    path.write_text(text, encoding="utf-8")
    return Specification(str(path), {}, STEP, kind)


def errors(rungs: list[Rung], truth: FloatArray) -> list[float]:
    return [float(np.abs(simulate(one.make(), INPUTS).outputs - truth).max()) for one in rungs]


def found(made: Specification) -> tuple[System, list[list[Rung]]]:
    system = load_system(made)
    return system, ladders(system, made)


def test_tolerances_of_a_function_are_loosened_and_simpler_methods_are_tried(
    tmp_path: Path,
) -> None:
    system, (own, *others) = found(made_from(tmp_path, DUFFING))
    whole = [f"{method} ({WHOLE})" for method in ("RK45", "DOP853", "LSODA")]
    solvers = [ladder[0].solver for ladder in (own, *others)]
    assert solvers == ["DOP853", *whole, "RK45", "RK23"]
    assert own[0].setting == "rtol = 1e-06, atol = 1e-09"
    assert own[-1].setting == "rtol = 0.1, atol = 0.0001"
    truth = simulate(system, INPUTS).outputs
    assert errors(own[:1], truth) == [0.0]
    fine, coarse = errors([others[0][0], others[0][-1]], truth)
    assert 0 < 10 * fine < coarse


def test_implicit_method_is_loosened_alone(tmp_path: Path) -> None:
    _, rungs = found(made_from(tmp_path, DUFFING + 'method = "LSODA"\nrtol = 1e-3\n'))
    own, *whole = rungs
    assert [one.solver for one in own] == 5 * ["LSODA"]
    assert all(WHOLE in ladder[0].solver for ladder in whole)


@pytest.mark.parametrize(
    ("parameters", "settings"),
    [
        ('parameters = {"rtol": 0.01}', ["tolerance 0.01", "tolerance 0.032", "tolerance 0.1"]),
        ('parameters = {"substeps": 4}', ["25 ms", "33.3 ms", "50 ms", "100 ms"]),
        ("", ["as it is"]),
    ],
)
def test_function_of_whole_records_is_loosened_by_its_own_parameters(
    tmp_path: Path, parameters: str, settings: list[str]
) -> None:
    _, rungs = found(made_from(tmp_path, RECORD.replace("PARAMETERS", parameters)))
    (own,) = rungs
    assert [one.setting.removeprefix("steps of ") for one in own] == settings
    assert own[0].solver == "its own solver"


def test_substeps_of_an_exudyn_model_are_those_that_it_found_itself(tmp_path: Path) -> None:
    ranged = {name: SignalTable(range=(-9, 9)) for name in ("force", "position", "acceleration")}
    made = made_from(tmp_path, OSCILLATOR, "exudyn")
    tables = {name: ranged[name] for name in ("position", "acceleration")}
    made = replace(made, inputs={"force": ranged["force"]}, outputs=tables)
    system, (own,) = found(made)
    assert own[0].solver == "RK67"
    truth = simulate(system, INPUTS).outputs
    first, *others = errors(own, truth)
    assert first == 0.0 < others[-1]


def test_substeps_of_a_class_are_loosened() -> None:
    model = "mbs_models.slider_crank:SliderCrank"
    made = Specification(model, {"substeps": 3, "elements": 2}, 1 / 32)
    _, (own,) = found(made)
    assert own[0].solver == "generalized-alpha"
    settings = [one.setting for one in own]
    assert settings == ["steps of 10.4 ms", "steps of 15.6 ms", "steps of 31.2 ms"]


def test_object_that_is_no_function_is_compared_as_it_is() -> None:
    model = "mbs_models.oscillators:DuffingOscillator"
    system = load_system(Specification(model, {}, 0.03))
    (own,) = ladders(system, replace(Specification("given", {}, 0.03, "object"), given=system))
    (rung,) = own
    assert (rung.solver, rung.setting) == ("RK67", "as it is")
    assert rung.make() is system
