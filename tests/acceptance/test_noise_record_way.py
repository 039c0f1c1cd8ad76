"""From a measured record and one of its noise alone to an FMU, by the commands of a user."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import scipy.signal

import slide_fmu as slide
from slide_fmu.fmu.export import read_fmu
from tests.acceptance.conftest import invoke
from tests.libraries import build_libraries
from tests.own_records import RECIPE, STEP, force_and_travel

pytestmark = pytest.mark.extended

QUICK = "starts = 2\n[training.expert]\nstart_iterations = 10\nkept = 1\nkept_iterations = 10\n"
UNSEEN = 5200
"""From this sample on nothing is learnt."""
NAMED = 'model = "drifting.csv"\nnoise_record = "at_rest.csv"'


def drift(samples: int, seed: int) -> np.ndarray:
    """Noise of deviation 0.1 that lasts for some fifty samples."""
    white = np.random.default_rng(seed).normal(size=samples + 1000)
    return scipy.signal.lfilter([0.1 * np.sqrt(1 - 0.98**2)], [1.0, -0.98], white)[1000:]


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder in which the way was gone without the noise record, then with it."""
    build_libraries()
    folder = tmp_path_factory.mktemp("bench")
    force, travel = force_and_travel(6000)
    time = STEP * np.arange(6000)
    for name, columns, header in (
        ("drifting", (time, force, travel + drift(6000, 1)), "time [s],force [N],travel [m]"),
        ("at_rest", (time, drift(6000, 2)), "time [s],travel [m]"),
    ):
        np.savetxt(folder / f"{name}.csv", np.stack(columns, 1), "%.9g", ",", header=header,
                   comments="")  # fmt: skip
    for name, model in (("plain", 'model = "drifting.csv"'), ("weighted", NAMED)):
        text = RECIPE.replace('name = "bench"', f'name = "{name}"')
        recipe = folder / f"{name}.toml"
        recipe.write_text(text.replace('model = "bench.csv"', model) + QUICK)
        done = invoke("run", recipe, "--runs", folder / "runs", "--json", folder / f"{name}.json")
        assert done.exit_code == 0, done.output
    return folder


def error_beside_truth(fmu: Path) -> float:
    """Error relative to the travel without noise, about its mean, where nothing was learnt."""
    force, travel = force_and_travel(6000)
    predicted = slide.load(fmu).predict_newest(force[1:, None])[:, 0]
    return float((predicted - travel[1:])[UNSEEN:].std() / travel.std())


def test_surrogate_is_nearer_to_the_truth_with_the_noise_record(place: Path) -> None:
    plain, weighted = (
        error_beside_truth(place / f"runs/{n}/{n}.fmu") for n in ("plain", "weighted")
    )
    assert weighted < 0.7 * plain


def test_provenance_names_the_noise_record_with_its_hash(place: Path) -> None:
    origins = [read_fmu(place / f"runs/{n}/{n}.fmu")[1] for n in ("plain", "weighted")]
    assert origins[0] is not None
    assert origins[1] is not None
    assert "noise_record" not in origins[0]
    assert origins[1]["noise_record"]["file"] == "at_rest.csv"
    assert len(origins[1]["noise_record"]["sha256"]) == 64
    assert origins[0]["records"] == origins[1]["records"]


def test_report_tells_the_noise_and_keeps_the_error_unweighted(place: Path) -> None:
    plain, weighted = (
        json.loads((place / f"{n}.json").read_text()) for n in ("plain", "weighted")
    )
    page = (place / "runs/weighted/report.html").read_text(encoding="utf-8")
    assert "an autoregression of order 1 predicts all of it but" in page
    errors = [
        report["validation"]["in range"]["outputs"][0]["relative_rmse"]
        for report in (plain, weighted)
    ]
    assert errors[1] == pytest.approx(errors[0], rel=0.3)  # mostly the drift, in both


def test_noise_beside_the_error_is_that_of_the_noise_record(place: Path) -> None:
    """Without one only its white part is known: drift hides in the error."""
    floors = []
    for name in ("plain", "weighted"):
        report = json.loads((place / f"{name}.json").read_text())
        floors.append(report["validation"]["in range"]["outputs"][0]["relative_noise_floor"])
    assert floors[0] < 0.5 * floors[1]
    at_rest = np.loadtxt(place / "at_rest.csv", delimiter=",", skiprows=1)[:, -1]
    _, travel = force_and_travel(6000)
    assert floors[1] == pytest.approx(at_rest.std() / travel.std(), rel=0.2)
    cards = [(place / f"runs/{n}/card.md").read_text() for n in ("plain", "weighted")]
    assert all(
        f"{100 * floor:.3g} % is noise" in card for floor, card in zip(floors, cards, strict=True)
    )
    pages = [(place / f"runs/{n}/report.html").read_text() for n in ("plain", "weighted")]
    assert "by the flat bottom of the residuals" in pages[0]
    assert "by the noise record" in pages[1]


def test_fmu_is_not_measured_beside_another_noise_record(place: Path) -> None:
    file = place / "at_rest.csv"
    kept = file.read_bytes()
    try:
        file.write_bytes(b"\n".join(kept.splitlines()[:3000]) + b"\n")
        done = invoke("validate", place / "runs/weighted/weighted.fmu")
        assert done.exit_code == 1
        message = " ".join(done.output.split())
        assert "noise record 'at_rest.csv' has the SHA-256 hash" in message
        assert "restore the file, or train again" in message
    finally:
        file.write_bytes(kept)


def test_other_noise_record_makes_the_training_anew(place: Path) -> None:
    """The trajectories stay; the checkpoint is that of another noise."""
    before = (place / "runs/weighted/weighted.fmu").read_bytes()
    file = place / "at_rest.csv"
    kept = file.read_bytes()
    checkpoints = place / "runs/weighted/checkpoints"
    count = len(list(checkpoints.glob("surrogate-*.pt")))
    try:
        file.write_bytes(b"\n".join(kept.splitlines()[:3000]) + b"\n")
        done = invoke("run", place / "weighted.toml", "--runs", place / "runs")
        assert done.exit_code == 0, done.output
        assert len(list(checkpoints.glob("surrogate-*.pt"))) == count + 1
        assert (place / "runs/weighted/weighted.fmu").read_bytes() != before
    finally:
        file.write_bytes(kept)
