"""What a new user meets at the command line: mistakes in paths and options, and plain answers."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from slide_fmu.cli.app import app
from slide_fmu.cli.console import progress_bars
from slide_fmu.core.measures import percent
from slide_fmu.core.units import behind
from slide_fmu.fmu.export import PROVENANCE, SURROGATE, export_fmu, read_fmu
from slide_fmu.pipeline.job import open_job
from slide_fmu.report.run_figures import released_figures
from slide_fmu.validation.row import row_at
from tests.acceptance.conftest import SMALL_LINEAR
from tests.cosim.damage import members_of, packed, without
from tests.marks import of_app
from tests.own_models.quarter_car import build_in_c

ROOT = Path(__file__).parents[2]
DUFFING = ROOT / "fmus" / "duffing" / "duffing.fmu"
RELEASED = sorted((ROOT / "fmus").glob("*/*.fmu"))


def said(*arguments: object) -> tuple[int, str]:
    """The exit code and all that the console script prints."""
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    return result.exit_code, result.output


@pytest.mark.parametrize(
    "subcommand",
    ["info", "check", "export", "validate", of_app("bench", "bench")],
)
def test_missing_fmu_is_told_in_words(subcommand: str, tmp_path: Path) -> None:
    more = ("-o", tmp_path / "x.fmu") if subcommand == "export" else ()
    code, output = said(subcommand, tmp_path / "nothere.fmu", *more)
    assert code == 1
    assert "nothere.fmu': there is no such file or folder: check the path" in output
    assert "Errno" not in output


def test_folder_in_the_place_of_a_file_is_told_in_words(tmp_path: Path) -> None:
    for subcommand in ("info", "check"):
        code, output = said(subcommand, tmp_path)
        assert code == 1
        assert f"'{tmp_path}': is a folder; expected a file: check the path" in output


def test_recipe_that_cannot_be_read_is_told_in_words(tmp_path: Path) -> None:
    code, output = said("try", tmp_path / "nothere.toml")
    assert code == 1
    assert "nothere.toml' cannot be read (" in output
    assert "there is no such file or folder" in output
    assert "Errno" not in output
    code, output = said("run", DUFFING)
    assert code == 1
    assert "duffing.fmu' is an FMU by its name; expected a TOML file" in output
    assert "slide-fmu info duffing.fmu" in output
    (tmp_path / "no_text.toml").write_bytes(b"\xff\xfe")
    code, output = said("run", tmp_path / "no_text.toml")
    assert code == 1
    assert "no_text.toml' is no text (" in output
    assert "expected a TOML file such as training/duffing.toml" in output


@pytest.mark.parametrize("duration", ["0", "nan", "-1", "inf"])
@pytest.mark.parametrize("subcommand", ["validate", of_app("ssp", "reference")])
def test_duration_that_is_no_time_is_refused_in_the_same_words(
    subcommand: str, duration: str, tmp_path: Path
) -> None:
    more = ("-o", tmp_path / "x.ssp") if subcommand == "ssp" else ("--trajectories", 1)
    code, output = said(subcommand, DUFFING, f"--duration={duration}", *more)
    assert code == 1
    assert f"duration = {float(duration)} s; expected a positive, finite time" in output


def test_fmu_of_another_tool_is_told_from_those_of_slide_fmu(tmp_path: Path) -> None:
    path = tmp_path / "car.fmu"
    build_in_c(path)
    for subcommand in ("info", "check"):
        code, output = said(subcommand, path)
        assert code == 1
        assert "car.fmu was not made by slide-fmu" in output
        assert "can be a model to learn from (slide-fmu init FMU)" in output


def test_fmu_of_slide_fmu_without_its_surrogate_is_told_what_is_missing(tmp_path: Path) -> None:
    path = tmp_path / "duffing.fmu"
    path.write_bytes(packed(without(members_of(DUFFING), SURROGATE)))
    for subcommand in ("info", "check"):
        code, output = said(subcommand, path)
        assert code == 1
        assert f"duffing.fmu has no {SURROGATE}, which holds the surrogate" in output
        assert "was not made by" not in output


@pytest.mark.parametrize(
    "edit",
    [{"name": []}, {"name": 3}, {"name": {"a": 1}}, {"rmse": 10**400}, {"rmse": None}],
    ids=["list", "number", "object", "endless", "null"],
)
def test_info_tells_other_types_of_measured_figures_in_one_line(
    tmp_path: Path, edit: dict[str, object]
) -> None:
    members = members_of(DUFFING)
    found = json.loads(members[PROVENANCE])
    found["measured"]["validation"]["in range"]["outputs"][0].update(edit)
    path = tmp_path / "duffing.fmu"
    path.write_bytes(packed({**members, PROVENANCE: json.dumps(found).encode()}))
    code, output = said("info", path)
    assert code == 1
    error = [line for line in output.splitlines() if line.startswith("error: ")]
    assert len(error) == 1
    assert "is not in the form that slide-fmu writes" in error[0]
    assert "Traceback" not in output


@pytest.mark.parametrize("path", RELEASED, ids=lambda path: path.stem)
def test_info_is_a_page_for_people_with_signals_window_error_and_origin(path: Path) -> None:
    result = CliRunner().invoke(app, ["info", str(path)])
    assert result.exit_code == 0
    lines = result.stdout.splitlines()
    assert len(lines) <= 95
    figures = json.loads(CliRunner().invoke(app, ["info", str(path), "--json", "-"]).stdout)
    trained = read_fmu(path)[0].output_ranges
    for what in ("inputs", "outputs"):
        for index, signal in enumerate(figures[what]):
            low, high = signal["low"], signal["high"]
            if what == "outputs" and trained is not None:
                low, high = (float(f"{end:.4g}") for end in trained[index])
            limits = f"{low:g} .. {high:g}{behind(signal['unit'])}"
            (row,) = [line for line in lines if f" {what[:-1]} {signal['name']} " in line]
            assert f" {limits} " in row
            assert signal["description"] in row
    window = figures["window"]
    sees = (
        f"sees {window['n_in']} samples of the inputs and gives {window['n_out']} of the outputs"
    )
    assert f"{sees}; a sample is {window['step']:.10g} s" in result.stdout
    measured = released_figures(figures["provenance"])
    assert measured is not None
    row = row_at(measured.rows, "in range", "all kinds", "plain", 1.0)
    assert row is not None
    assert percent(row.error) in result.stdout
    places = (
        "plain call, h = ",
        "in range",
        "The error in the plain call is",
        "signal ",
        "made by",
    )
    order = [result.stdout.index(words) for words in places]
    assert order == sorted(order)
    assert "slide-fmu info FMU --json - shows them" in lines[-1]


@pytest.mark.parametrize(
    ("provenance", "words"),
    [
        (None, ("carries no recipe of a reference system", "slide_fmu.simulate")),
        ({"recipe": "", "versions": {}}, ("carries no recipe",)),
        ({"recipe": "name = 'duffing'"}, ("run slide-fmu validate FMU",)),
    ],
)
def test_info_says_whether_the_error_of_an_fmu_can_be_measured(
    tmp_path: Path, provenance: dict[str, object] | None, words: tuple[str, ...]
) -> None:
    surrogate, _ = read_fmu(DUFFING)
    path = export_fmu(surrogate, tmp_path / "bare.fmu", provenance=provenance)
    _, line, *_ = CliRunner().invoke(app, ["info", str(path)]).stdout.splitlines()
    assert line.startswith("Its error ")
    assert all(word in line for word in words)


def test_number_without_a_unit_has_nothing_behind_it() -> None:
    assert (behind("1"), behind("N.m")) == ("", " N.m")
    result = CliRunner().invoke(app, ["info", str(ROOT / "fmus/slider_crank/slider_crank.fmu")])
    assert " -1 .. 1  " in result.stdout


def test_compiler_of_the_libraries_helps_and_compiles_nothing() -> None:
    command = [sys.executable, "-m", "slide_fmu.fmu.libraries.build"]
    helped = subprocess.run([*command, "--help"], capture_output=True, text=True, check=True)
    assert "--record" in helped.stdout
    assert ".so" not in helped.stdout
    wrong = subprocess.run([*command, "--recrod"], capture_output=True, text=True)
    assert wrong.returncode == 2


@pytest.mark.usefixtures("few_motions")
def test_window_keeps_its_figures_in_the_run_folder(tmp_path: Path) -> None:
    recipe, runs = tmp_path / "small.toml", tmp_path / "runs"
    recipe.write_text(SMALL_LINEAR, encoding="utf-8")
    result = CliRunner().invoke(app, ["window", str(recipe), "--runs", str(runs), "--json", "-"])
    assert result.exit_code == 0, result.output
    place = runs / "small_linear" / "window.json"
    assert json.loads(place.read_text(encoding="utf-8")) == json.loads(result.stdout)
    assert f"figures {place}" in result.output


def test_first_word_comes_before_the_work_on_a_recipe(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """Lengths that a recipe leaves open are found by simulation, which may take a minute."""

    def look(*_: object) -> None:
        raise ValueError(f"said so far: {capfd.readouterr().err!r}")

    monkeypatch.setattr("slide_fmu.pipeline.job.check_case", look)
    recipe = tmp_path / "small.toml"
    recipe.write_text(SMALL_LINEAR.replace("n_in = 72\nn_out = 8\n", ""), encoding="utf-8")
    with pytest.raises(SystemExit), progress_bars() as bar:
        open_job(recipe, tmp_path / "runs", bar)
    assert "said so far: 'recipe: 0 of 1" in capfd.readouterr().err
