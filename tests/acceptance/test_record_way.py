"""From a measured record to an FMU with its measured error, by the commands of a user."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import fmpy
import numpy as np
import pytest

import slide_fmu as slide
from slide_fmu.fmu.export import read_fmu
from slide_fmu.records import own_memory
from tests.acceptance.conftest import invoke
from tests.libraries import build_libraries
from tests.marks import needs_app
from tests.own_records import RECIPE, STEP, force_and_travel, write_record

NOISE = 0.02
NETWORK = "[network]\norder = 2\nhidden = 4\n"
QUICK = """starts = 2
expert.start_iterations = 10
expert.kept = 1
expert.kept_iterations = 10
"""


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder in which the whole way was gone; a space is in its name."""
    build_libraries()
    folder = tmp_path_factory.mktemp("a bench")
    write_record(folder / "bench.csv", 6000, noise=NOISE)
    (folder / "bench.toml").write_text(RECIPE + QUICK)
    done = invoke("run", folder / "bench.toml", "--runs", folder / "runs", "--json", "-")
    assert done.exit_code == 0, done.output
    return folder


def test_report_has_the_error_beside_the_noise_of_the_record(place: Path) -> None:
    report = json.loads((place / "runs/bench/report.json").read_text(encoding="utf-8"))
    [output] = report["validation"]["in range"]["outputs"]
    noise = NOISE * force_and_travel(6000)[1].std() / output["rms_reference_about_mean"]
    assert output["relative_noise_floor"] == pytest.approx(noise, rel=0.15)
    assert 0.95 * noise < output["relative_rmse"] < 2 * noise
    assert output["free_relative_rmse"] < 2 * noise
    assert report["window"]["fitted_decay_time_s"]["low"] > 0
    assert "reference_step_us" not in report["validation"]["in range"]["timing"]
    page = (place / "runs/bench/report.html").read_text(encoding="utf-8")
    assert "noise of what was measured" in page
    assert "bench.csv" in page


def test_fmu_that_contradicts_its_card_is_not_exported(
    place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As if no restart were allowed to change anything; the finished FMU stays as it was."""
    fmu = place / "runs/bench/bench.fmu"
    before = fmu.read_bytes()
    monkeypatch.setattr(own_memory, "CONTRACTION", 0.0)
    monkeypatch.setattr(own_memory, "CONTRADICTS", 0.0)
    done = invoke("run", place / "bench.toml", "--runs", place / "runs")
    assert done.exit_code == 1
    message = " ".join(done.output.split())
    assert "surrogate 'bench' is not exported: output 'travel' has a measured error of" in message
    assert "its own truncation error is" in message
    assert fmu.read_bytes() == before


def test_surrogate_that_a_run_has_refused_is_not_exported_either(
    place: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As above, without a finished FMU; the stages are those of the run, from its folder."""
    runs, folder = tmp_path / "runs", place / "runs/bench"
    shutil.copytree(folder, runs / "bench")
    (runs / "bench/bench.fmu").unlink()
    export = ("export", place / "bench.toml", "--runs", runs, "-o", tmp_path / "bench.fmu")
    with monkeypatch.context() as patch:
        patch.setattr(own_memory, "CONTRACTION", 0.0)
        patch.setattr(own_memory, "CONTRADICTS", 0.0)
        assert invoke("run", place / "bench.toml", "--runs", runs).exit_code == 1
    done = invoke(*export)
    assert done.exit_code == 1
    message = " ".join(done.output.split())
    assert "slide-fmu run has measured and refused it: surrogate 'bench' is not" in message
    assert "its own truncation error is" in message
    assert not (tmp_path / "bench.fmu").exists()
    assert invoke("run", place / "bench.toml", "--runs", runs).exit_code == 0
    assert invoke(*export).exit_code == 0


def test_record_that_has_changed_since_is_not_measured_on(place: Path) -> None:
    file, fmu = place / "bench.csv", place / "runs/bench/bench.fmu"
    whole = file.read_bytes()
    try:
        file.write_bytes(b"\n".join(whole.splitlines()[:3000]) + b"\n")
        done = invoke("validate", fmu)
        assert done.exit_code == 1
        message = " ".join(done.output.split())
        assert "record 'bench.csv' has the SHA-256 hash" in message
        assert "restore the file, or train again" in message
    finally:
        file.write_bytes(whole)
    assert invoke("validate", fmu).exit_code == 0


def test_fmu_follows_the_record_in_an_importer(place: Path) -> None:
    force, travel = force_and_travel(6000)
    rows = slice(5000, 6000)
    time = STEP * np.arange(1000)
    # what acts during a step is set at its start; the outputs are those at its end
    signals = np.array(
        list(zip(time, force[rows], strict=True)), dtype=[("time", "f8"), ("force", "f8")]
    )
    fmu = place / "runs/bench/bench.fmu"
    outputs = fmpy.simulate_fmu(
        str(fmu), stop_time=time[-1], output_interval=STEP, input=signals, output=["travel"]
    )
    error = outputs["travel"][300:] - travel[rows][300 : len(outputs)]
    assert np.sqrt(np.mean(error**2)) < 0.1 * travel.std()


def test_simulate_gives_the_error_that_the_report_says(place: Path) -> None:
    """Samples of a record are the truth: nothing is moved between them."""
    force, travel = force_and_travel(6000)
    rows = slice(5000, 6000)
    fmu, report = place / "runs/bench/bench.fmu", place / "runs/bench/report.json"
    simulated = slide.simulate(fmu, STEP * np.arange(1000), force[rows])[:, 0]
    own = slide.load(fmu).predict_newest(force[rows][1:, None])[:, 0]
    np.testing.assert_allclose(simulated[300:], own[299:], atol=1e-4 * travel.std())
    error = np.sqrt(np.mean((simulated - travel[rows])[300:] ** 2)) / travel[rows].std()
    figures = json.loads(report.read_text(encoding="utf-8"))["validation"]["in range"]
    assert error < 1.3 * figures["outputs"][0]["relative_rmse"]


def test_card_names_the_file_and_the_linear_fit(place: Path) -> None:
    card = (place / "runs/bench/card.md").read_text(encoding="utf-8")
    assert "\n| in range: bench.csv | " in card
    assert re.search(r"- [^:]+: [\d.]+ % is noise; free of the window the error is", card)
    page = (place / "runs/bench/report.html").read_text(encoding="utf-8")
    assert "trained on measured records; inputs of another kind it has never seen:" in page
    assert "from the slowest pole of a linear model that was fitted to the records" in page


def test_fmu_is_measured_again_where_its_record_lies(
    place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(place)
    done = invoke("validate", "runs/bench/bench.fmu", "--json", "again.json")
    assert done.exit_code == 0, done.output
    again = json.loads((place / "again.json").read_text())
    report = json.loads((place / "runs/bench/report.json").read_text(encoding="utf-8"))
    assert again["outputs"] == report["validation"]["in range"]["outputs"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        pytest.param(
            ("reference", "bench.toml", "-o", "reference.fmu"),
            "cannot be simulated",
            marks=needs_app("reference"),
        ),
        pytest.param(
            ("ssp", "runs/bench/bench.fmu", "-o", "both.ssp"),
            "cannot be simulated",
            marks=needs_app("reference"),
        ),
        (
            ("validate", "runs/bench/bench.fmu", "--amplitude", "1", "3"),
            "nothing beyond what was measured is known",
        ),
    ],
)
def test_what_needs_a_model_is_refused_in_words(
    place: Path, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...], message: str
) -> None:
    monkeypatch.chdir(place)
    done = invoke(*words)
    assert done.exit_code == 1
    assert message in " ".join(done.output.split())
    assert "Traceback" not in done.output


@pytest.mark.extended
def test_training_goes_on_from_the_network_of_an_fmu(place: Path) -> None:
    """One iteration on another record of the same system keeps what the first one has learnt."""
    write_record(place / "other.csv", 3000, seed=3, noise=NOISE)
    fmu = (place / "runs/bench/bench.fmu").as_posix()
    text = (RECIPE.replace("bench", "other") + QUICK).replace("iterations = 10\n", "", 1)
    text = text.replace(NETWORK, "")
    text = text.replace("[training]\n", f'[training]\niterations = 1\nstart = "{fmu}"\n')
    (place / "other.toml").write_text(text)
    done = invoke("run", place / "other.toml", "--runs", place / "runs")
    assert done.exit_code == 0, done.output
    report = json.loads((place / "runs/other/report.json").read_text(encoding="utf-8"))
    [output] = report["validation"]["in range"]["outputs"]
    assert output["relative_rmse"] < 2 * NOISE
    kept, gone_on = (slide.load(place / f"runs/{n}/{n}.fmu") for n in ("bench", "other"))
    assert gone_on.network.count_parameters() == kept.network.count_parameters()
    page = (place / "runs/other/report.html").read_text(encoding="utf-8")
    assert "Its training began with the network of bench.fmu." in page
    _, provenance = read_fmu(place / "runs/other/other.fmu")
    assert provenance is not None
    origin = provenance["start"]
    assert origin["file"] == "bench.fmu"
    assert len(origin["sha256"]) == 64


@pytest.mark.parametrize("other", [False, True])
def test_start_that_knows_samples_which_are_unseen_here_is_refused(
    place: Path, other: bool
) -> None:
    """The same division of the same record keeps what is unseen; another one does not."""
    fmu = (place / "runs/bench/bench.fmu").as_posix()
    text = RECIPE.replace('name = "bench"', 'name = "again"').replace(NETWORK, "")
    text = text.replace("[training]\n", f'[training]\nstart = "{fmu}"\n')
    if other:
        text += "[data]\nshares = { train = 0.5, validation = 0.2, test = 0.3 }\n"
    (place / "again.toml").write_text(text)
    done = invoke("try", place / "again.toml", "--runs", place / "runs")
    words = " ".join(done.output.split())
    assert ("has learnt from ['bench.csv'], divided otherwise" in words) == other, words
    assert done.exit_code == int(other)


def test_start_beside_a_network_of_the_recipe_is_refused(place: Path) -> None:
    fmu = (place / "runs/bench/bench.fmu").as_posix()
    text = RECIPE.replace("[training]\n", f'[training]\nstart = "{fmu}"\n')
    (place / "both.toml").write_text(text)
    done = invoke("try", place / "both.toml", "--runs", place / "runs")
    assert done.exit_code == 1
    message = " ".join(done.output.split())
    assert "with the table network = {'order': 2, 'hidden': 4}; expected none" in message


@pytest.mark.extended
def test_linear_network_of_a_record_goes_the_whole_way(place: Path) -> None:
    """Of a model its response is compared with the exact one, which no record has."""
    text = RECIPE.replace('name = "bench"', 'name = "linear"').replace("hidden = 4", "hidden = 0")
    (place / "linear.toml").write_text(text)
    done = invoke("run", place / "linear.toml", "--runs", place / "runs")
    assert done.exit_code == 0, done.output
    report = json.loads((place / "runs/linear/report.json").read_text(encoding="utf-8"))
    assert "response_matrix" not in report
    assert report["validation"]["in range"]["outputs"][0]["relative_rmse"] < 0.5


def test_start_with_an_fmu_of_other_signals_is_refused(place: Path) -> None:
    fmu = Path(__file__).parents[2] / "fmus" / "duffing" / "duffing.fmu"
    text = RECIPE.replace('name = "bench"', 'name = "wrong"').replace(NETWORK, "")
    text = text.replace("[training]\n", f'[training]\nstart = "{fmu}"\n')
    (place / "wrong.toml").write_text(text)
    done = invoke("run", place / "wrong.toml", "--runs", place / "runs")
    assert done.exit_code == 1
    assert "duffing.fmu' has the step 0.03; expected 0.01" in " ".join(done.output.split())
