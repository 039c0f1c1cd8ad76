"""A reference FMU is the system it names."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave
from fmpy.validation import validate_fmu

import slide_fmu as slide
from slide_fmu.apps.reference.reference_slave import write_reference_fmu
from slide_fmu.apps.reference.side_by_side import write_reference
from slide_fmu.core.files import OLDEST
from slide_fmu.core.signals import FloatArray, hold_of
from slide_fmu.cosim.whole_run import run_fmu
from slide_fmu.fmu.export import read_fmu
from slide_fmu.importer.errors import CoSimulationError, FmuError
from slide_fmu.importer.file import unpacked
from slide_fmu.importer.instance import instantiated
from slide_fmu.recipe.case import case_of
from slide_fmu.systems.base import State, System
from slide_fmu.systems.errors import LoadError
from slide_fmu.systems.loading import load_system
from slide_fmu.systems.simulation import simulate
from slide_fmu.systems.specification import Specification
from tests.limits import largest_file
from tests.refusals import refused
from tests.validation.tiny_validation import FINER

SAME = 1e-12
"""In m: the FMU calls the same code with the same numbers."""
MODELS = ["LinearOscillator", "DuffingOscillator", "DuffingBaseMotion"]


def dotted(name: str) -> str:
    return f"mbs_models.oscillators:{name}"


@contextmanager
def instance(path: Path, start: dict[str, float], from_state: bool = False) -> Iterator[FMU2Slave]:
    """An initialized instance of an FMU, with start values by name."""
    description = fmpy.read_model_description(path)
    references = {v.name: v.valueReference for v in description.modelVariables}
    slave = FMU2Slave(
        guid=description.guid,
        unzipDirectory=str(fmpy.extract(path)),
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName="test",
    )
    slave.instantiate(loggingOn=True)
    slave.setupExperiment(startTime=0.0)
    slave.setBoolean([references["start_from_state"]], [from_state])
    slave.setReal([references[name] for name in start], list(start.values()))
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    yield slave
    slave.terminate()
    slave.freeInstance()


def run(slave: FMU2Slave, inputs: FloatArray, step: float) -> FloatArray:
    """Outputs, shape (N + 1, 1); the input has value reference 0, the output 1."""
    outputs = [slave.getReal([1])]
    for k, row in enumerate(inputs):
        slave.setReal([0], list(row))
        slave.doStep(k * step, step)
        outputs.append(slave.getReal([1]))
    return np.array(outputs)


def parts_of(system: System, state: State) -> dict[str, float]:
    parts = {
        "initial_coordinates[0]": state.coordinates[0],
        "initial_velocities[0]": state.velocities[0],
    }
    return parts | (
        {"initial_last_input[0]": state.last_input[0]}
        if hold_of(system.inputs) == "first_order"
        else {}
    )


@pytest.mark.parametrize("name", MODELS)
def test_reference_fmu_equals_the_model(name: str, tmp_path: Path) -> None:
    system = load_system(Specification(dotted(name), {"damping": 5.0}))
    path = write_reference_fmu(
        Specification(dotted(name), {"damping": 5.0}), tmp_path / "reference.fmu"
    )
    assert validate_fmu(str(path)) == []
    rng = np.random.default_rng(2)
    for _ in range(3):
        signal = system.inputs[0]
        inputs = rng.uniform(signal.low, signal.high, (40, 1))
        start = system.random_state(rng)
        expected = simulate(system, inputs, start).outputs
        with instance(path, parts_of(system, start), from_state=True) as slave:
            assert np.max(np.abs(run(slave, inputs, system.step) - expected)) < SAME


@pytest.mark.parametrize("name", MODELS)
def test_it_starts_at_rest_under_the_first_input(name: str, tmp_path: Path) -> None:
    system = load_system(Specification(dotted(name), {}))
    path = write_reference_fmu(Specification(dotted(name), {}), tmp_path / "reference.fmu")
    first = 0.5 * system.inputs[0].high
    with instance(path, {system.inputs[0].name: first}) as slave:
        found = run(slave, np.full((20, 1), first), system.step)
    expected = system.rest_state(np.array([first])).coordinates
    assert np.max(np.abs(found - expected)) < SAME


def test_commands_about_surrogates_say_what_a_reference_fmu_is(tmp_path: Path) -> None:
    path = write_reference_fmu(Specification(dotted(MODELS[0]), {}), tmp_path / "reference.fmu")
    with refused(FmuError, "written by slide-fmu reference", "slide-fmu init"):
        read_fmu(path)


def test_reference_fmu_is_simulated_by_fmpy(tmp_path: Path) -> None:
    system = load_system(Specification(dotted("DuffingOscillator"), {}))
    path = write_reference_fmu(
        Specification(dotted("DuffingOscillator"), {}), tmp_path / "reference.fmu"
    )
    inputs = np.random.default_rng(0).uniform(-1000, 1000, (30, 1))
    columns = np.zeros(30, dtype=[("time", float), ("force", float)])
    columns["time"], columns["force"] = system.step * np.arange(30), inputs[:, 0]
    result = fmpy.simulate_fmu(
        str(path),
        stop_time=30 * system.step,
        output_interval=system.step,
        input=columns,
        output=["position"],
        start_values={"start_from_state": True, "initial_coordinates[0]": 0.4},
    )
    start = State(np.array([0.4]), np.zeros(1), np.zeros(1))
    expected = simulate(system, inputs, start).outputs[:, 0]
    assert np.max(np.abs(result["position"] - expected)) < SAME


def test_model_description_carries_units_ranges_and_step(tmp_path: Path) -> None:
    path = write_reference_fmu(
        Specification(dotted("DuffingOscillator"), {}), tmp_path / "reference.fmu"
    )
    description = fmpy.read_model_description(path)
    force, position = description.modelVariables[:2]
    assert (force.name, force.causality, force.unit, force.min) == (
        "force",
        "input",
        "N",
        "-1000.0",
    )
    assert (position.name, position.causality, position.unit) == ("position", "output", "m")
    assert float(description.defaultExperiment.stepSize) == 0.03
    assert not description.coSimulation.canHandleVariableCommunicationStepSize
    again = write_reference_fmu(
        Specification(dotted("DuffingOscillator"), {}), tmp_path / "again.fmu"
    )
    assert fmpy.read_model_description(again).guid == description.guid


def test_inputs_start_where_their_signals_say(tmp_path: Path) -> None:
    model = "mbs_models.slider_crank:SliderCrank"
    path = write_reference_fmu(Specification(model, {}), tmp_path / "reference.fmu")
    inputs = fmpy.read_model_description(path).modelVariables[:2]
    assert [float(variable.start) for variable in inputs] == [1.0, 0.0]
    assert validate_fmu(str(path)) == []


@pytest.mark.parametrize("step", [0.02, 0.06, 0.0301])
def test_other_communication_steps_are_refused(
    step: float, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = write_reference_fmu(
        Specification(dotted("DuffingOscillator"), {}), tmp_path / "reference.fmu"
    )
    with instance(path, {}) as slave:
        with pytest.raises(FMICallException):
            slave.doStep(0.0, step)
        slave.doStep(0.0, 0.03)
    assert "expected the sample step 0.03 s" in capfd.readouterr().out


def test_steps_in_nanoseconds_are_taken(tmp_path: Path) -> None:
    path = write_reference_fmu(
        Specification(dotted("DuffingOscillator"), {"step": 1 / 60}), tmp_path / "reference.fmu"
    )
    with instance(path, {"force": 10.0}) as slave:
        slave.doStep(0.0, 1e-9 * round(1e9 / 60))


def test_input_that_is_not_a_number_is_refused(tmp_path: Path) -> None:
    path = write_reference_fmu(
        Specification(dotted("DuffingOscillator"), {}), tmp_path / "reference.fmu"
    )
    with instance(path, {}) as slave:
        slave.setReal([0], [np.nan])
        with pytest.raises(FMICallException):
            slave.doStep(0.0, 0.03)


def test_instances_of_several_fmus_do_not_disturb_each_other(tmp_path: Path) -> None:
    """Needs the spare references that ``SystemSlave`` keeps for PythonFMU."""
    paths = [
        write_reference_fmu(Specification(dotted(name), {}), tmp_path / f"{name}.fmu")
        for name in MODELS
    ]
    for _ in range(3):
        with instance(paths[0], {}) as linear, instance(paths[1], {}) as duffing:
            linear.setReal([0], [100.0])
            for k in range(3):
                linear.doStep(k / 64, 1 / 64)
                duffing.doStep(k * 0.03, 0.03)
            assert linear.getReal([1])[0] > 0.0
            assert duffing.getReal([1])[0] == 0.0


def test_mistakes_are_named_before_anything_is_written(tmp_path: Path) -> None:
    with refused(LoadError, "Missing"):
        write_reference_fmu(Specification(dotted("Missing"), {}), tmp_path / "reference.fmu")
    with refused(ValueError, "ending in .fmu"):
        write_reference_fmu(
            Specification(dotted("LinearOscillator"), {}), tmp_path / "reference.zip"
        )
    assert list(tmp_path.iterdir()) == []


def test_it_is_the_same_file_every_time(tmp_path: Path) -> None:
    paths = [
        write_reference_fmu(Specification(dotted(MODELS[0]), {}), tmp_path / f"{k}.fmu")
        for k in range(2)
    ]
    assert paths[0].read_bytes() == paths[1].read_bytes()
    with zipfile.ZipFile(paths[0]) as archive:
        assert {info.date_time for info in archive.infolist()} == {OLDEST}
        assert b"generationDateAndTime" not in archive.read("modelDescription.xml")


def test_an_fmu_that_cannot_be_written_stays_as_it_was(tmp_path: Path) -> None:
    path = write_reference_fmu(Specification(dotted(MODELS[0]), {}), tmp_path / "reference.fmu")
    before = path.read_bytes()
    with largest_file(len(before) // 2), refused(OSError, "File too large"):
        write_reference_fmu(Specification(dotted(MODELS[1]), {}), path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_a_folder_is_no_fmu(tmp_path: Path) -> None:
    folder = tmp_path / "d.fmu"
    folder.mkdir()
    with pytest.raises(IsADirectoryError):
        write_reference_fmu(Specification(dotted(MODELS[0]), {}), folder)
    assert list(tmp_path.rglob("*")) == [folder]


def test_reset_starts_anew(tmp_path: Path) -> None:
    path = write_reference_fmu(
        Specification(dotted("DuffingOscillator"), {}), tmp_path / "reference.fmu"
    )
    with instance(path, {}) as slave:
        first = run(slave, np.full((5, 1), 500.0), 0.03)
        slave.reset()
        slave.setupExperiment(startTime=0.0)
        slave.enterInitializationMode()
        slave.exitInitializationMode()
        assert np.array_equal(run(slave, np.full((5, 1), 500.0), 0.03), first)


def test_it_carries_the_licences_of_what_it_holds(tmp_path: Path) -> None:
    path = write_reference_fmu(
        Specification(dotted("LinearOscillator"), {}), tmp_path / "reference.fmu"
    )
    with zipfile.ZipFile(path) as archive:
        texts = {n: archive.read(n).decode() for n in archive.namelist() if "/licenses/" in n}
    folder = "documentation/licenses"
    assert texts.keys() == {f"{folder}/{n}.txt" for n in ("license", "pythonfmu", "slide-fmu")}
    assert "Permission is hereby granted" in texts[f"{folder}/pythonfmu.txt"]
    assert "PythonFMU 0.7" in texts[f"{folder}/license.txt"]


def test_exported_reference_is_the_one_that_is_measured_against(tmp_path: Path) -> None:
    path = write_reference(case_of(FINER), tmp_path / "reference.fmu")
    system = case_of(FINER).reference
    force = np.random.default_rng(0).uniform(-1000, 1000, 40)
    expected = simulate(system, force[:, None], system.rest_state(force[:1])).outputs
    with unpacked(path) as files:
        names = [system.inputs[0].name], [system.outputs[0].name]
        found = run_fmu(files, {names[0][0]: force}, names[1])
    assert found.values == pytest.approx(expected, abs=1e-12)


def test_reference_fmu_goes_back_to_a_former_state(tmp_path: Path) -> None:
    """Inputs move, so that the state has the last one too."""
    fmu = write_reference_fmu(Specification(dotted("DuffingBaseMotion")), tmp_path / "base.fmu")
    with unpacked(fmu) as files, instantiated(files) as slave:
        inputs = [v.name for v in files.variables.values() if v.causality == "input"]
        road, out = slave.variables(inputs), slave.variables(["position"])
        slave.set_up({})
        slave.enter_initialization()
        slave.exit_initialization()
        outputs = []
        for value in (0.01, 0.03):
            road.set([value])
            slave.do_step(files.step * len(outputs), files.step)
            outputs.append(out.get())
            if len(outputs) == 1:
                state = slave.save()
        for _ in range(2):
            slave.restore(state)
            road.set([0.03])
            slave.do_step(files.step, files.step)
            assert out.get() == outputs[1]
        slave.free_state(state)
        slave.terminate()


LAW = """
inputs = {{"u": {{"unit": "N", "range": [-1.0, 1.0]}}}}
outputs = {{"y": {{"unit": "N", "range": [-9.0, 9.0]}}}}
start = [0.0]


def f(x, u, p):
    return [-x[0]]


def g(x, u, p):
    return [{gain} * u[0]]
"""


def test_models_of_one_file_name_are_kept_apart_and_must_not_change(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    fmus = {}
    for gain, name in enumerate(("one", "two"), start=1):
        (folder := tmp_path / name).mkdir()
        (folder / "model.py").write_text(LAW.format(gain=gain), encoding="utf-8")
        monkeypatch.chdir(folder)
        made = Specification("model.py", {}, 0.1, "function", {})
        fmus[name] = write_reference_fmu(made, tmp_path / f"{name}.fmu")
    inputs = {f"{name}.u": 1.0 for name in fmus}
    for folder in (tmp_path / "one", tmp_path):  # in a folder with a model of this name, and not
        monkeypatch.chdir(folder)
        found = slide.couple(fmus, [], step=0.1, stop=0.2, inputs=inputs)
        assert [found[f"{name}.y"][-1] for name in fmus] == [1.0, 2.0]
    (tmp_path / "two" / "model.py").write_text(LAW.format(gain=3), encoding="utf-8")
    with refused(CoSimulationError, "component 'two'", "tell more on the terminal"):
        slide.couple(fmus, [], step=0.1, stop=0.2, inputs=inputs)
    assert "has changed since this FMU was made from it" in capfd.readouterr().err
    (tmp_path / "two" / "model.py").unlink()
    with refused(CoSimulationError, "component 'two'"):
        slide.couple(fmus, [], step=0.1, stop=0.2, inputs=inputs)
    assert "slide-fmu reference" in capfd.readouterr().err
