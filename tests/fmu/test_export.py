"""FMU files: reproducible, valid, readable, and checked."""

from __future__ import annotations

import dataclasses
import json
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu
from typer.testing import CliRunner

from slide_fmu.cli import app
from slide_fmu.core.scaling import Affine
from slide_fmu.core.signals import Signal
from slide_fmu.cosim.check import OUTPUT_TOLERANCE, check_fmu
from slide_fmu.cosim.run import CoSimulationError, run_fmu, unpacked
from slide_fmu.fmu.export import FmuError, export_fmu, read_fmu
from slide_fmu.fmu.libraries import build, platforms
from slide_fmu.fmu.libraries.platforms import FmiVersion
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.native import OK, Loaded
from tests.fmu.samples import STEP, CellShape, Shape, random_surrogate

SHAPE = Shape(n_inputs=2, n_outputs=2, activation="elu", positions=3, name="two_masses")


@pytest.fixture
def surrogate() -> Surrogate:
    return random_surrogate(SHAPE)


@pytest.fixture
def fmu(surrogate: Surrogate, tmp_path: Path) -> Path:
    pages = {"index.html": b"<p>card</p>", "figures/error.svg": b"<svg/>"}
    provenance = {"seed": 3, "recipe": "größer"}
    return export_fmu(
        surrogate, tmp_path / "new" / "m.fmu", provenance=provenance, documentation=pages
    )


def _changed(fmu: Path, replaced: dict[str, bytes | None]) -> Path:
    """A copy with members replaced, or left out when None."""
    copy = fmu.with_name("changed.fmu")
    with zipfile.ZipFile(fmu) as source, zipfile.ZipFile(copy, "w") as target:
        for name in source.namelist():
            content = replaced.get(name, source.read(name))
            if content is not None:
                target.writestr(name, content)
    return copy


@pytest.mark.parametrize("positions", [0, 3])
@pytest.mark.parametrize("cell", [None, CellShape(contraction=0.9)])
@pytest.mark.parametrize("fmi", [2, 3])
def test_exported_fmu_passes_the_validation_of_fmpy(
    tmp_path: Path, positions: int, cell: CellShape | None, fmi: FmiVersion
) -> None:
    surrogate = random_surrogate(dataclasses.replace(SHAPE, positions=positions, cell=cell))
    path = export_fmu(surrogate, tmp_path / "m.fmu", fmi=fmi)
    assert validate_fmu(str(path)) == []
    assert check_fmu(path) == []


def test_export_of_the_same_surrogate_gives_the_same_bytes(
    fmu: Path, surrogate: Surrogate, tmp_path: Path
) -> None:
    again, provenance = read_fmu(fmu)
    assert again.to_bytes() == surrogate.to_bytes()
    assert provenance == {"seed": 3, "recipe": "größer"}
    pages = {"figures/error.svg": b"<svg/>", "index.html": b"<p>card</p>"}
    other = export_fmu(again, tmp_path / "b.fmu", provenance=provenance, documentation=pages)
    assert other.read_bytes() == fmu.read_bytes()


def test_exported_fmu_holds_exactly_the_expected_members(fmu: Path) -> None:
    with zipfile.ZipFile(fmu) as archive:
        assert archive.namelist() == [
            "binaries/darwin64/two_masses.dylib",
            "binaries/linux64/two_masses.so",
            "binaries/win64/two_masses.dll",
            "documentation/figures/error.svg",
            "documentation/index.html",
            "modelDescription.xml",
            "resources/provenance.json",
            "resources/surrogate.slide",
        ]
    assert [path.name for path in fmu.parent.iterdir()] == ["m.fmu"]


KNOWN_AT_START = ["u0", "u1", "prehistory_known", "initial_u0", "initial_u1"]
KINDS = ["inputs_in_range", "prehistory_known", "initial_u0"]


def test_model_description_holds_the_signals_of_the_surrogate(
    fmu: Path, surrogate: Surrogate
) -> None:
    description = fmpy.read_model_description(str(fmu))
    variables = {variable.name: variable for variable in description.modelVariables}
    assert list(variables) == [
        *("u0", "u1", "y0", "y1", "y0_error_estimate", "y1_error_estimate"),
        *("window_filled", "error_estimate_filled", "inputs_in_range"),
        *("prehistory_known", "initial_u0", "initial_u1"),
    ]
    first = variables["u0"]
    assert (first.min, first.max, first.start) == ("-2.0", "3.0", repr(surrogate.starts[0].item()))
    assert variables["y0_error_estimate"].unit == "m"
    for name, results in (("window_filled", "outputs"), ("error_estimate_filled", "estimates")):
        filled = variables[name]
        assert (filled.unit, filled.min, filled.max) == ("1", "0.0", "1.0")
        assert filled.description.endswith(f"trust the {results} once it is 1.")
    assert description.defaultExperiment.stepSize == str(STEP)
    assert description.coSimulation.canSerializeFMUstate
    assert description.coSimulation.canHandleVariableCommunicationStepSize
    assert all(not unknown.dependencies for unknown in description.outputs)
    initial = [[v.name for v in u.dependencies] for u in description.initialUnknowns]
    assert initial == [KNOWN_AT_START] * 4 + [["prehistory_known"]] * 2 + [KNOWN_AT_START]
    assert description.coSimulation.providesDirectionalDerivative
    in_range, known, parameter = (variables[name] for name in KINDS)
    assert (in_range.type, in_range.variability) == ("Boolean", "discrete")
    assert (in_range.unit, in_range.min, in_range.start) == (None, None, None)
    assert (known.causality, known.variability, known.initial) == ("parameter", "fixed", "exact")
    assert (known.start, parameter.start, parameter.unit) == ("0.0", first.start, "N")


def test_exported_fmu_of_fmi_3_holds_exactly_the_expected_members(
    surrogate: Surrogate, tmp_path: Path
) -> None:
    path = export_fmu(surrogate, tmp_path / "m.fmu", fmi=3)
    assert path.read_bytes() == export_fmu(surrogate, tmp_path / "n.fmu", fmi=3).read_bytes()
    assert read_fmu(path)[0].to_bytes() == surrogate.to_bytes()
    with zipfile.ZipFile(path) as archive:
        assert archive.namelist() == [
            "binaries/aarch64-darwin/two_masses.dylib",
            "binaries/aarch64-linux/two_masses.so",
            "binaries/x86_64-darwin/two_masses.dylib",
            "binaries/x86_64-linux/two_masses.so",
            "binaries/x86_64-windows/two_masses.dll",
            "modelDescription.xml",
            "resources/surrogate.slide",
        ]


def test_description_of_fmi_3_says_what_that_of_fmi_2_says_and_more(
    fmu: Path, surrogate: Surrogate, tmp_path: Path
) -> None:
    """What FMI 2.0 says, and what FMI 3.0 has beside."""
    path = export_fmu(surrogate, tmp_path / "m.fmu", fmi=3)
    two, three = (fmpy.read_model_description(str(p)) for p in (fmu, path))
    assert three.fmiVersion == "3.0"
    assert three.instantiationToken == two.guid
    same = ("name", "valueReference", "causality", "unit", "min", "max", "start", "description")
    *variables, time, first_window, window, initial, _ = three.modelVariables
    for one, other in zip(two.modelVariables, variables, strict=True):
        assert (one.type, other.type) in (("Real", "Float64"), ("Boolean", "Boolean"))
        if other.name == "prehistory_known":  # has one more value
            assert (one.max, other.max) == ("1.0", "2.0")
        else:
            assert [getattr(one, name) for name in same] == [getattr(other, name) for name in same]
    assert (time.name, time.unit, time.causality) == ("time", "s", "independent")
    assert (first_window.name, window.name) == ("y0_window", "y1_window")
    assert (window.causality, window.shape) == ("local", (surrogate.window.n_out,))
    interface = three.coSimulation
    assert interface.fixedInternalStepSize == str(STEP)
    assert three.defaultExperiment.stepSize == str(STEP)
    assert interface.canHandleVariableCommunicationStepSize
    assert interface.canGetAndSetFMUstate
    assert interface.canSerializeFMUstate
    assert interface.providesIntermediateUpdate
    assert not interface.hasEventMode
    assert two.coSimulation.canInterpolateInputs
    assert (initial.name, initial.causality) == ("initial_u0_window", "parameter")
    assert initial.shape == (surrogate.memory_length,)
    arrays = {initial.name, "initial_u1_window"}
    for unknowns in ("outputs", "initialUnknowns"):
        found = [
            [
                (u.variable.name, [v.name for v in u.dependencies if v.name not in arrays])
                for u in getattr(d, unknowns)
            ]
            for d in (two, three)
        ]
        assert found[0] == found[1]


def test_signal_called_time_is_refused_in_fmi_3(surrogate: Surrogate, tmp_path: Path) -> None:
    first, second = surrogate.inputs
    signals = (dataclasses.replace(first, name="time"), second)
    surrogate = dataclasses.replace(surrogate, inputs=signals)
    export_fmu(surrogate, tmp_path / "m.fmu")
    with pytest.raises(ValueError, match="two variables of its FMU have the name 'time'"):
        export_fmu(surrogate, tmp_path / "m.fmu", fmi=3)


@pytest.mark.parametrize("fmi", [2, 3])
def test_run_fmu_gives_what_numpy_gives_for_both_standards(
    surrogate: Surrogate, tmp_path: Path, fmi: FmiVersion
) -> None:
    path = export_fmu(surrogate, tmp_path / "m.fmu", fmi=fmi)
    inputs = np.random.default_rng(2).uniform(-2, 3, (40, 2))
    columns = dict(zip(("u0", "u1"), inputs.T, strict=True))
    with unpacked(path) as fmu:
        run = run_fmu(fmu, columns, ["y0", "y1"])
        with pytest.raises(CoSimulationError, match=r"input with value reference 0 = nan"):
            run_fmu(fmu, {"u0": np.full(3, np.nan)}, ["y0"])
    expected = surrogate.predict_newest(inputs)
    np.testing.assert_allclose(run.values[1:], expected, rtol=0, atol=OUTPUT_TOLERANCE * 8)


def test_fmpy_simulates_both_standards_alike(fmu: Path, tmp_path: Path) -> None:
    three = export_fmu(read_fmu(fmu)[0], tmp_path / "three.fmu", fmi=3)
    results = [
        fmpy.simulate_fmu(str(path), stop_time=0.4, output_interval=STEP) for path in (fmu, three)
    ]
    assert np.array_equal(results[0], results[1])


@pytest.mark.parametrize("fmi", [2, 3])
def test_subcommands_accept_fmus_of_both_standards(
    fmu: Path, tmp_path: Path, fmi: FmiVersion
) -> None:
    path = tmp_path / "again.fmu"
    runner = CliRunner()
    assert (
        runner.invoke(app, ["export", str(fmu), "--fmi", str(fmi), "-o", str(path)]).exit_code == 0
    )
    description = fmpy.read_model_description(str(path))
    assert description.fmiVersion == f"{fmi}.0"
    assert runner.invoke(app, ["check", str(path)]).exit_code == 0
    info = runner.invoke(app, ["info", str(path), "--json", "-"])
    assert json.loads(info.stdout)["name"] == "two_masses"
    wrong = runner.invoke(app, ["export", str(fmu), "--fmi", "4", "-o", str(path)])
    assert wrong.exit_code == 2


@pytest.mark.parametrize("fmi", [2, 3])
def test_fmu_holds_less_than_half_a_megabyte_beyond_the_weights(
    fmu: Path, tmp_path: Path, fmi: FmiVersion
) -> None:
    """All platforms in one file stay below half a megabyte."""
    surrogate = read_fmu(fmu)[0]
    path = export_fmu(surrogate, tmp_path / "m.fmu", fmi=fmi)
    with zipfile.ZipFile(path) as archive:
        weights = archive.getinfo("resources/surrogate.slide").compress_size
    print(f"FMI {fmi}: {path.stat().st_size - weights} bytes beyond the weights")
    assert path.stat().st_size - weights < 500_000


def test_description_without_estimator_has_no_estimates(
    surrogate: Surrogate, tmp_path: Path
) -> None:
    surrogate = dataclasses.replace(surrogate, estimator=None)
    path = export_fmu(surrogate, tmp_path / "m.fmu")
    description = fmpy.read_model_description(str(path))
    names = [variable.name for variable in description.modelVariables]
    assert names == [
        *("u0", "u1", "y0", "y1", "window_filled", "inputs_in_range"),
        *("prehistory_known", "initial_u0", "initial_u1"),
    ]
    initial = [[v.name for v in u.dependencies] for u in description.initialUnknowns]
    assert initial == [KNOWN_AT_START] * 2 + [["prehistory_known"], KNOWN_AT_START]


def test_description_of_a_cell_has_its_truncation_errors(tmp_path: Path) -> None:
    surrogate = random_surrogate(dataclasses.replace(SHAPE, cell=CellShape()))
    path = export_fmu(surrogate, tmp_path / "m.fmu")
    description = fmpy.read_model_description(str(path))
    variables = description.modelVariables
    assert [variable.name for variable in variables[6:]] == [
        *("window_filled", "error_estimate_filled", "y0_truncation_error", "y1_truncation_error"),
        *("inputs_in_range", "prehistory_known", "initial_u0", "initial_u1"),
    ]
    assert (variables[8].unit, variables[8].min, variables[8].causality) == ("m", "0.0", "output")
    initial = [[v.name for v in u.dependencies] for u in description.initialUnknowns]
    assert initial == [KNOWN_AT_START] * 4 + [["prehistory_known"]] * 2 + [KNOWN_AT_START] * 3


def test_start_values_lie_in_the_range(surrogate: Surrogate, tmp_path: Path) -> None:
    signals = (Signal("u0", "kN", 2.0, 3.0), Signal("u1", "furlong", -3.0, -2.0))
    with pytest.raises(ValueError, match=r"input 0 starts at 2, .*scale the input by its range"):
        dataclasses.replace(
            surrogate, inputs=signals, input_scaling=Affine.of_channels([0.5, -2.5], [0.5, 0.5])
        )
    scaling = Affine.of_channels([2.5, -2.5], [0.5, 0.5])
    surrogate = dataclasses.replace(surrogate, inputs=signals, input_scaling=scaling)
    path = export_fmu(surrogate, tmp_path / "m.fmu")
    variables = fmpy.read_model_description(str(path)).modelVariables
    assert [variable.start for variable in variables[:2]] == ["2.0", "-2.0"]
    assert check_fmu(path) == []
    folder = Path(fmpy.extract(str(path), str(tmp_path / "unpacked")))
    native = Loaded(surrogate, path, folder).instance().start()
    assert native.get(0, 2) == [2.0, -2.0]
    native.set(2.5, -2.5)
    assert native.call("fmi2Reset") == OK
    assert native.start().get(0, 2) == [2.0, -2.0]


def test_inputs_start_where_their_signals_say(
    surrogate: Surrogate, load: Callable[[Surrogate], Loaded]
) -> None:
    """Rounding of offset -+ scale does not matter."""
    signals = (Signal("u0", "N", 0.2, 0.9), Signal("u1", "m", -1.0, 3.0, start=2.5))
    scaling = Affine.of_channels([0.5 * (0.9 + 0.2), 1.0], [0.5 * (0.9 - 0.2), 2.0])
    assert scaling.offset[0] - scaling.scale[0] > 0.2
    loaded = load(dataclasses.replace(surrogate, inputs=signals, input_scaling=scaling))
    native = loaded.instance().start()
    assert native.get(0, 2) == [0.2, 2.5]
    held = np.tile([0.2, 2.5], (20, 1))
    np.testing.assert_allclose(native.get(2, 2), loaded.surrogate.predict(held)[-1], rtol=1e-4)


def test_clashing_names_are_refused(surrogate: Surrogate, tmp_path: Path) -> None:
    signals = (Signal("window_filled", "N", 0.0, 1.0), surrogate.inputs[1])
    with pytest.raises(ValueError, match="two variables of its FMU have the name 'window_filled'"):
        export_fmu(dataclasses.replace(surrogate, inputs=signals), tmp_path / "m.fmu")


@pytest.mark.parametrize("name", ["../index.html", "/index.html", "", "a\\b"])
def test_documentation_stays_in_its_folder(
    surrogate: Surrogate, tmp_path: Path, name: str
) -> None:
    with pytest.raises(ValueError, match="documentation file"):
        export_fmu(surrogate, tmp_path / "m.fmu", documentation={name: b""})


def test_export_without_compiled_runtime_names_the_command_that_builds_it(
    surrogate: Surrogate, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(platforms, "BINARIES", tmp_path)
    with pytest.raises(FileNotFoundError, match=r"python -m slide_fmu\.fmu\.libraries\.build"):
        export_fmu(surrogate, tmp_path / "m.fmu")


def test_file_that_is_no_fmu_is_refused(fmu: Path, tmp_path: Path) -> None:
    text = tmp_path / "text.fmu"
    text.write_text("hello")
    data = fmu.read_bytes()
    cut, flipped = tmp_path / "cut.fmu", tmp_path / "flipped.fmu"
    cut.write_bytes(data[: len(data) // 2])
    with zipfile.ZipFile(fmu) as archive:
        at = archive.getinfo("resources/surrogate.slide").header_offset + 200
    flipped.write_bytes(data[:at] + bytes([data[at] ^ 0xFF]) + data[at + 1 :])
    foreign = _changed(fmu, {"resources/surrogate.slide": None})
    for path in (text, cut, flipped, foreign):
        with pytest.raises(FmuError):
            read_fmu(path)
        assert len(check_fmu(path)) == 1
    with pytest.raises(FmuError, match="not made by slide-fmu"):
        read_fmu(foreign)
    assert "No such file" in check_fmu(tmp_path / "absent.fmu")[0]


def test_check_names_the_faults_of_a_damaged_fmu(fmu: Path) -> None:
    with zipfile.ZipFile(fmu) as archive:
        xml = archive.read("modelDescription.xml")
    description = "modelDescription.xml"
    faults: list[tuple[dict[str, bytes | None], str]] = [
        ({"binaries/win64/two_masses.dll": None}, "two_masses.dll is missing"),
        ({description: xml.replace(b'guid="slide', b'guid="other')}, "GUID other"),
        (
            {description: xml.replace(b'name="u0"', b'name="u7"')},
            "variables are not those of this version of slide-fmu. The first: variable 'u7' with "
            "value reference 0, input, Real in N; expected 'u0' with value reference 0, input",
        ),
        (
            {description: xml.replace(b'valueReference="1000000"', b'valueReference="2"')},
            "1 of 12 variables are not those of this version",
        ),
        ({description: xml.replace(b"</ModelVariables>", b"")}, description),
        ({description: None}, description),
        ({"resources/surrogate.slide": b"SLIDEFMU"}, "surrogate file"),
        ({"binaries/linux64/two_masses.so": b"no library"}, "native library failed"),
    ]
    for replaced, expected in faults:
        if "linux64" in next(iter(replaced)) and fmpy.platform != "linux64":
            continue
        problems = check_fmu(_changed(fmu, replaced))
        assert any(expected in problem for problem in problems), (expected, problems)


def test_unchanged_sources_are_not_compiled_again(monkeypatch: pytest.MonkeyPatch) -> None:
    libraries = build.build_all()
    monkeypatch.setattr(build, "run_compiler", lambda arguments: pytest.fail("compiled"))
    assert build.build_all() == libraries


def test_libraries_of_other_versions_are_removed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    build.build_all()
    copy = tmp_path / "binaries"
    shutil.copytree(build.BINARIES, copy)
    whole = sorted(copy.rglob("*"))
    (copy / "linux64").mkdir()
    (copy / "linux64" / "slide.so").write_bytes(b"old")
    (copy / "x86_64-linux" / "slide.so.4711").write_bytes(b"broken off")
    monkeypatch.setattr(build, "BINARIES", copy)
    monkeypatch.setattr(build, "run_compiler", lambda arguments: pytest.fail("compiled"))
    build.build_all()
    assert sorted(copy.rglob("*")) == whole


def test_libraries_are_those_that_the_pinned_compiler_makes() -> None:
    """After a change of the runtime: python -m slide_fmu.fmu.libraries.build --record."""
    build.build_all()
    assert build.hashes() == build.HASHES.read_text()


def test_build_needs_the_standard_library_alone() -> None:
    code = "import runpy, sys; runpy.run_path(sys.argv[1]); assert 'numpy' not in sys.modules"
    script = str(Path(build.__file__))
    assert subprocess.run([sys.executable, "-c", code, script], check=False).returncode == 0
