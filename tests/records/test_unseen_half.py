"""What the card of a record prints is the error on the half that nobody gave."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import slide_fmu as slide
from tests.acceptance.conftest import invoke
from tests.libraries import build_libraries
from tests.own_records import RECIPE, STEP, force_and_travel

pytestmark = pytest.mark.extended

APART = 1.3
"""Largest ratio of the two errors."""
GIVEN = 54
"""Number of moves from rest that are given; as many others are not."""
QUICK = "starts = 2\nexpert.start_iterations = 10\nexpert.kept = 1\nexpert.kept_iterations = 10\n"


def write(path: Path, *columns: np.ndarray) -> None:
    table = np.stack([STEP * np.arange(len(columns[0])), *columns], axis=1)
    np.savetxt(path, table, "%.9g", ",", header="time [s],force [N],travel [m]", comments="")


def card_error(folder: Path, text: str) -> tuple[float, float]:
    """Run a recipe in a folder, and return the relative RMSE of its card, and what it is over."""
    build_libraries()
    (folder / "bench.toml").write_text(text)
    done = invoke("run", folder / "bench.toml", "--runs", folder / "runs", "--json", "-")
    assert done.exit_code == 0, done.output
    report = json.loads((folder / "runs/bench/report.json").read_text(encoding="utf-8"))
    [output] = report["validation"]["in range"]["outputs"]
    return float(output["relative_rmse"]), float(output["rms_reference_about_mean"])


@pytest.mark.parametrize("noise", [0.01, 0.1])
def test_error_of_noisy_halves_that_differ_in_level(tmp_path: Path, noise: float) -> None:
    """The bend makes the answer depend on a level that changes eight times."""
    count = 9600
    rng = np.random.default_rng(3)
    level = np.repeat(rng.uniform(-0.8, 0.8, 8), count // 8)
    force = 0.6 * np.tanh(force_and_travel(count)[0]) + level
    linear = force_response(force)
    travel = linear + 0.15 * linear**3
    measured = travel + noise * travel.std() * rng.normal(size=count)
    half = count // 2
    write(tmp_path / "bench.csv", force[:half], measured[:half])
    card, size = card_error(tmp_path, RECIPE + QUICK)
    surrogate = slide.load(tmp_path / "runs/bench/bench.fmu")
    error = surrogate.predict_newest(force[half - 500 :, None])[:, 0] - measured[half - 500 :]
    unseen = float(np.sqrt(np.mean(error[500:] ** 2)) / size)
    assert max(card, unseen) < APART * min(card, unseen)


def test_error_of_motions_from_rest_that_are_shorter_than_the_window(tmp_path: Path) -> None:
    rng, moves = np.random.default_rng(5), []
    for number in range(2 * GIVEN):
        force = np.append(np.zeros(8), np.repeat(rng.uniform(-1, 1, 14), 8))
        linear = force_response(force)
        travel = linear + 0.15 * linear**3
        moves.append((force, travel + 0.01 * travel.std() * rng.normal(size=len(travel))))
        if number < GIVEN:
            write(tmp_path / f"{number}.csv", *moves[-1])
    files = f'model = "0.csv"\nfurther = {[f"{number}.csv" for number in range(1, GIVEN)]}\n'
    rest = files + 'parameters = { start = "rest" }'
    text = RECIPE.replace('model = "bench.csv"', rest) + QUICK + '\n[data]\nby = "record"\n'
    text = text.replace("n_in = 240", "n_in = 400")
    card, size = card_error(tmp_path, text)
    surrogate = slide.load(tmp_path / "runs/bench/bench.fmu")
    errors = [surrogate.predict_newest(f[1:, None])[:, 0] - y[1:] for f, y in moves[GIVEN:]]
    unseen = float(np.sqrt(np.mean(np.concatenate(errors) ** 2)) / size)
    assert max(card, unseen) < 0.1
    assert max(card, unseen) < APART * min(card, unseen)


def force_response(force: np.ndarray) -> np.ndarray:
    """The linear response of the oscillator of the other records, at rest first."""
    from scipy.signal import lfilter

    pole = np.exp((-4.0 + 20.0j) * STEP)
    denominator = [1, -2 * pole.real, abs(pole) ** 2]
    return np.asarray(lfilter([sum(denominator)], denominator, force))
