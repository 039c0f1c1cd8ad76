"""The whole way: recipe to FMU to report, by the console script, with real models throughout."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest

from slide_fmu.cosim.whole_run import run_fmu
from slide_fmu.fmu.export import read_fmu, read_member
from slide_fmu.importer.file import unpacked
from slide_fmu.recipe.case import case_of
from tests.acceptance.conftest import SMALL_DUFFING, Finished, invoke
from tests.estimates import kept_estimates
from tests.few_motions import few_motions
from tests.marks import APPS, essential, needs_app

METADATA = "extra/org.ssp-standard.ssp-traceability.srmd/resourceMetaData.srmd"

FMU_TOLERANCE = 2e-6
"""FMU against numpy, relative to the output's range: rounding of single precision."""


def test_run_learns_the_duffing_oscillator_to_a_small_error(duffing: Finished) -> None:
    output = duffing.figures["validation"]["in range"]["outputs"][0]
    assert output["name"] == "position"
    assert output["unit"] == "m"
    # without learning the error would be the signal itself: relative RMSE 1
    assert output["relative_rmse"] < 0.5
    assert output["rmse"] == pytest.approx(
        output["relative_rmse"] * output["rms_reference_about_mean"]
    )
    assert output["max_error"] > output["rmse"]


def test_error_and_its_estimate_grow_beyond_the_range(duffing: Finished) -> None:
    inside, beyond = (duffing.figures["validation"][n] for n in ("in range", "beyond the range"))
    assert beyond["outputs"][0]["rmse"] > inside["outputs"][0]["rmse"]
    for found in (inside, beyond):
        (estimate,) = found["error_estimate"]["without_floor"]
        assert 0 < estimate["mean"] < 10


@pytest.mark.extended
def test_linear_recipe_finds_the_exact_response(linear: Finished) -> None:
    # the window truncates 2 s: initial effects of exp(-4 * 2) = 3e-4 remain
    assert linear.figures["validation"]["in range"]["outputs"][0]["relative_rmse"] < 1e-3
    assert linear.figures["response_matrix"]["max_deviation_relative"] < 1e-3


def test_run_leaves_report_card_and_picture(duffing: Finished) -> None:
    folder = duffing.fmu.parent
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert page.count("data-chart=") >= 10
    assert ('<iframe id="inside"' in page) == (APPS / "page").exists()
    for heading in ("Side by side", "Error estimate", "Window", "Training", "Time per step",
                    "Time at equal accuracy"):  # fmt: skip
        assert heading in page
    assert json.loads((folder / "report.json").read_text()) == duffing.figures
    card = (folder / "card.md").read_text(encoding="utf-8")
    percent = 100 * duffing.figures["validation"]["in range"]["outputs"][0]["relative_rmse"]
    assert f"{percent:.3g} %" in card
    assert "made by `slide-fmu run small_duffing.toml`." in card
    assert card.count("A step takes ") == 1
    assert "make release" not in card
    assert "](error_against_step.png)" in card
    assert (folder / "error_against_step.png").read_bytes().startswith(b"\x89PNG")


def test_check_of_a_finished_fmu_finds_nothing(duffing: Finished) -> None:
    result = invoke("check", duffing.fmu, "--json", "-")
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)["problems"] == []


@needs_app("credentials")
def test_finished_fmu_carries_an_experiment_that_can_be_repeated(duffing: Finished) -> None:
    result = invoke("check", duffing.fmu, "--run")
    assert result.exit_code == 0, result.output
    assert "repeated here" in result.output
    metadata = read_member(duffing.fmu, METADATA)
    percent = repr(duffing.figures["validation"]["in range"]["outputs"][0]["relative_rmse"])
    assert f'relative_rmse="{percent}"'.encode() in (metadata or b"")


def test_check_lists_the_problems_of_a_damaged_fmu(duffing: Finished, tmp_path: Path) -> None:
    damaged = tmp_path / "damaged.fmu"
    content = bytearray(duffing.fmu.read_bytes())
    content[len(content) // 2] ^= 0xFF
    damaged.write_bytes(content)
    result = invoke("check", damaged)
    assert result.exit_code == 1
    assert "Traceback" not in result.output


def test_info_shows_signals_provenance_and_measured_error(duffing: Finished) -> None:
    result = invoke("info", duffing.fmu, "--json", "-")
    info = json.loads(result.stdout)
    assert [signal["name"] for signal in info["inputs"]] == ["force"]
    assert info["provenance"]["recipe"] == SMALL_DUFFING
    assert info["provenance"]["measured"] == duffing.released
    assert info["provenance"]["seeds"]["data"] == 7
    assert {"torch", "exudyn", "numpy"} <= set(info["provenance"]["versions"])


@pytest.fixture
def alone(duffing: Finished, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The FMU in an empty folder, in which the tests work."""
    monkeypatch.chdir(tmp_path)
    return Path(shutil.copy(duffing.fmu, tmp_path / "alone.fmu"))


@pytest.fixture(scope="module")
def validated(
    duffing: Finished, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, dict[str, Any]]:
    """A folder in which the FMU was measured alone, and the figures that were printed."""
    folder = tmp_path_factory.mktemp("validated")
    fmu = shutil.copy(duffing.fmu, folder / "alone.fmu")
    with few_motions(), pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        call = ("--trajectories", 3, "--seed", 5, "--duration", 4, "--json", "-")
        result = invoke("validate", fmu, *call)
    assert result.exit_code == 0, result.output
    return folder, json.loads(result.stdout)


def test_validate_finds_the_reference_from_the_fmu_alone(
    duffing: Finished, validated: tuple[Path, dict[str, Any]]
) -> None:
    folder, figures = validated
    assert {
        "name",
        "unit",
        "rms_reference_about_mean",
        "rmse",
        "relative_rmse",
        "max_error",
    } <= set(figures["outputs"][0])
    assert set(figures["timing"]) == {"fmu_step_us", "reference_step_us", "speed"}
    assert figures["trajectories"] == 3
    assert figures["seed"] == 5
    assert (folder / "runs" / duffing.name / "validation" / "report.html").is_file()


@pytest.mark.extended
@pytest.mark.usefixtures("few_motions")
def test_validate_is_repeated_by_its_seed_and_keeps_reports_of_other_amplitudes(
    duffing: Finished, alone: Path, tmp_path: Path
) -> None:
    call = ("validate", alone, "--trajectories", 3, "--seed", 5, "--duration", 4, "--json", "-")
    figures, again = (json.loads(invoke(*call).stdout) for _ in range(2))
    assert again["outputs"] == figures["outputs"]
    other = json.loads(invoke(*call[:5], 6, *call[6:]).stdout)
    assert other["outputs"] != figures["outputs"]
    kept = tmp_path / "runs" / duffing.name / "validation" / "report.html"
    page = kept.read_bytes()
    assert invoke(*call, "--amplitude", 1, 2).exit_code == 0
    assert kept.read_bytes() == page
    assert kept.parent.with_name("validation_at_1_to_2").joinpath("report.html").is_file()


def test_validate_measures_what_the_trajectories_say(
    duffing: Finished, validated: tuple[Path, dict[str, Any]]
) -> None:
    """The JSON's figures against a computation from the models themselves, without FMUs."""
    from slide_fmu.data.draws import TEST, Stream, draw
    from slide_fmu.recipe.reading import load_recipe
    from slide_fmu.systems.simulation import simulate

    _, figures = validated
    recipe = load_recipe(duffing.recipe)
    system, surrogate = case_of(recipe).system, read_fmu(duffing.fmu)[0]
    stream = Stream(TEST, 5, (1.0, 1.0), 4.0)
    errors, references = [], []
    for index in range(3):
        drawn = draw(recipe, system, stream, index)
        outputs = simulate(system, drawn.inputs, drawn.initial).outputs[1:]
        first = drawn.burn_in
        errors.append((surrogate.predict_newest(drawn.inputs) - outputs)[first:])
        references.append(outputs[first:])
    rmse = float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))
    deviation = float(np.std(np.concatenate(references)))
    assert figures["outputs"][0]["rmse"] == pytest.approx(rmse, rel=1e-4)
    assert figures["outputs"][0]["rms_reference_about_mean"] == pytest.approx(deviation, rel=1e-9)


def test_finished_fmu_run_by_fmpy_gives_what_numpy_gives(duffing: Finished) -> None:
    surrogate, _ = read_fmu(duffing.fmu)
    inputs = np.random.default_rng(3).uniform(-1000, 1000, (300, 1))
    with unpacked(duffing.fmu) as fmu:
        names = ["position", "position_error_estimate", "window_filled"]
        run = run_fmu(fmu, {"force": inputs[:, 0]}, names)
    signal = surrogate.outputs[0]
    allowed = FMU_TOLERANCE * (signal.high - signal.low)
    assert np.max(np.abs(run.values[1:, :1] - surrogate.predict_newest(inputs))) < allowed
    np.testing.assert_allclose(run.values[1:, 1:2], surrogate.estimate_error(inputs), rtol=1e-4)
    filled = np.minimum(1, np.arange(301) / surrogate.network.n_samples)
    np.testing.assert_allclose(run.values[:, 2], filled)


def test_simulate_fmu_needs_nothing_but_the_file(duffing: Finished) -> None:
    result = fmpy.simulate_fmu(str(duffing.fmu), stop_time=3.0, start_values={"force": 200.0})
    # a held force of 200 N: static equilibrium k x (1 + alpha x^2) = F at 0.124 m
    assert result["position"][-1] == pytest.approx(0.124, abs=0.1)
    assert result["window_filled"][-1] == 1.0


def test_export_again_gives_the_same_surrogate_and_the_same_bytes(
    duffing: Finished, tmp_path: Path
) -> None:
    first, second = tmp_path / "first.fmu", tmp_path / "second.fmu"
    assert invoke("export", duffing.fmu, "-o", first).exit_code == 0
    assert invoke("export", first, "-o", second).exit_code == 0
    assert first.read_bytes() == second.read_bytes() == duffing.fmu.read_bytes()
    from_recipe = tmp_path / "from_recipe.fmu"
    call = ("export", duffing.recipe, "--runs", duffing.runs, "-o", from_recipe)
    assert invoke(*call).exit_code == 0
    assert read_fmu(from_recipe)[0].to_bytes() == read_fmu(duffing.fmu)[0].to_bytes()


@needs_app("reference")
def test_reference_fmu_of_a_recipe_is_valid(duffing: Finished, tmp_path: Path) -> None:
    from fmpy.validation import validate_fmu

    path = tmp_path / "reference.fmu"
    assert invoke("reference", duffing.recipe, "-o", path).exit_code == 0
    assert validate_fmu(str(path)) == []


def times_of_trajectories(finished: Finished) -> dict[str, int]:
    folder = finished.runs / finished.name / "trajectories"
    return {path.name: path.stat().st_mtime_ns for path in folder.rglob("*.npz")}


@pytest.mark.usefixtures("few_motions")
def test_finished_run_is_not_done_again(duffing: Finished) -> None:
    before = times_of_trajectories(duffing)
    with kept_estimates():
        result = invoke("train", duffing.recipe, "--runs", duffing.runs, "--json", "-")
    assert result.exit_code == 0
    surrogate = duffing.runs / duffing.name / "surrogate.slide"
    assert surrogate.read_bytes() == read_fmu(duffing.fmu)[0].to_bytes()
    assert times_of_trajectories(duffing) == before


def test_window_prints_both_decay_times(duffing: Finished) -> None:
    result = invoke("window", duffing.recipe, "--json", "-")
    figures = json.loads(result.stdout)
    assert figures["decay_time_s"]["worst"] == pytest.approx(1.1513, rel=0.01)
    ratio = figures["measured_decay_time_s"]["mean"] / figures["decay_time_s"]["mean"]
    assert 0.85 < ratio < 1.15
    assert figures["sufficient"] is True


MISTAKES = {
    "short window": ("window", ("n_in = 72", "n_in = 40"), r"n_in >= 71"),
    "unknown key": ("window", ("burn_in", "burnin"), r"data\.burnin is not a known key"),
    "wrong model": ("window", (":Duffing", ":Dufing"), r"DuffingOscillator"),
    "wrong parameter": ("window", ("substeps = 6", "substep = 6"), r"substeps"),
    "nothing trained": ("export", ("small_duffing", "never_trained"), r"train it first"),
    "no data": ("train", ("small_duffing", "never_generated"), r"generate them first"),
    "other data": ("train", ("seed = 7", "seed = 9"), r"generate them first"),
    "other training": ("export", ("steps = 500", "steps = 600"), r"train again"),
}


@pytest.mark.parametrize("case", essential(MISTAKES, "unknown key", "nothing trained"))
def test_mistake_in_a_recipe_is_answered_with_a_remedy(
    duffing: Finished, tmp_path: Path, case: str
) -> None:
    subcommand, (old, new), message = MISTAKES[case]
    recipe = tmp_path / "mistake.toml"
    recipe.write_text(SMALL_DUFFING.replace(old, new), encoding="utf-8")
    result = invoke(subcommand, recipe, "--runs", duffing.runs)
    assert result.exit_code == 1
    assert re.search(message, result.output)
    assert "Traceback" not in result.output


@pytest.mark.usefixtures("few_motions")
def test_short_window_is_accepted_with_allow_short(tmp_path: Path) -> None:
    recipe = tmp_path / "short.toml"
    text = SMALL_DUFFING.replace("n_in = 72", "n_in = 40\nallow_short = true")
    recipe.write_text(text, encoding="utf-8")
    result = invoke("window", recipe, "--json", "-")
    assert result.exit_code == 0
    assert json.loads(result.stdout)["sufficient"] is False


@pytest.mark.parametrize("content", [b"", b"no zip", b"PK\x03\x04 broken"])
@pytest.mark.parametrize("subcommand", ["info", "check", "validate", "export"])
def test_subcommand_refuses_a_file_that_is_no_fmu(
    tmp_path: Path, subcommand: str, content: bytes
) -> None:
    path = tmp_path / "bad.fmu"
    path.write_bytes(content)
    more = ("-o", tmp_path / "out.fmu") if subcommand == "export" else ()
    result = invoke(subcommand, path, *more)
    assert result.exit_code == 1
    assert str(path) in result.output
    assert not (tmp_path / "out.fmu").exists()
