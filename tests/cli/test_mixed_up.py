"""Files and folders that are mixed up at the command line are told by what they are."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.cli.test_habits import DUFFING, said
from tests.marks import of_app

MODEL = """
inputs = {"u": {"unit": "N", "range": [-1, 1]}}
outputs = {"y": "m"}
start = [0.0]


def f(x, u, p):
    return [u[0] - x[0]]


def g(x, u, p):
    return x
"""


@pytest.mark.parametrize("subcommand", ["info", "validate", "check", of_app("bench", "bench")])
def test_recipe_in_the_place_of_an_fmu_is_told(subcommand: str, tmp_path: Path) -> None:
    recipe = tmp_path / "spring.toml"
    recipe.write_text('name = "spring"\n', encoding="utf-8")
    code, output = said(subcommand, recipe)
    assert code == 1
    assert "spring.toml is a recipe or a task by its name; expected an FMU (.fmu)" in output
    assert "slide-fmu run spring.toml writes an FMU" in output


@pytest.mark.parametrize("subcommand", ["try", "run", "window", "generate", "train"])
@pytest.mark.parametrize("text", [None, 'name = "spring" 2'], ids=["no file", "no TOML"])
def test_recipe_that_cannot_be_read_is_told_before_any_work_is_shown(
    subcommand: str, text: str | None, tmp_path: Path
) -> None:
    recipe = tmp_path / "spring.toml"
    if text is not None:
        recipe.write_text(text, encoding="utf-8")
    code, output = said(subcommand, recipe)
    assert code == 1
    assert output.startswith("error: ")


@pytest.mark.parametrize(
    ("arguments", "found", "expected"),
    [
        (["init", "m.xlsx"], "'m.xlsx' is a spreadsheet by its name", "save its sheet as CSV"),
        (["init", "bench.toml"], "is a recipe or a task by its name", "run bench.toml writes"),
        (["run", "bench.csv"], "is a measured record by its name", "slide-fmu init bench.csv"),
        (["run", "rec.hdf"], "is a measured record by its name", "slide-fmu init rec.hdf"),
        (["info", "rec.hdf"], "is a measured record by its name", "slide-fmu init rec.hdf"),
        (["info", "model.py"], "is a Python file by its name", "slide-fmu init model.py"),
        (["init", "--kind", "fmu", "NEW"], "there is no such file", "the path of an FMU (.fmu)"),
        (["init", "--kind", "exudyn", "new.fmu"], "is an FMU by its name", "a Python file (.py)"),
    ],
)
def test_file_of_another_kind_is_named_with_what_to_do_with_it(
    arguments: list[str],
    found: str,
    expected: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("m.xlsx", "bench.toml", "bench.csv", "rec.hdf", "model.py"):
        Path(name).write_bytes(b"\x89HDF\r\n" if name == "rec.hdf" else b"1, 2\n")
    code, output = said(*arguments)
    assert code == 1
    assert found in output
    assert expected in output


@pytest.mark.parametrize("subcommand", ["try", "run", "window"])
def test_model_in_the_place_of_a_recipe_is_told(subcommand: str, tmp_path: Path) -> None:
    model = tmp_path / "spring.py"
    model.write_text(MODEL, encoding="utf-8")
    code, output = said(subcommand, model)
    assert code == 1
    assert "is a Python file by its name; expected a TOML file" in output
    assert "slide-fmu init spring.py" in output


def test_file_of_the_user_hides_no_package_from_python(tmp_path: Path) -> None:
    (tmp_path / "typer.py").write_text("raise ImportError('this is no typer')", encoding="utf-8")
    command = [sys.executable, "-m", "slide_fmu", "--version"]
    root = str(Path(__file__).parents[2])
    environment = {**os.environ, "PYTHONPATH": root}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


def test_path_through_a_file_is_told_as_such(tmp_path: Path) -> None:
    (tmp_path / "afile").write_text("text", encoding="utf-8")
    code, output = said("export", DUFFING, "-o", tmp_path / "afile" / "x.fmu")
    assert code == 1
    assert "a part of the path is a file; expected folders: check the path" in output
    code, output = said("info", DUFFING, "--json", tmp_path / "afile" / "x.json")
    assert code == 2
    assert "expected a file in a folder that can be written to" in output


def test_recipe_that_is_there_is_refused_before_the_model_is_simulated(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def simulate(*_: object) -> None:
        raise AssertionError("the model was simulated")

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("slide_fmu.propose.first_recipe.propose", simulate)
    Path("spring.py").write_text(MODEL, encoding="utf-8")
    Path("spring.toml").write_text("name = 'mine'", encoding="utf-8")
    Path("other.toml").write_text("name = 'mine'", encoding="utf-8")
    for more in ((), ("--name", "other")):
        code, output = said("init", "spring.py", *more)
        assert code == 1
        assert ".toml exists already; choose another with -o, or add --force" in output
    code, output = said("init", "--kind", "function", "other")
    assert code == 1
    assert not Path("other.py").exists()


def test_kind_with_a_slip_of_the_pen_has_a_suggestion(tmp_path: Path) -> None:
    code, output = said("init", tmp_path / "spring.py", "--kind", "functon")
    assert code == 1
    assert "kind of system 'functon'; expected one of ['class'," in output
    assert "did you mean 'function'?" in output
