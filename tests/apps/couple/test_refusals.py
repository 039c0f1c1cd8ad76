"""Mistakes in coupled systems are refused before anything runs."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import slide_fmu as slide
from slide_fmu.apps.couple.structure import (
    Link,
    Pin,
    coupled_system,
    default_step,
    require_equal_units,
)
from slide_fmu.core.files import write_zip
from slide_fmu.importer.calls import GuardedCalls
from slide_fmu.importer.errors import CoSimulationError, FmuError
from tests.own_models.halves.cut_car import LINKS
from tests.own_models.quarter_car import build_in_c
from tests.refusals import refused

ROOT = Path(__file__).parents[3]
DUFFING = ROOT / "fmus" / "duffing" / "duffing.fmu"
CRANK = ROOT / "fmus" / "slider_crank" / "slider_crank.fmu"
LOOP = [("one.y", "two.u"), ("two.y", "one.u")]


@pytest.mark.parametrize(
    ("connections", "words"),
    [
        ([("lowr.force", "upper.force")], ("'lowr'", "did you mean 'lower'?")),
        ([("lower.forse", "upper.force")], ("no output 'forse'", "did you mean 'force'?")),
        ([("lower.force", "upper.speed")], ("no input 'speed'", "'force'")),
        ([*LINKS, ("upper.speed", "lower.body")], ("'lower.body'", "one source")),
        ([("force", "upper.force")], ("COMPONENT.VARIABLE",)),
    ],
)
def test_wrong_connection_is_refused(
    halves: dict[str, Path], connections: list[tuple[str, str]], words: tuple[str, ...]
) -> None:
    with refused(ValueError, *words):
        slide.couple(halves, connections, step=0.01, stop=1.0)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"method": "euler"}, ("method = 'euler'", "newton")),
        ({"extrapolation": "cubic"}, ("extrapolation = 'cubic'", "linear")),
        ({"control": "yes"}, ("control = 'yes'", "halving")),
        ({"method": "jacobi", "control": "predictor"}, ("'predictor'", "'halving'")),
        ({"stop": 0.015}, ("1.5 steps", "whole number")),
        ({"step": -0.01}, ("step = -0.01", "positive")),
        ({"tolerance": np.float64(-1.0)}, ("tolerance = -1.0", "positive")),
        ({"error": np.float64(0.01)}, ("error = 0.01 has no effect", "'halving'")),
        ({"error": 0.01}, ("error = 0.01 has no effect", "control = None", "'halving'")),
        ({"extrapolation": "zero"}, ("extrapolation = 'zero' has no effect", "'newton'", "leave")),
        ({"method": "jacobi", "iterations": 9}, ("iterations = 9 has no effect", "'newton'")),
        ({"moving": ["wheel"]}, ("moving = ['wheel']", "lower")),
        ({"inputs": {"lower.body": 0.0}}, ("lower.body", "one source")),
        ({"inputs": {"lower.road": ([0, 0], [1, 2])}}, ("lower.road", "rise")),
        ({"inputs": {"lower.road": "flat"}}, ("'lower.road' = 'flat'", "expected a number")),
        ({"inputs": {"lower.road": float("nan")}}, ("lower.road = nan", "finite")),
        ({"parameters": {"upper.weight": 1.0}}, ("no variable 'weight'",)),
        ({"parameters": {"upper.mass": float("nan")}}, ("upper.mass = nan", "finite")),
        ({"record": ["upper.height"]}, ("'height'", "position")),
    ],
)
def test_wrong_option_is_refused(
    halves: dict[str, Path], options: dict[str, Any], words: tuple[str, ...]
) -> None:
    with refused(ValueError, *words):
        slide.couple(halves, LINKS, **{"step": 0.01, "stop": 1.0, **options})


@pytest.mark.parametrize("call", ["fmi2ExitInitializationMode", "fmi2GetReal", "fmi2Terminate"])
def test_call_that_is_refused_without_a_reason_names_its_component(
    call: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = GuardedCalls.__call__

    def refuse(calls: GuardedCalls, name: str, *arguments: Any) -> Any:
        if calls.label == "component 'one'" and name == call:
            raise calls.failed(name, 3)
        return real(calls, name, *arguments)

    monkeypatch.setattr(GuardedCalls, "__call__", refuse)
    with refused(CoSimulationError, "component 'one'", call, "run this FMU alone"):
        slide.couple({"one": DUFFING, "two": DUFFING}, [], step=0.03, stop=0.3)


def test_different_units_are_refused() -> None:
    fmus = {"crank": CRANK, "spring": DUFFING}
    with refused(ValueError, "'crank.deflection' is in m", "'spring.force' in N"):
        slide.couple(fmus, [("crank.deflection", "spring.force")], step=0.03, stop=0.3)


@pytest.mark.parametrize(("other", "same"), [("metre", True), ("mm", False)])
def test_units_of_other_names_are_equal_if_their_definitions_are(
    tmp_path: Path, other: str, same: bool
) -> None:
    renamed = tmp_path / "crank.fmu"
    with zipfile.ZipFile(CRANK) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    text = members["modelDescription.xml"].decode()
    factor = "" if same else ' factor="0.001"'
    text = text.replace('unit="m"', f'unit="{other}"').replace('name="m"', f'name="{other}"')
    text = text.replace('<BaseUnit m="1"', f'<BaseUnit m="1"{factor}')
    write_zip(renamed, {**members, "modelDescription.xml": text.encode()})
    system = coupled_system({"crank": renamed, "other": CRANK}, [], {}, {})
    pins = Pin("crank", "deflection"), Pin("other", "deflection")
    if same:
        require_equal_units(system, Link(*pins))
    else:
        with refused(ValueError, f"'crank.deflection' is in {other}", "in m"):
            require_equal_units(system, Link(*pins))


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"connections": None}, ("connections = None", "list of pairs")),
        ({"connections": [5]}, ("connection 5", "pair")),
        ({"inputs": ["one.force"]}, ("inputs = ['one.force']", "dict")),
        ({"inputs": {"one.force": lambda t: "x"}}, ("'one.force' = 'x' at 0 s", "finite")),
        ({"parameters": {"one.confidence": "high"}}, ("one.confidence = 'high'", "finite")),
        ({"stop": None}, ("stop = None", "time in s")),
        ({"step": 1e-300}, ("step = 1e-300", "choose a longer step")),
        ({"record": "one.force"}, ("record = 'one.force'", "list")),
        ({"fmus": {"": DUFFING}}, ("component ''", "expected a name")),
    ],
)
def test_arguments_of_a_wrong_kind_are_refused(
    given: dict[str, Any], words: tuple[str, ...]
) -> None:
    usual = {"fmus": {"one": DUFFING}, "connections": [], "step": 0.03, "stop": 0.3}
    arguments = {**usual, **given}
    with refused(ValueError, *words):
        slide.couple(arguments.pop("fmus"), arguments.pop("connections"), **arguments)


def test_fmu_of_fmi_1_is_refused(tmp_path: Path) -> None:
    old = tmp_path / "old.fmu"
    with zipfile.ZipFile(DUFFING) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    text = members["modelDescription.xml"].decode().replace('fmiVersion="2.0"', 'fmiVersion="1.0"')
    write_zip(old, {**members, "modelDescription.xml": text.encode()})
    with refused(FmuError, "component 'old'", "is of FMI 1.0", "export it again"):
        slide.couple({"old": old}, [], step=0.03, stop=0.3)


@pytest.mark.parametrize(
    ("name", "fmu", "step"),
    [("inputs_at_step_end", CRANK, 0.03125), ("inputs_held", DUFFING, 0.03)],
)
def test_parameter_that_the_coupling_sets_is_refused(name: str, fmu: Path, step: float) -> None:
    given = {f"one.{name}": 0.0}
    with refused(ValueError, "'one'", f"{name} = 0.0", "leave it out"):
        slide.couple({"one": fmu}, [], step=step, stop=2 * step, parameters=given)


def test_fmu_for_model_exchange_is_refused(tmp_path: Path) -> None:
    car = build_in_c(tmp_path / "car.fmu")
    with refused(CoSimulationError, "component 'car'", "for model exchange", "co-simulation"):
        slide.couple({"car": car}, [], step=0.01, stop=0.1)


def test_missing_file_is_named() -> None:
    with refused(FmuError, "component 'car'", "no file 'nope.fmu'"):
        slide.couple({"car": "nope.fmu"}, [], step=0.01, stop=0.1)


def test_circle_of_feedthrough_is_refused_by_explicit_methods(tmp_path: Path) -> None:
    gain = write_gain(tmp_path)
    loop, links = {"one": gain, "two": gain}, LOOP
    with refused(CoSimulationError, "['one', 'two']", "algebraic loop", "'newton'"):
        slide.couple(loop, links, step=0.1, stop=0.2, method="jacobi")
    run = slide.couple(loop, links, step=0.1, stop=0.2)
    assert run["one.y"][-1] == pytest.approx(1 / (1 - 0.5), rel=1e-4)  # y = 1 + u / 2, twice


def test_loop_with_singular_derivatives_names_the_input(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def singular(*_: Any) -> None:
        raise np.linalg.LinAlgError("Singular matrix")

    loop, links = dict.fromkeys(("one", "two"), write_gain(tmp_path)), LOOP
    monkeypatch.setattr(np.linalg, "solve", singular)
    with refused(CoSimulationError, "and its source differ by", "choose a shorter step"):
        slide.couple(loop, links, step=0.1, stop=0.2)


@pytest.mark.parametrize("method", ["newton", "fixed_point"])
def test_loop_without_a_solution_is_refused(tmp_path: Path, method: str) -> None:
    """y = 1 + u / 2 with u = 1 + y^2; first values grow from exchange to exchange."""
    loop = dict.fromkeys(("one", "two"), write_gain(tmp_path))
    square = {"two.gain": 0.0, "two.square": 1.0}
    with refused(CoSimulationError, "and its source differ by", "expected agreement"):
        slide.couple(loop, LOOP, step=0.1, stop=0.2, method=method, parameters=square)


def test_loop_whose_first_values_grow_is_solved_all_the_same(tmp_path: Path) -> None:
    one, steep = {"one": write_gain(tmp_path)}, {"one.gain": 100.0}
    run = slide.couple(one, [("one.y", "one.u")], step=0.1, stop=0.2, parameters=steep)
    assert run["one.y"][-1] == pytest.approx(-1 / 99, rel=1e-3)  # y = 1 + 100 u


def test_first_values_of_an_algebraic_loop_agree_where_there_is_a_solution(tmp_path: Path) -> None:
    loop = dict.fromkeys(("one", "two"), write_gain(tmp_path))
    run = slide.couple(loop, LOOP, step=0.1, stop=0.2)
    assert run["one.y"][0] == pytest.approx(2, abs=1e-9)
    assert run.figures.remarks == []
    with pytest.raises(CoSimulationError):  # u = 1 + u has no solution
        slide.couple(loop, LOOP, step=0.1, stop=0.2, parameters={"one.gain": 1, "two.gain": 1})


def test_step_is_asked_for_where_no_fmu_names_one(halves: dict[str, Path]) -> None:
    with refused(ValueError, "no FMU names a step", "--step"):
        default_step(coupled_system({"upper": halves["upper"]}, [], {}, {}))


def test_step_that_is_no_multiple_is_refused(tmp_path: Path) -> None:
    gain = write_gain(tmp_path, canHandleVariableCommunicationStepSize="false")
    with refused(ValueError, "multiple of 0.1 s", "'one'"):
        slide.couple({"one": gain}, [], step=0.25, stop=0.5)


def write_gain(folder: Path, **options: str) -> Path:
    """Write an FMU whose output follows its input at once."""
    from tests.python_fmus import write_python_fmu

    script = ROOT / "tests" / "own_models" / "gain_slave.py"
    path = folder / "gain.fmu"
    return write_python_fmu("Gain", script, path, **{"canGetAndSetFMUstate": "true", **options})
