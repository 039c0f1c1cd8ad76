"""``check`` notices every single edit of what an FMU says of itself."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner

from slide_fmu.cli.app import app
from slide_fmu.core.version import WRITTEN_BY, __version__
from slide_fmu.fmu.export import (
    DESCRIPTION,
    DOCUMENTATION,
    EXTRA,
    PROVENANCE,
    export_fmu,
    read_fmu,
    read_folder,
)
from slide_fmu.fmu.hashes import HASHES
from slide_fmu.importer.errors import FmuError
from slide_fmu.pipeline.check import check
from slide_fmu.pipeline.documents import CARD
from slide_fmu.pipeline.export import export_again
from tests.cosim.damage import members_of, packed
from tests.fmu.samples import Shape, random_surrogate
from tests.libraries import build_libraries
from tests.marks import essential
from tests.refusals import refused

RELEASED = {path.stem: path for path in (Path(__file__).parents[2] / "fmus").glob("*/*.fmu")}
DUFFING = RELEASED["duffing"]


@pytest.fixture(scope="module", autouse=True)
def _binaries() -> None:
    build_libraries()


def edited(tmp_path: Path, member: str, edit: Callable[[bytes], bytes]) -> Path:
    members = members_of(DUFFING)
    changed = edit(members[member])
    assert changed != members[member]
    path = tmp_path / "duffing.fmu"
    path.write_bytes(packed({**members, member: changed}))
    return path


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            b'<BaseUnit m="1" />',
            b'<BaseUnit m="1" factor="0.001" />',
            "UnitDefinitions/Unit 'm'/BaseUnit: factor = '0.001'; expected none",
        ),
        (b'min="-1000.0"', b'min="-9000.0"', "min = '-9000.0'; expected '-1000.0'"),
        (b'start="0.0"', b'start="500.0"', "start = '500.0'; expected '0.0'"),
        (b'stepSize="0.03"', b'stepSize="0.3"', "stepSize = '0.3'; expected '0.03'"),
        (b'max="0.99"', b'max="0.999"', "max = '0.999'; expected '0.99'"),
        (
            b'canGetAndSetFMUstate="true"',
            b'canGetAndSetFMUstate="false"',
            "canGetAndSetFMUstate = 'false'; expected 'true'",
        ),
        (b'dependencies=""', b'dependencies="1"', "dependencies = '1'; expected ''"),
        (b"samples of the inputs", b"times of the inputs", "description = "),
    ],
)
def test_each_attribute_of_the_description(
    tmp_path: Path, old: bytes, new: bytes, said: str
) -> None:
    path = edited(tmp_path, DESCRIPTION, lambda text: text.replace(old, new, 1))
    problems = check(path, run=False).problems
    assert problems
    assert said in problems[0]


def smaller(content: bytes) -> bytes:
    found = json.loads(content)
    for row in found["measured"]["rows"]:
        for output in row["outputs"]:
            output["relative_rmse"] /= 1000
    return json.dumps(found, sort_keys=True, indent=2, ensure_ascii=False).encode()


@pytest.mark.parametrize(
    ("member", "edit"),
    [
        (PROVENANCE, smaller),
        (CARD, lambda text: re.sub(rb"[\d.]+ %", b"0.0001 %", text, count=1)),
    ],
)
def test_figures_are_held_against_each_other(
    tmp_path: Path, member: str, edit: Callable[[bytes], bytes]
) -> None:
    before = check(DUFFING, run=False).problems
    new = [p for p in check(edited(tmp_path, member, edit), run=False).problems if p not in before]
    assert any("does not say what resources/provenance.json says" in p for p in new)


def written_by(path: Path, version: object) -> Path:
    """Write the FMU as another version would have done it, with other words on its card."""
    surrogate, found = read_fmu(DUFFING)
    documents = read_folder(DUFFING, DOCUMENTATION)
    name = CARD.removeprefix(f"{DOCUMENTATION}/")
    documents[name] = documents[name].replace(b"error", b"deviation")
    extra = read_folder(DUFFING, EXTRA)
    origin = {**(found or {}), WRITTEN_BY: version}
    return export_fmu(surrogate, path, provenance=origin, documentation=documents, extra=extra)


@pytest.mark.parametrize("again", [False, True], ids=["as it was", "exported again"])
def test_words_of_another_version_are_no_problem_and_left_out(tmp_path: Path, again: bool) -> None:
    path = written_by(tmp_path / "duffing.fmu", "0.9.0")
    if again:
        path = export_again(path, tmp_path / "again.fmu", 3, False)
    checked = check(path, run=False)
    assert checked.problems == []
    assert not any("model card" in part for part in checked.parts)
    line = (
        "the words of model card and credentials: version 0.9.0 of slide-fmu wrote them, and "
        f"this is {__version__}"
    )
    assert checked.left_out[0] == line
    assert checked.figures(path).not_checked == checked.left_out
    said = CliRunner().invoke(app, ["check", str(path)])
    assert said.exit_code == 0
    assert f"Not checked: {line}" in " ".join(said.stderr.split())


@pytest.mark.parametrize("version", [__version__, None, "", "a version", ["0.9.0"]])
def test_words_are_compared_where_no_other_version_is_named(
    tmp_path: Path, version: object
) -> None:
    checked = check(written_by(tmp_path / "duffing.fmu", version), run=False)
    assert any(f"{CARD} does not say what" in problem for problem in checked.problems)
    assert checked.left_out == ()


def test_damaged_figures_of_another_version_are_a_problem(tmp_path: Path) -> None:
    members = members_of(written_by(tmp_path / "duffing.fmu", "0.9.0"))
    path = tmp_path / "damaged.fmu"
    path.write_bytes(packed({**members, PROVENANCE: other_type(members[PROVENANCE])}))
    expected = f"{PROVENANCE} is not in the form that slide-fmu writes"
    assert any(problem.startswith(expected) for problem in check(path, run=False).problems)


def other_type(content: bytes) -> bytes:
    found = json.loads(content)
    found["measured"]["validation"]["in range"]["outputs"][0]["relative_rmse"] = "x"
    return json.dumps(found).encode()


def test_other_types_in_the_provenance(tmp_path: Path) -> None:
    problems = check(edited(tmp_path, PROVENANCE, other_type), run=False).problems
    expected = f"{PROVENANCE} is not in the form that slide-fmu writes"
    assert any(problem.startswith(expected) for problem in problems)


@pytest.mark.parametrize(
    "member",
    [
        "extra/org.fmi-standard.fmi-ls-ref/results.csv",
        "documentation/index.html",
        "documentation/licenses/zig.txt",
    ],
)
def test_hashes_tell_edits_of_all_other_members(tmp_path: Path, member: str) -> None:
    path = edited(tmp_path, member, lambda content: content.replace(b"\n", b"\r\n", 1) or b"")
    (problem,) = check(path, run=False).problems
    assert problem.startswith(f"{member} has another content")


def test_hashes_tell_members_that_are_missing_or_new(tmp_path: Path) -> None:
    members = members_of(DUFFING)
    path = tmp_path / "duffing.fmu"
    del members["documentation/licenses/zig.txt"]
    members["resources/new.txt"] = b"new"
    path.write_bytes(packed(members))
    missing, new = check(path, run=False).problems
    assert missing.startswith("documentation/licenses/zig.txt is missing since")
    assert new.startswith("resources/new.txt was added since")
    del members[HASHES]
    path.write_bytes(packed(members))
    (problem,) = check(path, run=False).problems
    assert problem.startswith(f"{HASHES} is missing")


def test_an_edited_report_is_not_taken_over(tmp_path: Path) -> None:
    path = edited(tmp_path, "documentation/index.html", lambda page: page + b"<p>0.0 %</p>")
    with refused(FmuError, "index.html has another content"):
        export_again(path, tmp_path / "again.fmu", 2, False)


def test_a_library_of_ones_own_is_no_edit_where_libraries_are_run(tmp_path: Path) -> None:
    fmu = export_fmu(random_surrogate(Shape(name="own")), tmp_path / "own.fmu", sources=True)
    members = members_of(fmu)
    members["binaries/arm-none/own.a"] = b"library"
    fmu.write_bytes(packed(members))
    assert check(fmu, run=True).problems == []
    assert any("arm-none" in problem for problem in check(fmu, run=False).problems)


@pytest.mark.parametrize("name", essential(sorted(RELEASED), "duffing"))
def test_released_fmu_has_no_problems(name: str) -> None:
    assert check(RELEASED[name], run=False).problems == []
    assert read_fmu(RELEASED[name])[1] is not None
