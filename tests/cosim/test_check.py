"""Files that are no FMUs, or damaged ones, and what reading and checking them says."""

from __future__ import annotations

import zipfile
from pathlib import Path

import fmpy
import pytest

from slide_fmu.cosim.check import check_fmu
from slide_fmu.fmu.export import export_fmu, read_fmu
from slide_fmu.fmu.libraries.platforms import FmiVersion
from slide_fmu.importer.errors import CoSimulationError, FmuError
from tests.cosim.damage import members_of, packed
from tests.fmu.samples import TWO_MASSES, Shape, random_surrogate
from tests.libraries import build_libraries
from tests.refusals import refused


@pytest.fixture
def fmu(tmp_path: Path) -> Path:
    build_libraries()
    return export_fmu(random_surrogate(TWO_MASSES), tmp_path / "m.fmu")


def _changed(fmu: Path, replaced: dict[str, bytes | None]) -> Path:
    """A copy with members replaced, or left out when None."""
    members = {**members_of(fmu), **replaced}
    copy = fmu.with_name("changed.fmu")
    copy.write_bytes(packed({name: data for name, data in members.items() if data is not None}))
    return copy


def test_file_that_is_no_fmu_is_refused(fmu: Path, tmp_path: Path) -> None:
    text = tmp_path / "text.fmu"
    text.write_text("hello")
    data = fmu.read_bytes()
    cut, flipped = tmp_path / "cut.fmu", tmp_path / "flipped.fmu"
    cut.write_bytes(data[: len(data) // 2])
    with zipfile.ZipFile(fmu) as archive:
        at = archive.getinfo("resources/surrogate.slide").header_offset + 200
    flipped.write_bytes(data[:at] + bytes([data[at] ^ 0xFF]) + data[at + 1 :])
    without = _changed(fmu, {"resources/surrogate.slide": None})
    for path in (text, cut, flipped, without):
        with pytest.raises(FmuError):
            read_fmu(path)
        assert len(check_fmu(path)) == 1
    with refused(FmuError, "has no resources/surrogate.slide"):
        read_fmu(without)
    assert "there is no such file" in check_fmu(tmp_path / "absent.fmu")[0]


def test_check_names_the_faults_of_a_damaged_fmu(fmu: Path) -> None:
    description = "modelDescription.xml"
    xml = members_of(fmu)[description]
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
            "1 of 13 variables are not those of this version",
        ),
        ({description: xml.replace(b"</ModelVariables>", b"")}, description),
        ({description: None}, description),
        ({"resources/surrogate.slide": b"SLIDEFMU"}, "surrogate file"),
        *(
            ({name: data[:-9] + b"x" + data[-8:]}, f"binary {name} has the SHA-256 hash")
            for name, data in members_of(fmu).items()
            if name.startswith("binaries/")
        ),
        ({"binaries/linux32/two_masses.so": b"foreign"}, "linux32/two_masses.so is not of"),
        ({"../outside": b""}, "'../outside' leaves the folder"),
        ({"C:\\outside": b""}, "leaves the folder"),
    ]
    assert len(faults) == 13
    for replaced, expected in faults:
        problems = check_fmu(_changed(fmu, replaced))
        assert any(expected in problem for problem in problems), (expected, problems)


def test_check_loads_no_library_that_it_does_not_know(
    fmu: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def load(*_: object) -> None:
        raise CoSimulationError("a library was run")

    monkeypatch.setattr("slide_fmu.cosim.check.run_fmu", load)
    foreign = _changed(fmu, {f"binaries/{fmpy.platform}/two_masses.so": b"foreign"})
    assert len(check_fmu(foreign)) == 1
    assert "a library was run" in check_fmu(foreign, run_unknown=True)[0]
    assert "a library was run" in check_fmu(fmu)[0]


def test_member_that_is_there_twice_is_named(fmu: Path) -> None:
    members = members_of(fmu)
    fmu.write_bytes(packed(members, [("modelDescription.xml", b"other")]))
    assert "'modelDescription.xml' is there 2 times" in check_fmu(fmu)[0]


def test_member_that_unpacks_to_more_than_memory_holds_is_not_read(
    fmu: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("slide_fmu.fmu.export.LARGEST_SURROGATE", 10_000)
    monkeypatch.setattr("slide_fmu.cosim.archive.LARGEST", 10_000)
    large = _changed(fmu, {"resources/surrogate.slide": bytes(20_000)})
    with refused(FmuError, "expected at most 10000", "20000 bytes"):
        read_fmu(large)
    problem = check_fmu(_changed(fmu, {"extra/zeros": bytes(20_000)}))[0]
    assert "the FMU unpacks to" in problem


@pytest.mark.parametrize("fmi", [2, 3])
def test_check_has_nothing_to_say_about_an_fmu_that_forecasts_its_inputs(
    tmp_path: Path, fmi: FmiVersion
) -> None:
    """It is run with inputs that are known to the end of each step."""
    surrogate = random_surrogate(Shape(n_inputs=2, hold="first_order", forecasts=True))
    assert check_fmu(export_fmu(surrogate, tmp_path / "one.fmu", fmi=fmi)) == []
