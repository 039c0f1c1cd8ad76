"""What is found to be wrong with credentials, without running anything."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from slide_fmu.apps.credentials import members
from slide_fmu.apps.credentials.members import METADATA
from slide_fmu.apps.credentials.problems import credential_problems, metadata_problems
from slide_fmu.core.version import WRITTEN_BY, __version__
from slide_fmu.cosim.ssv import parameters_of
from slide_fmu.fmu.export import EXTRA, SURROGATE, export_fmu, read_fmu, read_folder, read_member
from slide_fmu.pipeline.check import check
from slide_fmu.pipeline.documents import CARD, PAGE
from slide_fmu.surrogate.surrogate import Surrogate
from tests.apps.credentials.conftest import LINEAR, Changed
from tests.cosim.damage import members_of, packed
from tests.libraries import build_libraries
from tests.refusals import refused

DUFFING = Path(__file__).parents[3] / "fmus" / "duffing" / "duffing.fmu"


def member(name: str) -> bytes:
    content = read_member(LINEAR, name)
    assert content is not None
    return content


def test_credentials_of_a_released_fmu_have_no_problem(released: Surrogate) -> None:
    assert credential_problems(LINEAR, released) == []


def test_fmu_without_credentials_has_no_problem(released: Surrogate, tmp_path: Path) -> None:
    path = export_fmu(released, tmp_path / "plain.fmu")
    assert credential_problems(path, released) == []


def test_credentials_of_another_surrogate_are_found_out(
    released: Surrogate, changed: Changed
) -> None:
    other = released.to_bytes()[:-1] + b"x"
    (problem,) = credential_problems(changed(SURROGATE, other), released)
    assert "describes another resources/surrogate.slide: its SHA3-256 checksum is" in problem


@pytest.mark.parametrize("place", [CARD, PAGE, members.RESULTS])
def test_missing_file_that_the_manifest_names_is_a_problem(
    released: Surrogate, changed: Changed, place: str
) -> None:
    problems = credential_problems(changed(place, None), released)
    assert any(f"fmi-ls-manifest.xml names {place} (" in problem for problem in problems)


@pytest.mark.parametrize("name", ["METADATA", "MANIFEST", "EXPERIMENTS"])
@pytest.mark.parametrize("content", [b"", b"<a", b"<a/>", b"\xff"])
def test_document_that_is_none_is_a_problem(
    released: Surrogate, changed: Changed, name: str, content: bytes
) -> None:
    place = getattr(members, name)
    (problem,) = credential_problems(changed(place, content), released)
    assert problem.startswith(place)


def test_column_that_is_no_variable_is_a_problem(released: Surrogate, changed: Changed) -> None:
    inputs = member(members.INPUTS).replace(b"time,force", b"time,farce")
    (problem,) = credential_problems(changed(members.INPUTS, inputs), released)
    assert problem == (
        "the experiment has a column 'farce', which is no input of the FMU; expected one of "
        "['force']"
    )


def test_identity_of_an_fmu_does_not_depend_on_its_credentials(
    released: Surrogate, tmp_path: Path
) -> None:
    plain = export_fmu(released, tmp_path / "plain.fmu")
    description = read_member(plain, "modelDescription.xml")
    assert description == read_member(LINEAR, "modelDescription.xml")
    assert read_fmu(plain)[0].to_bytes() == read_fmu(LINEAR)[0].to_bytes()


@pytest.mark.parametrize("name", ["INPUTS", "RESULTS", "REFERENCE_MODEL"])
def test_table_of_times_alone_is_a_problem(
    released: Surrogate, changed: Changed, name: str
) -> None:
    place = getattr(members, name)
    times = b"\n".join(line.split(b",")[0] for line in member(place).splitlines())
    (problem,) = credential_problems(changed(place, times), released)
    assert problem.startswith(f"{place} begins with [['time']]")


def test_parameters_in_an_unknown_encoding_are_a_problem() -> None:
    content = b'<?xml version="1.0" encoding="nonsense"?><a/>'
    with refused(ValueError, "(unknown encoding"):
        parameters_of(content, "x.ssv")


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (rb'relative_rmse="[^"]*"', b'relative_rmse="1e-9"'),
        (rb"relative RMSE [\d.]+ %", b"relative RMSE 0.01 %"),
    ],
)
def test_metadata_with_other_figures_than_the_provenance_is_a_problem(
    tmp_path: Path, old: bytes, new: bytes
) -> None:
    build_libraries()
    whole = members_of(DUFFING)
    changed = re.sub(old, new, whole[METADATA])
    assert changed != whole[METADATA]
    path = tmp_path / "duffing.fmu"
    path.write_bytes(packed({**whole, METADATA: changed}))
    problems = check(path, run=False).problems
    assert any(f"{METADATA} does not say what resources/provenance.json" in p for p in problems)


def test_metadata_of_another_version_may_have_other_words(tmp_path: Path) -> None:
    surrogate, found = read_fmu(DUFFING)
    name = METADATA.removeprefix(f"{EXTRA}/")
    extra = read_folder(DUFFING, EXTRA)
    extra[name] = extra[name].replace(b"relative RMSE", b"relative error")
    for version, count in ((__version__, 1), ("0.9.0", 0)):
        path, origin = tmp_path / "duffing.fmu", {**(found or {}), WRITTEN_BY: version}
        export_fmu(surrogate, path, provenance=origin, extra=extra)
        problems = metadata_problems(path, surrogate, origin)
        assert min(len(problems), 1) == count
