"""FMUs that carry a torch module: the same variables, window and steps as native ones."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
import torch
from fmpy.fmi2 import FMU2Slave
from fmpy.validation import validate_fmu

import slide_fmu as slide
from slide_fmu.core.signals import FloatArray, Hold
from slide_fmu.fmu.export import MODULE, export_fmu, read_json
from slide_fmu.python_fmu.torch_export import export_module
from tests.fmu.samples import STEP
from tests.python_fmu.modules import (
    CLOSE,
    IN_RANGE,
    RESULTS,
    invoke,
    saved,
    start,
    surrogate_with,
)


def run(slave: FMU2Slave, inputs: FloatArray, steps: FloatArray, results: list[int]) -> FloatArray:
    """Results before the first step and after every one."""
    rows, time = [slave.getReal(results)], 0.0
    for row, step in zip(inputs, steps, strict=True):
        slave.setReal([0, 1], row.tolist())
        slave.doStep(time, step)
        time += step
        rows.append(slave.getReal(results))
    return np.array(rows)


STEPS = {
    "sample steps": np.full(40, STEP),
    "fractions": np.full(60, 0.3 * STEP),
    "multiples": np.tile([3 * STEP, STEP, 2 * STEP], 12),
    "any": np.random.default_rng(5).choice([0.01, 0.4, 1.0, 1.7, 2.0, 5.3], 80) * STEP,
    "longer than the window": np.tile([20.5 * STEP, STEP], 5),
}


@pytest.mark.parametrize("steps", STEPS.values(), ids=STEPS)
@pytest.mark.parametrize("parameters", [(), (1.0, 0.3, -0.4)], ids=["first held", "known"])
@pytest.mark.parametrize("hold", ["zero_order", "first_order"])
def test_module_fmu_gives_what_the_native_one_gives(
    hold: Hold, parameters: tuple[float, ...], steps: FloatArray, tmp_path: Path
) -> None:
    surrogate = surrogate_with(hold)
    native = export_fmu(surrogate, tmp_path / "native.fmu")
    path = export_module(*saved(surrogate, tmp_path, ".pt"), tmp_path / "module.fmu")
    rng = np.random.default_rng(1)
    inputs = rng.uniform(-2, 3, (len(steps), 2))
    inputs[4:8] = inputs[4]  # steps with the same held inputs are joined
    results = RESULTS
    slaves = [start(native, tmp_path / "a", *parameters), start(path, tmp_path / "b", *parameters)]
    expected, found = (run(slave, inputs, steps, results) for slave in slaves)
    np.testing.assert_allclose(found, expected, rtol=0, atol=8 * CLOSE)
    for slave in slaves:
        slave.freeInstance()


@pytest.mark.parametrize(("former", "hold"), [("held", "zero_order"), ("ramp", "first_order")])
def test_words_of_former_versions_for_the_hold_give_the_same_fmu(
    former: str, hold: Hold, tmp_path: Path
) -> None:
    module, description = saved(surrogate_with(hold), tmp_path, ".pt")
    contents = []
    for word in (hold, former):
        text = description.read_text(encoding="utf-8").replace(f'"{hold}"', f'"{word}"')
        assert f'hold = "{word}"' in text
        description.write_text(text, encoding="utf-8")
        contents.append(export_module(module, description, tmp_path / "m.fmu").read_bytes())
        description.write_text(text.replace(f'"{word}"', f'"{hold}"'), encoding="utf-8")
    assert contents[0] == contents[1]


def test_inputs_of_a_module_fmu_are_in_range_where_the_scaling_says(tmp_path: Path) -> None:
    surrogate = surrogate_with("zero_order")
    path = export_module(*saved(surrogate, tmp_path, ".pt"), tmp_path / "module.fmu")
    slave = start(path, tmp_path / "a")
    offset, scale = surrogate.input_scaling.offset, surrogate.input_scaling.scale
    inputs = np.array([offset - scale, offset + (1 + 0.5e-6) * scale] * 20)
    inputs[5, 1] = offset[1] + (1 + 2e-6) * scale[1]
    found = []
    for k, row in enumerate(inputs):
        slave.setReal([0, 1], row.tolist())
        slave.doStep(k * STEP, STEP)
        found += slave.getBoolean([IN_RANGE])
    n_in = surrogate.window.n_in
    assert found == [not 5 <= k < 5 + n_in for k in range(len(inputs))]
    slave.freeInstance()


@pytest.mark.parametrize("suffix", [".pt", ".pt2"])
def test_variables_of_a_module_fmu_are_those_of_a_native_one(suffix: str, tmp_path: Path) -> None:
    surrogate = surrogate_with("zero_order")
    native = export_fmu(surrogate, tmp_path / "native.fmu")
    path = export_module(*saved(surrogate, tmp_path, suffix), tmp_path / "module.fmu")
    assert validate_fmu(str(path)) == []
    own, other = (fmpy.read_model_description(str(p)) for p in (path, native))

    def facts(description: Any) -> list[Any]:
        return [
            (v.name, v.valueReference, v.type, v.causality, v.unit, v.min, v.max, v.start)
            for v in description.modelVariables
        ]

    assert facts(own) == facts(other)
    assert own.defaultExperiment.stepSize == other.defaultExperiment.stepSize
    assert own.coSimulation.needsExecutionTool
    assert own.coSimulation.canHandleVariableCommunicationStepSize
    assert own.coSimulation.canSerializeFMUstate
    assert "Needs Python with torch and numpy where it runs" in own.description


def test_state_of_a_module_fmu_comes_back_also_in_another_instance(tmp_path: Path) -> None:
    surrogate = surrogate_with("first_order")
    path = export_module(*saved(surrogate, tmp_path, ".pt"), tmp_path / "module.fmu")
    inputs = np.random.default_rng(2).uniform(-2, 3, (20, 2))
    one, two = start(path, tmp_path / "a"), start(path, tmp_path / "b")
    for k in range(10):
        one.setReal([0, 1], inputs[k].tolist())
        one.doStep(k * STEP, STEP)
    state = one.getFMUstate()
    data = one.serializeFMUstate(state)

    def rest(slave: FMU2Slave) -> list[list[float]]:
        rows = []
        for k in range(10, 20):
            slave.setReal([0, 1], inputs[k].tolist())
            slave.doStep(k * STEP, STEP)
            rows.append(slave.getReal(RESULTS))
        return rows

    expected = rest(one)
    one.setFMUstate(state)
    assert rest(one) == expected
    two.setFMUstate(two.deSerializeFMUstate(data))
    assert rest(two) == expected
    for slave in (one, two):
        slave.freeInstance()


ALONE = """
import sys
from importlib.machinery import PathFinder


class OnlyOwn:
    \"\"\"Finds PythonFMU in the FMU only.\"\"\"

    def find_spec(self, name, path=None, target=None):
        if name != "pythonfmu":
            return None
        return PathFinder.find_spec(name, [p for p in sys.path if p.endswith("resources")])


sys.meta_path.insert(0, OnlyOwn())
sys.meta_path[:] = [finder for finder in sys.meta_path if finder is not PathFinder] + [PathFinder]
sys.modules["slide_fmu"] = None  # importing it raises ImportError
import fmpy
print(fmpy.simulate_fmu(sys.argv[1], stop_time=0.1, output_interval=0.005)["y0"][-1])
print(sys.modules["pythonfmu"].__file__)
"""


def test_module_fmu_runs_without_slide_fmu_and_pythonfmu(tmp_path: Path) -> None:
    surrogate = surrogate_with("zero_order")
    path = export_module(*saved(surrogate, tmp_path, ".pt"), tmp_path / "module.fmu")
    command = [sys.executable, "-c", ALONE, str(path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    expected = surrogate.predict(surrogate.starts[None])[0, 0]
    value, own = done.stdout.splitlines()[-2:]
    assert abs(float(value) - expected) < 8 * CLOSE
    assert Path(own).parts[-3:] == ("resources", "pythonfmu", "__init__.py")


def test_info_says_what_a_module_fmu_needs(tmp_path: Path) -> None:
    module, description = saved(surrogate_with("zero_order"), tmp_path, ".pt")
    path = tmp_path / "m.fmu"
    arguments = ("--backend", "python", "--description", description, "-o", path)
    result = invoke("export", module, *arguments)
    assert result.exit_code == 0, result.output
    figures = json.loads(invoke("info", path, "--json", "-").stdout)
    assert set(figures["needs"]) == {"python", "torch", "numpy"}
    assert figures["needs"]["torch"] == torch.__version__
    assert figures == read_json(path, MODULE)
    shown = invoke("info", path)
    assert shown.exit_code == 0, shown.output
    assert f"torch {torch.__version__}" in " ".join(shown.stdout.split())
    assert all(signal["name"] in shown.stdout for signal in figures["inputs"])


@pytest.mark.parametrize("hold", ["zero_order", "first_order"])
def test_outputs_at_given_times_are_those_of_the_native_fmu(tmp_path: Path, hold: Hold) -> None:
    """Whose inputs are known ahead; the description says what is set before a step."""
    surrogate = surrogate_with(hold)
    module, description = saved(surrogate, tmp_path, ".pt")
    path = export_module(module, description, tmp_path / "module.fmu")
    native = export_fmu(surrogate, tmp_path / "native.fmu")
    t = STEP * np.array([0.0, 1.0, 1.6, 4.0, 5.0, 7.5])
    u = np.random.default_rng(1).uniform(0.2, 1, (6, 2))
    np.testing.assert_allclose(
        slide.simulate(path, t, u), slide.simulate(native, t, u), rtol=0, atol=8 * CLOSE
    )
    text = fmpy.read_model_description(str(path)).description
    assert ("what they reach by the end of a step" in text) == (hold == "first_order")
