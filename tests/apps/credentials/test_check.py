"""The subcommand ``check``: credentials are checked, and the experiment is repeated if asked."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from slide_fmu.apps.credentials import members
from slide_fmu.fmu.export import read_member
from slide_fmu.fmu.hashes import HASHES, hash_list
from slide_fmu.pipeline.check import check
from tests.acceptance.conftest import invoke
from tests.cosim.damage import members_of, packed
from tests.libraries import build_libraries

LINEAR = Path(__file__).parents[3] / "fmus" / "linear" / "linear.fmu"


@pytest.fixture(scope="module", autouse=True)
def _binaries() -> None:
    build_libraries()


def test_check_repeats_the_experiment_only_if_asked() -> None:
    assert check(LINEAR, run=False).repeated == {}
    checked = check(LINEAR, run=True)
    assert checked.problems == []
    assert list(checked.repeated) == ["credentials"]
    assert "replay" in checked.figures(LINEAR).repeated


def test_check_command_says_how_outputs_differ() -> None:
    result = invoke("check", LINEAR, "--run", "--json", "-")
    assert result.exit_code == 0, result.output
    assert "experiment of 557 steps, repeated here" in result.output
    found = json.loads(result.stdout[result.stdout.index("{") : result.stdout.rindex("}") + 1])
    assert found["replay"]["differences"]["position"] < 3e-5


def test_check_command_fails_where_results_are_others(tmp_path: Path) -> None:
    results = read_member(LINEAR, members.RESULTS)
    assert results is not None
    path = tmp_path / "linear.fmu"
    others = results.replace(b",1\n", b",0.5\n")
    path.write_bytes(packed({**members_of(LINEAR), members.RESULTS: others}))
    (problem,) = check(path, run=False).problems  # nothing is run
    assert problem.startswith(f"{members.RESULTS} has another content")
    changed = {**members_of(path)}
    del changed[HASHES]
    path.write_bytes(packed({**changed, HASHES: hash_list(changed)}))
    result = invoke("check", path, "--run")
    assert result.exit_code == 1
    assert "window_filled: the replayed experiment differs by 0.5" in " ".join(
        result.output.split()
    )


def test_check_names_damaged_credentials_without_running_anything(tmp_path: Path) -> None:
    path = tmp_path / "linear.fmu"
    path.write_bytes(packed({**members_of(LINEAR), members.MANIFEST: b"<a/>"}))
    (problem,) = check(path, run=False).problems
    assert problem.startswith(f"{members.MANIFEST}, line 1")


def test_check_names_a_member_of_the_experiment_that_is_not_read(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("slide_fmu.fmu.export.LARGEST_TEXT", len(_text(members.INPUTS)) - 1)
    monkeypatch.setattr("slide_fmu.pipeline.check.check_fmu", lambda *_: [])
    monkeypatch.setattr("slide_fmu.pipeline.check.read_fmu", lambda path: (None, None))
    (problem,) = check(LINEAR, run=False).problems
    assert "expected at most" in problem


def _text(name: str) -> bytes:
    content = read_member(LINEAR, name)
    assert content is not None
    return content
