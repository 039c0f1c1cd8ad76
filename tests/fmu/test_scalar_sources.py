"""Scalar source FMUs: no extension of C99, no heap, the library's results, on many targets."""

from __future__ import annotations

import ctypes
import hashlib
import re
import shutil
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import numpy as np
import pytest
from typer.testing import CliRunner

from slide_fmu.cli.app import app
from slide_fmu.cosim.check import OUTPUT_TOLERANCE, check_fmu
from slide_fmu.fmu.export import export_fmu
from slide_fmu.fmu.libraries.platforms import FmiVersion
from tests.fmu.driver import run_compiler
from tests.fmu.native import ERROR, OK, ExportedFmu, Native
from tests.fmu.samples import random_surrogate
from tests.fmu.test_sources import RANGE, SHAPES, run

STRICT = ("-std=c99", "-pedantic", "-Wall", "-Wextra", "-Wvla", "-Werror")
ZIG = [sys.executable, "-m", "ziglang", "cc"]
CORTEX_M7 = ("-mcpu=cortex-m7", "-mthumb", "-mfpu=fpv5-d16", "-mfloat-abi=hard")
CLANG = ("-Wno-strict-prototypes",)
"""Clang warns of a prototype in the headers of FMI 3.0, which are not ours to change."""
COMPILERS: dict[str, tuple[list[str], tuple[str, ...]]] = {
    "gcc": (["gcc"], ()),
    "clang": (ZIG, (*CLANG, "-target", "x86_64-linux-gnu.2.17")),
    "windows-gnu": (ZIG, (*CLANG, "-target", "x86_64-windows-gnu")),
    "windows-msvc": (ZIG, (*CLANG, "-target", "x86_64-windows-msvc")),
    "arm-none-eabi": (["arm-none-eabi-gcc"], CORTEX_M7),
}
"""Command and flags of each target. The headers of Microsoft's C library come with no package."""


def exported(shape: str, folder: Path, fmi: FmiVersion = 2) -> ExportedFmu:
    """A scalar source FMU, unpacked."""
    surrogate = random_surrogate(SHAPES[shape])
    path = export_fmu(surrogate, folder / f"{shape}{fmi}.fmu", fmi=fmi, sources="scalar")
    return ExportedFmu(
        surrogate, path, Path(fmpy.extract(str(path), str(folder / f"{shape}{fmi}")))
    )


def sources_of(loaded: ExportedFmu) -> list[str]:
    return [str(path) for path in sorted((loaded.folder / "sources").glob("*.c"))]


COMPILED: dict[tuple[str, ...], bytes] = {}
"""Libraries by the hash of their sources and the flags: several tests compile the same ones."""


def library_of(loaded: ExportedFmu, folder: Path, *flags: str) -> ctypes.CDLL:
    """Compile and load the sources; all warnings are errors. It shares no memory with others."""
    if shutil.which("gcc") is None:
        pytest.skip("gcc is not installed")
    library = folder / "scalar.so"
    content = b"".join(path.read_bytes() for path in sorted((loaded.folder / "sources").iterdir()))
    key = (hashlib.sha256(content).hexdigest(), *flags)
    if key not in COMPILED:
        arguments = [*STRICT, "-O2", "-shared", "-fPIC", *flags, *sources_of(loaded), "-lm"]
        built = run_compiler(["gcc"], [*arguments, "-o", str(library)])
        assert built.returncode == 0, built.stderr
        COMPILED[key] = library.read_bytes()
    library.write_bytes(COMPILED[key])
    return ctypes.CDLL(str(library))


def instance_of(loaded: ExportedFmu, library: ctypes.CDLL, name: str = "one") -> Native:
    return Native(library, loaded.guid, "no URI at all", name, loaded.surrogate)


@pytest.mark.extended
@pytest.mark.parametrize("shape", SHAPES)
def test_scalar_source_fmu_gives_the_same_results_as_the_library(
    shape: str, tmp_path: Path
) -> None:
    loaded = exported(shape, tmp_path)
    n_inputs, n_results = SHAPES[shape].n_inputs, 2 * SHAPES[shape].n_outputs
    inside = instance_of(loaded, library_of(loaded, tmp_path))
    assert inside.component, inside.messages
    found = run(inside, n_inputs, n_results)
    expected = run(loaded.instance(), n_inputs, n_results)
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=OUTPUT_TOLERANCE * RANGE)


@pytest.mark.extended
@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("target", COMPILERS)
def test_scalar_sources_compile_strictly_for_a_target(
    target: str, fmi: FmiVersion, tmp_path: Path
) -> None:
    command, flags = COMPILERS[target]
    if shutil.which(command[0]) is None:
        pytest.skip(f"{command[0]} is not installed")
    loaded = exported("chain", tmp_path, fmi)
    for source in sources_of(loaded):
        built = run_compiler(command, [*STRICT, *flags, "-c", source, "-o", str(tmp_path / "x.o")])
        if target == "windows-msvc" and re.search(r"'\w+\.h' file not found", built.stderr):
            pytest.skip("the headers of Microsoft's C library are not there")
        assert built.returncode == 0, built.stderr


def test_scalar_sources_use_neither_heap_nor_extensions(tmp_path: Path) -> None:
    loaded = exported("chain", tmp_path)
    names = (loaded.folder / "sources" / "own_names.h").read_text("utf-8")
    assert "#define SLIDE_SCALAR" in names
    for source in sources_of(loaded):
        text = Path(source).read_text("utf-8")
        assert not re.search(r"\b(malloc|calloc|realloc|free|alloca)\s*\(", text), source


@pytest.mark.extended
def test_second_instance_is_refused_until_the_first_is_freed(tmp_path: Path) -> None:
    loaded = exported("layers", tmp_path)
    library = library_of(loaded, tmp_path)
    first = instance_of(loaded, library)
    refused = instance_of(loaded, library, "two")
    assert first.component
    assert not refused.component
    assert "all 1 instances are in use" in refused.messages[0]
    assert "-DSLIDE_INSTANCES=N" in refused.messages[0]
    first.free()
    assert instance_of(loaded, library, "two").component


@pytest.mark.extended
def test_two_instances_in_static_memory_do_not_touch_each_other(tmp_path: Path) -> None:
    loaded = exported("cell", tmp_path)
    library = library_of(loaded, tmp_path, "-DSLIDE_INSTANCES=2")
    both = [instance_of(loaded, library, name).start() for name in ("one", "two")]
    alone = loaded.instance().start()
    for value in np.linspace(-1.0, 2.0, 20):
        both[0].step(float(value))
        both[1].step(float(-value))
        alone.step(float(value))
    expected = alone.get(1, 2)
    np.testing.assert_allclose(both[0].get(1, 2), expected, atol=OUTPUT_TOLERANCE * RANGE)


@pytest.mark.extended
def test_saved_states_beyond_their_number_are_refused(tmp_path: Path) -> None:
    loaded = exported("layers", tmp_path)
    native = instance_of(loaded, library_of(loaded, tmp_path)).start()
    native.step(*[0.5] * SHAPES["layers"].n_inputs)
    states = [ctypes.c_void_p(), ctypes.c_void_p()]
    assert native.call("fmi2GetFMUstate", ctypes.byref(states[0])) == OK
    assert native.call("fmi2GetFMUstate", ctypes.byref(states[1])) == ERROR
    assert "all 1 saved states are in use" in native.messages[-1]
    assert native.call("fmi2FreeFMUstate", ctypes.byref(states[0])) == OK
    assert native.call("fmi2GetFMUstate", ctypes.byref(states[1])) == OK


@pytest.mark.extended
def test_name_that_does_not_fit_is_refused(tmp_path: Path) -> None:
    loaded = exported("layers", tmp_path)
    library = library_of(loaded, tmp_path, "-DSLIDE_INSTANCES=2")
    assert instance_of(loaded, library, "n" * 255).component
    refused = instance_of(loaded, library, "n" * 100_000)
    assert not refused.component
    assert "longer than 255 characters" in refused.messages[0]


@pytest.mark.extended
def test_fewer_steps_per_sample_change_no_step_of_the_sample_length(tmp_path: Path) -> None:
    loaded = exported("cell", tmp_path)
    flags = ("-DSLIDE_STEPS_PER_SAMPLE=2", "-DSLIDE_SAVED_STATES=0")
    native = instance_of(loaded, library_of(loaded, tmp_path, *flags)).start()
    expected = loaded.instance().start()
    for value in np.random.default_rng(5).uniform(-2, 3, 60):
        for instance in (native, expected):
            instance.step(float(value))
        found, wanted = native.get(1, 2), expected.get(1, 2)
        np.testing.assert_allclose(found, wanted, rtol=1e-4, atol=OUTPUT_TOLERANCE * RANGE)


@pytest.mark.extended
def test_messages_of_quiet_sources_are_not_formatted(tmp_path: Path) -> None:
    loaded = exported("layers", tmp_path)
    native = instance_of(loaded, library_of(loaded, tmp_path, "-DSLIDE_QUIET")).start()
    assert native.do_step(0.0, -1.0) != OK
    assert "%" in native.messages[-1]


def test_build_description_of_scalar_sources_names_their_macros(tmp_path: Path) -> None:
    loaded = exported("layers", tmp_path, 3)
    description = ElementTree.parse(loaded.folder / "sources" / "buildDescription.xml").getroot()
    macros = {d.get("name"): d.get("value") for d in description.iter("PreprocessorDefinition")}
    usual = {"SLIDE_INSTANCES": "1", "SLIDE_SAVED_STATES": "1", "SLIDE_STEPS_PER_SAMPLE": "32"}
    assert macros == usual
    assert check_fmu(loaded.path) == []


def test_twincat_description_names_the_tool_of_the_model_description(tmp_path: Path) -> None:
    loaded = exported("layers", tmp_path)
    description = ElementTree.parse(loaded.folder / "sources" / "CustomFMU.xml").getroot()
    (configuration,) = description.iter("FmuConfiguration")
    tool = fmpy.read_model_description(str(loaded.path)).generationTool
    assert configuration.findtext("ToolName") == tool == "slide-fmu"
    assert description.tag == "CustomConfigurations"


def test_export_with_scalar_adds_scalar_sources_to_an_fmu(tmp_path: Path) -> None:
    plain = export_fmu(random_surrogate(SHAPES["layers"]), tmp_path / "plain.fmu")
    arguments = ["export", str(plain), "--scalar", "-o", str(tmp_path / "again.fmu")]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0, result.output
    expected = export_fmu(
        random_surrogate(SHAPES["layers"]), tmp_path / "other.fmu", sources="scalar"
    )
    assert (tmp_path / "again.fmu").read_bytes() == expected.read_bytes()


@pytest.mark.extended
def test_scalar_sources_run_on_a_cortex_m7() -> None:
    """The benchmark refuses a heap that is used, a second instance, and outputs that differ."""
    for tool in ("arm-none-eabi-gcc", "qemu-system-arm"):
        if shutil.which(tool) is None:
            pytest.skip(f"{tool} is not installed")
    root = Path(__file__).parents[2]
    command = [sys.executable, str(root / "tests/benchmarks/controller.py")]
    command += [str(root / "fmus/duffing/duffing.fmu"), "--steps", "20"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
