"""Source FMUs: strict C99, no files, the same results as the library, several in one program."""

from __future__ import annotations

import ctypes
import re
import shutil
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu
from typer.testing import CliRunner

from slide_fmu.cli.app import app
from slide_fmu.core.signals import FloatArray
from slide_fmu.cosim.check import OUTPUT_TOLERANCE, check_fmu
from slide_fmu.fmu.export import export_fmu
from slide_fmu.fmu.libraries import sources
from slide_fmu.fmu.libraries.build import WARNINGS, BuildError
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.any_step import go
from tests.fmu.driver import host_compilers, run_compiler
from tests.fmu.native import ExportedFmu, Native
from tests.fmu.samples import CellShape, Shape, random_surrogate
from tests.refusals import refused

SHAPES = {
    "layers": Shape(n_inputs=2, n_outputs=2, activation="elu", positions=3),
    "cell": Shape(n_outputs=2, positions=3, hold="first_order", cell=CellShape()),
    "chain": Shape(
        n_inputs=6,
        features="chain",
        hold="first_order",
        cell=CellShape(activation="gated", turned=1),
    ),
}
SHARED = ("-shared", "-Wl,--no-as-needed", "-lm")
RANGE = 8.0
"""Of the outputs of random surrogates."""


def exported(surrogate: Surrogate, folder: Path) -> ExportedFmu:
    """A source FMU, unpacked."""
    path = export_fmu(surrogate, folder / f"{surrogate.name}.fmu", sources=True)
    return ExportedFmu(
        surrogate, path, Path(fmpy.extract(str(path), str(folder / surrogate.name)))
    )


def compiled(loaded: ExportedFmu, library: Path, *flags: str) -> Path:
    """Compile all sources with one command; all warnings are errors."""
    command, _ = host_compilers()[0]
    sources = [str(path) for path in sorted((loaded.folder / "sources").glob("*.c"))]
    arguments = [*WARNINGS, "-O2", "-fPIC", *flags, *sources, "-o", str(library)]
    built = run_compiler(command, arguments)
    assert built.returncode == 0, built.stderr
    return library


def run(native: Native, n_inputs: int, n_results: int) -> FloatArray:
    """Results along random inputs, shape (40, n_results); every seventh step is another one."""
    inputs = np.random.default_rng(3).uniform(-2, 3, (40, n_inputs))
    lengths = [1 if index % 7 else 0.74 for index in range(40)]
    results = go(native.start(), lengths, inputs, n_results)
    native.free()
    return results


@pytest.mark.extended
@pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)
def test_source_fmu_gives_the_same_results_as_the_library(shape: Shape, tmp_path: Path) -> None:
    loaded = exported(random_surrogate(shape), tmp_path)
    assert validate_fmu(str(loaded.path)) == []
    library = ctypes.CDLL(str(compiled(loaded, tmp_path / "own.so", *SHARED)))
    inside = Native(library, loaded.guid, "no URI at all", surrogate=loaded.surrogate)
    assert inside.component, inside.messages
    results = shape.n_outputs * 2
    found = run(inside, shape.n_inputs, results)
    expected = run(loaded.instance(), shape.n_inputs, results)
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=OUTPUT_TOLERANCE * RANGE)


def test_source_fmu_compiled_with_fast_math_is_refused(tmp_path: Path) -> None:
    loaded = exported(random_surrogate(SHAPES["layers"]), tmp_path)
    source = str(loaded.folder / "sources" / "stream.c")
    command, _ = host_compilers()[0]
    built = run_compiler(
        command, ["-std=c99", "-ffast-math", "-c", source, "-o", str(tmp_path / "x.o")]
    )
    assert built.returncode != 0
    assert "compile without -ffast-math" in built.stderr


def test_description_of_a_source_fmu_names_all_sources(tmp_path: Path) -> None:
    loaded = exported(random_surrogate(SHAPES["layers"]), tmp_path)
    description = fmpy.read_model_description(str(loaded.path))
    (files,) = description.buildConfigurations[0].sourceFileSets
    found = sorted(path.name for path in (loaded.folder / "sources").glob("*.c"))
    assert files.sourceFiles == found
    assert check_fmu(loaded.path) == []


def test_export_with_source_adds_the_sources_to_an_fmu(tmp_path: Path) -> None:
    surrogate = random_surrogate(SHAPES["layers"])
    plain = export_fmu(surrogate, tmp_path / "plain.fmu")
    arguments = ["export", str(plain), "--source", "-o", str(tmp_path / "again_with_sources.fmu")]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0, result.output
    again = export_fmu(surrogate, tmp_path / "again.fmu", sources=True)
    assert (
        (tmp_path / "again_with_sources.fmu").read_bytes()
        == again.read_bytes()
        != plain.read_bytes()
    )


def test_build_description_of_a_source_fmu_of_fmi_3_names_all_sources(tmp_path: Path) -> None:
    surrogate = random_surrogate(SHAPES["layers"])
    path = export_fmu(surrogate, tmp_path / "three.fmu", fmi=3, sources=True)
    assert validate_fmu(str(path)) == []
    folder = Path(fmpy.extract(str(path), str(tmp_path / "three"))) / "sources"
    description = ElementTree.parse(folder / "buildDescription.xml").getroot()
    named = [file.get("name") for file in description.iter("SourceFile")]
    assert named == sorted(file.name for file in folder.glob("*.c"))
    assert "fmi3_functions.c" in named
    assert "fmi2_functions.c" not in named
    assert check_fmu(path) == []


def test_source_fmu_opens_no_file(tmp_path: Path) -> None:
    loaded = exported(random_surrogate(SHAPES["layers"]), tmp_path)
    for path in (loaded.folder / "sources").iterdir():
        text = path.read_text("utf-8")
        assert not re.search(r"\b(fopen|_wfopen|fread|windows\.h)\b", text), path.name


@pytest.mark.extended
def test_source_fmu_refuses_a_wrong_guid(tmp_path: Path) -> None:
    loaded = exported(random_surrogate(SHAPES["layers"]), tmp_path)
    library = ctypes.CDLL(str(compiled(loaded, tmp_path / "own.so", *SHARED)))
    refused = Native(library, "another", "")
    assert not refused.component
    assert "GUID another" in refused.messages[0]


@pytest.mark.extended
def test_several_source_fmus_in_one_program_keep_apart(tmp_path: Path) -> None:
    """Their functions begin with their names."""
    names, parts = ("first", "second"), []
    for name in names:
        loaded = exported(random_surrogate(Shape(name=name)), tmp_path)
        flags = (f"-DFMI2_FUNCTION_PREFIX={name}_", "-r", "-nostdlib")
        # -r: one object of all, whose names meet those of the other FMU in the next link
        parts.append(str(compiled(loaded, tmp_path / f"{name}.o", *flags)))
    command, _ = host_compilers()[0]
    both = tmp_path / "both.so"
    linked = run_compiler(command, ["-shared", *parts, "-lm", "-o", str(both)])
    assert linked.returncode == 0, linked.stderr
    library = ctypes.CDLL(str(both))
    for name in names:
        version = getattr(library, f"{name}_fmi2GetVersion")
        version.restype = ctypes.c_char_p
        assert version() == b"2.0"
    assert not hasattr(library, "fmi2GetVersion")


@pytest.mark.extended
@pytest.mark.skipif(
    shutil.which("cmake") is None, reason="fmpy compiles with cmake: not installed"
)
def test_source_fmu_is_compiled_and_run_by_fmpy(tmp_path: Path) -> None:
    loaded = exported(random_surrogate(SHAPES["cell"]), tmp_path)
    library = next((loaded.folder / "binaries" / fmpy.platform).iterdir()).read_bytes()
    command = [sys.executable, "-m", "fmpy", "compile", str(loaded.path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    again = Path(fmpy.extract(str(loaded.path), str(tmp_path / "again")))
    own = next((again / "binaries" / fmpy.platform).iterdir()).read_bytes()
    assert own != library
    (problem,) = check_fmu(loaded.path)
    assert "export again, or run it all the same (--run)" in problem
    assert check_fmu(loaded.path, run_unknown=True) == []


def test_headers_that_form_names_in_an_unknown_way_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    header = tmp_path / "fmi2Functions.h"
    header.write_text("#define fmi2FullName(name) other_##name\n")
    monkeypatch.setattr(sources, "standard_headers", lambda fmi: [header])
    with refused(BuildError, "fmi2Functions.h of fmpy has no", "pip install fmpy=="):
        sources.source_members("any", b"")
