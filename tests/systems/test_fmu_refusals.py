"""What an FMU says about itself is found; what does not fit is refused with the remedy."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from slide_fmu.systems.base import System
from slide_fmu.systems.declared import DeclaredParameter, SignalTable, SignalTables
from slide_fmu.systems.errors import LoadError, SimulationError
from slide_fmu.systems.fmu.model import describe
from slide_fmu.systems.loading import load_system
from slide_fmu.systems.simulation import simulate
from slide_fmu.systems.specification import Specification
from tests.refusals import refused

ROAD = {"road": SignalTable(range=(-0.05, 0.05))}
TRAVEL = {"suspension_travel": SignalTable(range=(-0.2, 0.2))}


def made(
    fmu: str,
    inputs: SignalTables = ROAD,
    outputs: SignalTables = TRAVEL,
    **parameters: Any,
) -> System:
    return load_system(Specification(fmu, parameters, 0.005, "fmu", inputs, outputs))


def changed(fmu: str, path: Path, **replaced: str) -> str:
    """Copy an FMU with other words in its model description, or other names of its files."""
    with zipfile.ZipFile(fmu) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            content = old.read(name)
            for one, other in replaced.items():
                name = name.replace(one, other)
                content = (
                    content
                    if name.endswith(".so")
                    else content.replace(one.encode(), other.encode())
                )
            new.writestr(name, content)
    return str(path)


def test_an_fmu_is_described_with_signals_parameters_step_and_remarks(car: str) -> None:
    found = describe(car)
    assert found.kind == "fmu"
    assert found.inputs == {
        "road": SignalTable(
            unit="m",
            range=(-0.1, 0.1),
            description="height of the road",
            start=0.0,
            hold="first_order",
        )
    }
    names = ["body_acceleration", "suspension_travel", "tyre_deflection"]
    assert list(found.outputs) == names
    acceleration = SignalTable(unit="m/s2", description="acceleration of the body")
    assert found.outputs[names[0]] == acceleration
    assert found.parameters[0] == DeclaredParameter("body_mass", 300.0, "kg")
    assert len(found.parameters) == 7
    assert found.step == 0.005
    assert "model_exchange" in found.remarks[0]
    assert found.held_step == 0.005  # of co-simulation, which it has too


def test_types_of_fmi_3_give_units_and_ranges_and_arrays_are_left_out(tank: str) -> None:
    found = describe(tank)
    assert found.inputs == {
        "inflow": SignalTable(unit="m/s", range=(-1.0, 1.0), start=0.0, hold="first_order")
    }
    assert found.outputs == {"outflow": SignalTable(unit="m/s", range=(-1.0, 1.0))}
    assert found.step is None
    assert any("events" in remark for remark in found.remarks)


def test_signals_are_in_the_order_of_the_recipe_with_what_it_says(car: str) -> None:
    outputs = {"tyre_deflection": SignalTable(range=(-1.0, 1.0)), **TRAVEL}
    system = made(car, {"road": SignalTable(range=(0.01, 0.05))}, outputs)
    assert [signal.name for signal in system.outputs] == ["tyre_deflection", "suspension_travel"]
    road = system.inputs[0]
    assert (road.low, road.high, road.unit) == (0.01, 0.05, "m")
    assert road.start_value == 0.01  # that of the FMU, 0, is outside
    assert system.outputs[1].unit == "m"


@pytest.mark.parametrize(
    ("arguments", "found", "expected"),
    [
        ({"inputs": {"street": SignalTable()}}, "no input 'street'", "some of ['road']"),
        ({"outputs": {"road": SignalTable()}}, "no output 'road'", "expected some of"),
        ({"outputs": {"tyre_deflection": SignalTable()}}, "has no range", "[LOW, HIGH]"),
        ({"mass": 3.0}, "parameters ['mass'] are not there", "expected some of"),
        ({"spring": "soft"}, "'spring' = 'soft'", "expected a value of the type Real"),
        ({"spring": True}, "'spring' = True", "expected a value of the type Real"),
        ({"fmu-solver": "Heun"}, "fmu-solver = 'Heun'", "expected 'CVode' or 'Euler'"),
        ({"fmu-substeps": 0}, "fmu-substeps = 0", "expected at least 1"),
        ({"fmu-tolerance": 2.0}, "fmu-tolerance = 2.0", "expected less than 1"),
        ({"fmu-step": 0}, "fmu-step = 0", "expected more than 0"),
        ({"fmu-step": 0.003}, "fmu-step = 0.003 s, of which 1.66667 fill 0.005 s", "expected"),
        (
            {"fmu-step": 0.005, "fmu-interface": "model_exchange"},
            "fmu-step = 0.005 with model exchange",
            "expected co-simulation",
        ),
        ({"fmu-order": 2}, "fmu-order = 2 is not a known key", "'fmu-substeps'"),
    ],
)
def test_what_does_not_fit_the_fmu_is_refused(
    car: str, arguments: dict[str, Any], found: str, expected: str
) -> None:
    with refused(LoadError, found, expected):
        made(car, **arguments)


@pytest.mark.parametrize(
    ("inputs", "found", "expected"),
    [
        ("depths", "type Float64 array", "expected a real scalar"),
        ("mode", "type Int32", "expected"),
    ],
)
def test_arrays_and_whole_numbers_are_no_inputs(
    tank: str, inputs: str, found: str, expected: str
) -> None:
    with refused(LoadError, found, expected):
        made(tank, {inputs: SignalTable(range=(-1.0, 1.0))}, {"outflow": SignalTable()})


def test_an_input_that_is_no_signal_can_have_a_value(tank: str) -> None:
    system = made(tank, {"inflow": SignalTable()}, {"outflow": SignalTable()}, threshold=0.3)
    assert [signal.name for signal in system.inputs] == ["inflow"]
    with refused(LoadError, "expected a value of", "'mode' = 0"):
        made(tank, {"inflow": SignalTable()}, {"outflow": SignalTable()}, mode=0.5)


def test_an_fmu_for_other_platforms_is_refused_with_those_it_has(car: str, tmp_path: Path) -> None:
    other = changed(car, tmp_path / "other.fmu", linux64="win32")
    with refused(LoadError, "no library 'quarter_car.so' for 'linux64'", "['win32']"):
        made(other)


@pytest.mark.parametrize(
    ("content", "found", "expected"),
    [(None, "no", "file"), (b"no archive", "not an FMU that", "can be read")],
)
def test_a_file_that_is_no_fmu_is_refused(
    tmp_path: Path, content: bytes | None, found: str, expected: str
) -> None:
    path = tmp_path / "model.fmu"
    if content is not None:
        path.write_bytes(content)
    with refused(LoadError, found, expected):
        made(str(path))


def test_an_interface_or_version_that_is_not_there_is_refused(tank: str, tmp_path: Path) -> None:
    with refused(LoadError, "'co_simulation'; expected one of ['model_exchange']"):
        made(tank, (), (), **{"fmu-interface": "co_simulation"})
    old = tmp_path / "old.fmu"
    with zipfile.ZipFile(old, "w") as archive:
        archive.writestr(
            "modelDescription.xml",
            '<fmiModelDescription fmiVersion="1.0" modelName="old" modelIdentifier="old" guid="1" '
            'numberOfContinuousStates="0" numberOfEventIndicators="0">'
            "<ModelVariables/></fmiModelDescription>",
        )
    with refused(LoadError, "expected FMI 2", "2.0 or 3"):
        made(str(old))


def test_a_library_that_does_not_load_is_told_without_a_traceback(
    car: str, tmp_path: Path
) -> None:
    broken = tmp_path / "broken.fmu"
    with zipfile.ZipFile(car) as old, zipfile.ZipFile(broken, "w") as new:
        for name in old.namelist():
            new.writestr(name, b"no library" if name.endswith(".so") else old.read(name))
    system = made(str(broken))
    with refused(LoadError, "be instantiated"):
        simulate(system, np.zeros((3, 1)))


def test_a_first_step_that_fails_names_the_step_of_the_fmu(trap: str) -> None:
    system = load_system(Specification(trap, {}, 5e-4, "fmu", ROAD, TRAVEL))
    with refused(SimulationError, "window.step = 0.0005 s", "0.005 s", "of 0.005"):
        simulate(system, np.zeros((10, 1)))


def test_library_of_an_fmu_may_crash(car: str) -> None:
    assert made(car).may_crash
