"""Archives that unpack to other files than those that were checked."""

from __future__ import annotations

import stat
import zipfile
from pathlib import Path

import fmpy
import pytest

from slide_fmu.cosim import archive
from slide_fmu.cosim.archive import archive_problems, library_problems
from slide_fmu.cosim.check import check_fmu
from slide_fmu.fmu.export import DESCRIPTION, export_fmu, read_json, read_member
from slide_fmu.fmu.libraries.platforms import FmiVersion
from slide_fmu.fmu.libraries.sources import Sources
from slide_fmu.fmu.native_library import NativeError
from slide_fmu.importer.errors import CoSimulationError, FmuError
from tests.cosim.damage import members_of, packed
from tests.fmu.samples import TWO_MASSES, random_surrogate
from tests.libraries import build_libraries
from tests.refusals import refused

FOREIGN = b"another library"


@pytest.fixture
def fmu(tmp_path: Path) -> Path:
    build_libraries()
    return export_fmu(random_surrogate(TWO_MASSES), tmp_path / "m.fmu")


def _with(fmu: Path, name: str) -> Path:
    """A copy with one more member."""
    copy = fmu.with_name("changed.fmu")
    copy.write_bytes(packed(members_of(fmu), [(name, FOREIGN)]))
    return copy


@pytest.mark.parametrize(
    "name", ["./binaries/{}", "binaries/./{}", "binaries//{}", "binaries/{}.", "binaries /{}"]
)
def test_member_that_unpacks_over_the_library_is_named_and_nothing_runs(
    fmu: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    def load(*_: object) -> None:
        raise CoSimulationError("a library was run")

    monkeypatch.setattr("slide_fmu.cosim.check.run_fmu", load)
    library = f"{fmpy.platform}/two_masses{fmpy.sharedLibraryExtension}"
    (problem,) = check_fmu(_with(fmu, name.format(library)))
    assert "is unpacked to different places" in problem


@pytest.mark.parametrize(
    "name", ["resources/con:fig", "resources\\a", "resources/\x1b[2J", "resources/?", "extra//"]
)
def test_member_with_a_name_that_some_systems_change_is_named(fmu: Path, name: str) -> None:
    (problem,) = archive_problems(_with(fmu, name))
    assert repr(name) in problem
    assert "is unpacked to different places" in problem


@pytest.mark.parametrize("name", ["MODELDESCRIPTION.xml", "Resources/surrogate.slide"])
def test_members_that_differ_by_capital_letters_are_named(fmu: Path, name: str) -> None:
    (problem,) = archive_problems(_with(fmu, name))
    assert name in problem
    assert "are one file on systems" in problem


def test_names_that_differ_by_how_letters_are_composed_are_named(fmu: Path) -> None:
    members = {**members_of(fmu), "extra/\u00e9": b"", "extra/e\u0301": b""}
    fmu.write_bytes(packed(members))
    assert len(archive_problems(fmu)) == 1


def test_library_below_a_folder_with_capital_letters_is_none_of_ours(fmu: Path) -> None:
    found = library_problems(_with(fmu, "Binaries/win32/a.dll"), "two_masses", 2, trusted=False)
    assert "binary Binaries/win32/a.dll is not of slide-fmu" in found[0]


def test_scalar_sources_that_cannot_be_compared_are_a_problem(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    surrogate = random_surrogate(TWO_MASSES)
    path = export_fmu(surrogate, tmp_path / "m.fmu", sources="scalar")

    def missing(*_: object) -> None:
        raise NativeError("no compiled runtime for this computer")

    monkeypatch.setattr(archive, "source_members", missing)
    (problem,) = archive.source_problems(path, surrogate.name, 2)
    assert "cannot be compared" in problem
    assert "no compiled runtime for this computer; check the FMU on another" in problem


@pytest.mark.parametrize("sources", [True, "scalar"])
@pytest.mark.parametrize("fmi", [2, 3])
def test_sources_of_others_are_named(tmp_path: Path, sources: Sources, fmi: FmiVersion) -> None:
    build_libraries()
    surrogate = random_surrogate(TWO_MASSES)
    path = export_fmu(surrogate, tmp_path / "m.fmu", fmi=fmi, sources=sources)
    assert check_fmu(path) == []
    members = members_of(path)
    changed = {**members, "sources/bound.c": b"int other;", "sources/foreign.c": b"int more;"}
    path.write_bytes(packed(changed))
    (problem,) = check_fmu(path)
    count = len({name for name in changed if name.startswith("sources/")})
    assert problem.startswith(f"2 of {count} files in sources/ are")
    assert "not those of slide-fmu, sources/bound.c first" in problem
    assert check_fmu(path, run_unknown=True) == []


def test_link_is_named(fmu: Path) -> None:
    link = zipfile.ZipInfo("resources/link")
    link.create_system, link.external_attr = 3, (stat.S_IFLNK | 0o777) << 16
    with zipfile.ZipFile(fmu, "a") as archive:
        archive.writestr(link, "/etc/passwd")
    (problem,) = archive_problems(fmu)
    assert problem.startswith("member 'resources/link' is a link")


def test_archive_behind_another_one_is_named(fmu: Path) -> None:
    """Who reads the directory at the place that the end tells finds the first archive's."""
    whole = fmu.read_bytes()
    fmu.write_bytes(whole[:-22] + whole)
    (problem,) = check_fmu(fmu)
    assert f"begins with {len(whole) - 22} bytes that are no member" in problem


def test_folders_and_plain_names_have_no_problem(fmu: Path) -> None:
    members = {**members_of(fmu), "extra/": b"", "extra/a.b-c d_(1).txt": b"", "extra/\u00e9": b""}
    fmu.write_bytes(packed(members))
    assert archive_problems(fmu) == []


@pytest.mark.parametrize("kind", [b'SYSTEM "http://127.0.0.1/x.dtd"', b'[<!ENTITY a "b">]'])
def test_model_description_with_a_document_type_is_a_problem(fmu: Path, kind: bytes) -> None:
    members = members_of(fmu)
    typed = members[DESCRIPTION].replace(b"?>", b"?><!DOCTYPE fmiModelDescription %s>" % kind, 1)
    fmu.write_bytes(packed({**members, DESCRIPTION: typed}))
    (problem,) = check_fmu(fmu)
    assert "modelDescription.xml has a document type" in problem


def test_text_that_takes_much_memory_is_not_read(
    fmu: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    members = {**members_of(fmu), "extra/a.json": bytes(20_000), "extra/a.txt": bytes(20_000)}
    fmu.write_bytes(packed(members))
    monkeypatch.setattr("slide_fmu.fmu.export.LARGEST_TEXT", 10_000)
    with refused(FmuError, "expected at most 10000", "20000 bytes"):
        read_json(fmu, "extra/a.json")
    assert read_member(fmu, "extra/a.txt") is not None
