"""FMU files: reproducible, valid, complete, and alike in both standards."""

from __future__ import annotations

import dataclasses
import json
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu
from typer.testing import CliRunner

from slide_fmu.cli.app import app
from slide_fmu.core.files import write_zip
from slide_fmu.cosim.check import OUTPUT_TOLERANCE, check_fmu
from slide_fmu.cosim.whole_run import run_fmu
from slide_fmu.fmu.export import SURROGATE, export_fmu, read_fmu
from slide_fmu.fmu.hashes import HASHES
from slide_fmu.fmu.libraries import platforms
from slide_fmu.fmu.libraries.platforms import FmiVersion
from slide_fmu.importer.errors import CoSimulationError, FmuError
from slide_fmu.importer.file import unpacked
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.samples import STEP, TWO_MASSES, CellShape, random_surrogate
from tests.refusals import refused

LICENSES = [
    f"documentation/licenses/{name}.txt"
    for name in ("fmi-headers", "license", "mingw-w64", "musl", "slide-fmu", "zig")
]
"""Members of every FMU."""


@pytest.mark.parametrize("positions", [0, 3])
@pytest.mark.parametrize("cell", [None, CellShape(contraction=0.9)])
@pytest.mark.parametrize("fmi", [2, 3])
def test_exported_fmu_passes_the_validation_of_fmpy(
    tmp_path: Path, positions: int, cell: CellShape | None, fmi: FmiVersion
) -> None:
    surrogate = random_surrogate(dataclasses.replace(TWO_MASSES, positions=positions, cell=cell))
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
            *LICENSES,
            HASHES,
            "model.png",
            "modelDescription.xml",
            "resources/provenance.json",
            "resources/surrogate.slide",
        ]
    assert [path.name for path in fmu.parent.iterdir()] == ["m.fmu"]


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
            *LICENSES,
            HASHES,
            "modelDescription.xml",
            "resources/surrogate.slide",
            "terminalsAndIcons/icon.png",
        ]


@pytest.mark.parametrize("fmi", [2, 3])
def test_run_fmu_gives_what_numpy_gives_for_both_standards(
    surrogate: Surrogate, tmp_path: Path, fmi: FmiVersion
) -> None:
    path = export_fmu(surrogate, tmp_path / "m.fmu", fmi=fmi)
    inputs = np.random.default_rng(2).uniform(-2, 3, (40, 2))
    columns = dict(zip(("u0", "u1"), inputs.T, strict=True))
    with unpacked(path) as fmu:
        run = run_fmu(fmu, columns, ["y0", "y1"])
        with refused(CoSimulationError, "0 = nan", "value reference"):
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
def test_fmu_holds_less_than_half_a_mebibyte_beyond_the_weights(
    fmu: Path, tmp_path: Path, fmi: FmiVersion
) -> None:
    """All platforms in one file stay below half a mebibyte."""
    surrogate = read_fmu(fmu)[0]
    path = export_fmu(surrogate, tmp_path / "m.fmu", fmi=fmi)
    with zipfile.ZipFile(path) as archive:
        weights = archive.getinfo("resources/surrogate.slide").compress_size
    print(f"FMI {fmi}: {path.stat().st_size - weights} bytes beyond the weights")
    assert path.stat().st_size - weights < 2**19


@pytest.mark.parametrize("name", ["../index.html", "/index.html", "", "a\\b"])
def test_documentation_stays_in_its_folder(
    surrogate: Surrogate, tmp_path: Path, name: str
) -> None:
    with refused(ValueError, "documentation file"):
        export_fmu(surrogate, tmp_path / "m.fmu", documentation={name: b""})


def test_export_without_compiled_runtime_names_the_command_that_builds_it(
    surrogate: Surrogate, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(platforms, "BINARIES", tmp_path)
    with refused(FileNotFoundError, "python -m slide_fmu.fmu.libraries.build"):
        export_fmu(surrogate, tmp_path / "m.fmu")


def test_a_payload_that_is_none_is_refused_by_its_beginning(
    surrogate: Surrogate, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = export_fmu(surrogate, tmp_path / "m.fmu")
    with zipfile.ZipFile(path) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    members[SURROGATE] = bytes(50_000_000)
    write_zip(path, members)
    largest = [0]
    read = zipfile.ZipExtFile.read

    def noted(file: zipfile.ZipExtFile, n: int | None = -1) -> bytes:
        content = read(file, n)
        largest[0] = max(largest[0], len(content))
        return content

    monkeypatch.setattr(zipfile.ZipExtFile, "read", noted)
    with refused(FmuError, "surrogate file"):
        read_fmu(path)
    assert largest[0] < 100


def test_fmu_of_another_version_is_refused_with_the_remedy(
    fmu: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    surrogate, old = read_fmu(fmu)[0], tmp_path / "old.fmu"
    monkeypatch.setattr("slide_fmu.fmu.export.PROVENANCE_FORMAT", 0)
    export_fmu(surrogate, old, provenance={"versions": {"slide-fmu": "0.2.0"}})
    monkeypatch.undo()
    with refused(FmuError, "slide-fmu (0.2.0)", "run its recipe again"):
        read_fmu(old)
