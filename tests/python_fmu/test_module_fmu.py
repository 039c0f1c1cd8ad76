"""FMUs that carry a torch module: the same variables, window and steps as native ones."""

from __future__ import annotations

import json
import subprocess
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

import fmpy
import numpy as np
import pytest
import torch
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave
from fmpy.validation import validate_fmu
from torch import nn
from typer.testing import CliRunner, Result

from slide_fmu.cli import app
from slide_fmu.core.signals import FloatArray, Hold
from slide_fmu.fmu.description.variables import BY_KEY
from slide_fmu.fmu.export import MODULE, export_fmu, read_json
from slide_fmu.python_fmu.torch_export import ModuleError, export_module
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.samples import STEP, Shape, random_surrogate

CLOSE = 1e-5
"""Relative to the outputs' range: torch and the native library round differently."""


class Twin(nn.Module):
    """The network of a random surrogate as torch module."""

    def __init__(self, surrogate: Surrogate) -> None:
        super().__init__()
        layers: list[nn.Module] = [nn.Flatten()]
        for layer in surrogate.network.layers:  # type: ignore[attr-defined]
            linear = nn.Linear(layer.weights.shape[1], layer.weights.shape[0])
            linear.weight.data = torch.from_numpy(layer.weights)
            linear.bias.data = torch.from_numpy(layer.bias)
            layers += [linear] + ([nn.Tanh()] if layer.activation == "tanh" else [])
        self.layers = nn.Sequential(*layers)

    def forward(self, window: torch.Tensor) -> torch.Tensor:
        """(B, n_in, n_inputs) to (B, n_out * n_outputs)."""
        values: torch.Tensor = self.layers(window)
        return values


def surrogate_with(hold: Hold) -> Surrogate:
    return random_surrogate(
        Shape(n_inputs=2, n_outputs=2, activation="tanh", hold=hold, name="twin")
    )


def description_of(surrogate: Surrogate) -> str:
    """The file that describes the twin."""
    window = surrogate.window
    lines = [f'name = "{surrogate.name}"', f'hold = "{surrogate.hold}"']
    lines += ["[window]", f"step = {window.step}", f"n_in = {window.n_in}"]
    for kind, signals, scaling in (
        ("inputs", surrogate.inputs, surrogate.input_scaling),
        ("outputs", surrogate.outputs, surrogate.output_scaling),
    ):
        for index, signal in enumerate(signals):
            lines += [f"[[{kind}]]", f'name = "{signal.name}"', f'unit = "{signal.unit}"']
            lines += [f"low = {float(signal.low)}", f"high = {float(signal.high)}"]
            lines += [f"offset = {scaling.offset[index]!s}", f"scale = {scaling.scale[index]!s}"]
            if signal.start is not None:
                lines.append(f"start = {signal.start}")
    return "\n".join(lines)


def saved(surrogate: Surrogate, folder: Path, suffix: str) -> tuple[Path, Path]:
    """Files of the twin and of its description."""
    module, description = folder / f"twin{suffix}", folder / "signals.toml"
    example = torch.zeros(1, surrogate.window.n_in, len(surrogate.inputs))
    if suffix == ".pt2":
        torch.export.save(torch.export.export(Twin(surrogate), (example,)), module)
    else:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)
            torch.jit.save(torch.jit.trace(Twin(surrogate), example), module)
    description.write_text(description_of(surrogate), encoding="utf-8")
    return module, description


RESULTS = [*(BY_KEY["OUTPUT"].reference(i) for i in range(2)), BY_KEY["WINDOW_FILLED"].reference()]
IN_RANGE = BY_KEY["IN_RANGE"].reference()
PARAMETERS = [
    BY_KEY["PREHISTORY_KNOWN"].reference(),
    *(BY_KEY["INITIAL_INPUT"].reference(i) for i in range(2)),
]
EVERYTHING = [0, 1, *RESULTS, *PARAMETERS]
"""Value references, alike in a native FMU and in one with a torch module."""


@pytest.fixture(autouse=True)
def unchanged_path() -> Iterator[None]:
    """PythonFMU leaves the folder of every instance on Python's search path."""
    before = list(sys.path)
    yield
    sys.path[:] = before


def invoke(*arguments: object) -> Result:
    """Call the console script in this process."""
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def start(path: Path, folder: Path, *parameters: float) -> FMU2Slave:
    """An initialized instance, with values of the parameters."""
    description = fmpy.read_model_description(str(path))
    slave = FMU2Slave(
        guid=description.guid,
        unzipDirectory=fmpy.extract(str(path), str(folder)),
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName="test",
    )
    slave.instantiate(loggingOn=True)
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.setReal(PARAMETERS[: len(parameters)], parameters)
    slave.exitInitializationMode()
    return slave


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
def test_it_gives_what_the_native_one_gives(
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


def test_inputs_in_range_are_those_of_the_scaling(tmp_path: Path) -> None:
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
def test_variables_are_those_of_a_native_one(suffix: str, tmp_path: Path) -> None:
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


def test_state_comes_back_also_in_another_instance(tmp_path: Path) -> None:
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


@pytest.mark.parametrize(
    ("time", "step", "inputs", "message"),
    [
        (0.0, 0.0, [0, 0], "expected a positive, finite step"),
        (0.0, -STEP, [0, 0], "expected a positive, finite step"),
        (0.0, np.inf, [0, 0], "expected a positive, finite step"),
        (STEP, STEP, [0, 0], "the end of the last step"),
        (0.0, STEP, [np.nan, 0], "expected a finite number"),
    ],
)
def test_steps_that_cannot_be_taken(
    time: float,
    step: float,
    inputs: list[float],
    message: str,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
) -> None:
    path = export_module(*saved(surrogate_with("zero_order"), tmp_path, ".pt"), tmp_path / "m.fmu")
    slave = start(path, tmp_path / "a")
    slave.setReal([0, 1], inputs)
    with pytest.raises(FMICallException):
        slave.doStep(time, step)
    assert message in capfd.readouterr().out
    slave.setReal([0, 1], [0.0, 0.0])
    slave.doStep(0.0, STEP)
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


def test_values_that_cannot_be_set(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = export_module(*saved(surrogate_with("zero_order"), tmp_path, ".pt"), tmp_path / "m.fmu")
    slave = start(path, tmp_path / "a", 1.0, 0.3, -0.4)
    before, everything = slave.getReal(EVERYTHING), EVERYTHING
    for references, values, message in (
        ([0, PARAMETERS[0]], [0.5, 0.0], f"{PARAMETERS[0]} is a parameter; set it before"),
        ([0, PARAMETERS[1]], [0.5, 0.0], f"{PARAMETERS[1]} is a parameter; set it before"),
        ([0, RESULTS[0]], [0.5, 0.0], f"{RESULTS[0]} is no input; only inputs, 0 to 1, and"),
        ([0, 1], [0.5, 1e300], "1 = 1e+300; expected a finite number near the input's range"),
    ):
        slave.setReal(references, values)  # PythonFMU has no status for it
        assert message in capfd.readouterr().out
        assert slave.getReal(everything) == before
        with pytest.raises(FMICallException):
            slave.doStep(0.0, STEP)
        assert message in capfd.readouterr().out
        assert slave.getReal(everything) == before
    assert np.isnan(slave.getReal([9])[0])
    assert "value reference 9 is no variable of type Real" in capfd.readouterr().out
    with pytest.raises(FMICallException):
        slave.doStep(0.0, STEP)
    slave.doStep(0.0, STEP)
    slave.freeInstance()


@pytest.mark.parametrize("reference", [IN_RANGE, 0])
def test_booleans_cannot_be_set_and_the_instance_lives_on(
    reference: int, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = export_module(*saved(surrogate_with("zero_order"), tmp_path, ".pt"), tmp_path / "m.fmu")
    slave = start(path, tmp_path / "a", 1.0, 0.3, -0.4)
    before = slave.getReal(EVERYTHING), slave.getBoolean([IN_RANGE])
    slave.setBoolean([reference], [False])
    message = f"value reference {reference} is no Boolean variable that can be set"
    assert message in capfd.readouterr().out
    assert (slave.getReal(EVERYTHING), slave.getBoolean([IN_RANGE])) == before
    with pytest.raises(FMICallException):
        slave.doStep(0.0, STEP)
    slave.doStep(0.0, STEP)
    slave.freeInstance()


def test_damaged_states_and_those_of_others_are_refused(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    paths = []
    for hold in get_args(Hold):
        (tmp_path / hold).mkdir()
        files = saved(surrogate_with(hold), tmp_path / hold, ".pt")
        paths.append(export_module(*files, tmp_path / hold / "m.fmu"))
    slave, other = (start(path, path.parent / "a") for path in paths)
    slave.doStep(0.0, STEP)
    before = slave.getReal(EVERYTHING)
    foreign = other.serializeFMUstate(other.getFMUstate())
    damaged = bytearray(slave.serializeFMUstate(slave.getFMUstate()))
    damaged[len(damaged) // 2] ^= 1
    for data, message in (
        (foreign, "the state belongs to another FMU"),
        (bytes(damaged), "the state is damaged"),
        (b"", "the state is damaged"),
    ):
        slave.setFMUstate(slave.deSerializeFMUstate(data))
        assert message in capfd.readouterr().out
        assert slave.getReal(EVERYTHING) == before
        with pytest.raises(FMICallException):
            slave.doStep(STEP, STEP)
    slave.doStep(STEP, STEP)
    for instance in (slave, other):
        instance.freeInstance()


def test_it_runs_without_slide_fmu_and_pythonfmu(tmp_path: Path) -> None:
    surrogate = surrogate_with("zero_order")
    path = export_module(*saved(surrogate, tmp_path, ".pt"), tmp_path / "module.fmu")
    command = [sys.executable, "-c", ALONE, str(path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    expected = surrogate.predict(surrogate.starts[None])[0, 0]
    value, own = done.stdout.splitlines()[-2:]
    assert abs(float(value) - expected) < 8 * CLOSE
    assert Path(own).parts[-3:] == ("resources", "pythonfmu", "__init__.py")


def test_info_says_what_it_needs(tmp_path: Path) -> None:
    module, description = saved(surrogate_with("zero_order"), tmp_path, ".pt")
    path = tmp_path / "m.fmu"
    arguments = ("--backend", "python", "--description", description, "-o", path)
    result = invoke("export", module, *arguments)
    assert result.exit_code == 0, result.output
    figures = json.loads(invoke("info", path, "--json", "-").stdout)
    assert set(figures["needs"]) == {"python", "torch", "numpy"}
    assert figures["needs"]["torch"] == torch.__version__
    assert figures == read_json(path, MODULE)


def test_backends_refuse_what_they_cannot_make(tmp_path: Path) -> None:
    module, description = saved(surrogate_with("zero_order"), tmp_path, ".pt")
    refused = invoke("export", module, "-o", tmp_path / "m.fmu")
    assert refused.exit_code == 1
    assert "add --backend python" in refused.output.replace("\n", " ")
    other = invoke("export", tmp_path / "recipe.toml", "--backend", "python")
    assert other.exit_code == 1
    assert "takes a torch module" in other.output.replace("\n", " ")
    about = ("--backend", "python", "--description", description, "-o", tmp_path / "m.fmu")
    for form in (("--fmi", 3), ("--source",)):
        native = invoke("export", module, *about, *form)
        assert native.exit_code == 1
        assert "which are for native FMUs" in native.output.replace("\n", " ")
    without = invoke("export", module, "--backend", "python", "-o", tmp_path / "m.fmu")
    assert without.exit_code == 1
    assert "--description" in without.output.replace("\n", " ")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("n_in = 12", "n_in = 0", "window.n_in = 0"),
        ("n_in = 12", "n_in = 1000000000", "n_in = 1000000000: .* less than or equal to 1048576"),
        ("n_in = 12", "n_in = true", "window.n_in = True: .* valid integer"),
        ("n_in = 12", "n_in = 12.0", "window.n_in = 12.0: .* valid integer"),
        (f"step = {STEP}", "step = true", "window.step = True: .* valid number"),
        ("low = -2.0", "low = false", r"inputs.0.low = False: .* valid number"),
        ("low = -2.0", f"low = -1{'0' * 400}", r"inputs.0.low"),
        ("low = -2.0", f"low = {'9' * 5000}", "signals.toml: not valid TOML"),
        ('hold = "zero_order"', f"hold = {'[' * 100_000}", "signals.toml: not valid TOML"),
        ("n_in = 12", "n_in = 12\nn_im = 3", "window.n_im is not a known key"),
        ("n_in = 12", "n_in = 7", "mat1 and mat2|size|shape|expected"),
        ('name = "u1"', 'name = "u0"', "signals.toml: module: two variables have the name 'u0'"),
        ('hold = "zero_order"', 'hold = "sometimes"', "hold = 'sometimes'"),
        ("low = -2.0", "low = 4.0", "expected two finite numbers"),
        ('name = "twin"', "name = 'twin", "not valid TOML"),
    ],
)
def test_mistakes_in_the_description(old: str, new: str, message: str, tmp_path: Path) -> None:
    module, description = saved(surrogate_with("zero_order"), tmp_path, ".pt")
    text = description.read_text(encoding="utf-8")
    assert old in text
    description.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(ModuleError, match=message):
        export_module(module, description, tmp_path / "m.fmu")
    assert not (tmp_path / "m.fmu").exists()
