"""The remedy that a message names gives an FMU that is right where the record is silent.

Records with an uneven clock, or with two rates, of an oscillator whose course is known between and
beyond their samples. What ``init`` says is typed, as it stands there.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.signal import butter, sosfilt

import slide_fmu as slide
from tests.acceptance.conftest import invoke
from tests.libraries import build_libraries

pytestmark = pytest.mark.extended

FINE = 1e-3
"""Step in s at which the truth is integrated."""
GIVEN, UNSEEN = 40.0, 20.0
"""Durations in s of the record, and of the motion that is never given."""
NOISE = 2e-3
"""Of the record, relative to the deviation of the travel."""
RIGHT = 0.005
"""Largest relative RMS error against the truth."""
APART = 2.0
"""Largest ratio of this error and the card's."""
QUICK = "starts = 2\nexpert.start_iterations = 10\nexpert.kept = 1\nexpert.kept_iterations = 20\n"


def force_and_travel(duration: float, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times, a force of up to 2 Hz, and the travel that answers it, (N,) each, at ``FINE``."""
    time = np.arange(0.0, duration, FINE)
    low = butter(3, 2.0, fs=1 / FINE, output="sos")
    wanted = sosfilt(low, np.random.default_rng(seed).normal(size=len(time)))
    force = np.tanh(wanted / wanted.std())
    travel, place, speed = np.empty(len(time)), 0.0, 0.0
    for k, value in enumerate(force.tolist()):
        travel[k] = place
        for _ in range(2):
            speed += 0.5 * FINE * (400 * value - 8 * speed - 400 * place - 200 * place**3)
            place += 0.5 * FINE * speed
    return time, force, travel


def written(
    path: Path, time: np.ndarray, stamps: np.ndarray | None = None, slow: str = ""
) -> None:
    """Write what is measured at times, (N,), or stamped otherwise; a slow column in few rows."""
    fine, force, travel = force_and_travel(GIVEN, seed=0)
    noise = NOISE * travel.std() * np.random.default_rng(1).normal(size=len(time))
    columns = time, np.interp(time, fine, force), np.interp(time, fine, travel) + noise
    names = ("time [s]", "force [N]", "travel [m]")
    table = pd.DataFrame(dict(zip(names, columns, strict=True)))
    table["time [s]"] = (time if stamps is None else stamps).round(6)
    if slow:
        table.loc[table.index % 5 != 0, slow] = np.nan
    table.to_csv(path, index=False, float_format="%.8g")


def init(folder: Path, *more: str) -> tuple[int, str]:
    words = ("--input", "force", "--output", "travel", "-o", str(folder / "bench.toml"), "--force")
    done = invoke("init", folder / "bench.csv", *words, *more)
    return done.exit_code, " ".join(done.output.split())


def errors(folder: Path) -> tuple[float, float]:
    """Run the recipe; return the relative RMS error of the card, and that against the truth."""
    build_libraries()
    recipe = folder / "bench.toml"
    recipe.write_text(recipe.read_text(encoding="utf-8") + f"\n[training]\n{QUICK}")
    done = invoke("run", recipe, "--runs", folder / "runs", "--json", "-")
    assert done.exit_code == 0, done.output
    report = json.loads((folder / "runs/bench/report.json").read_text(encoding="utf-8"))
    [output] = report["validation"]["in range"]["outputs"]
    surrogate = slide.load(folder / "runs/bench/bench.fmu")
    fine, force, travel = force_and_travel(UNSEEN, seed=7)
    time = np.arange(0.0, fine[-1], surrogate.window.step)
    inputs, truth = (np.interp(time, fine, one) for one in (force, travel))
    later = 1 if surrogate.hold == "zero_order" else 0
    answer = surrogate.predict_newest(inputs[1 - later : len(inputs) - later, None])[:, 0]
    known = surrogate.memory_length
    off = answer[known:] - truth[1 + known :]
    unseen = np.sqrt(np.mean(off**2)) / output["rms_reference_about_mean"]
    return float(output["relative_rmse"]), float(unseen)


def test_longer_step_mends_an_uneven_clock(tmp_path: Path) -> None:
    steps = np.random.default_rng(2).uniform(0.004, 0.016, size=round(GIVEN / 0.01))
    times = np.cumsum(steps)
    written(tmp_path / "bench.csv", times[times < GIVEN - 0.02])
    code, said = init(tmp_path)
    assert code == 0
    assert "the clock is uneven" in said
    assert "or take a longer step: --step SECONDS" in said
    code, said = init(tmp_path, "--step", "0.02")
    assert code == 0, said
    card, unseen = errors(tmp_path)
    assert max(card, unseen) < RIGHT
    assert unseen < APART * card


def test_step_mends_stamps_that_are_off_even_samples(tmp_path: Path) -> None:
    """The samples are even, and what says when they were taken is not."""
    even = np.arange(0.0, GIVEN - 0.02, 0.01)
    off = np.sort(even + np.random.default_rng(3).uniform(0, 0.02, size=len(even)))
    written(tmp_path / "bench.csv", even, stamps=off)
    _, said = init(tmp_path)
    assert "the clock is uneven" in said
    assert "if only the stamps are off, give the step" in said
    code, said = init(tmp_path, "--time", "none", "--step", "0.01")
    assert code == 0, said
    card, unseen = errors(tmp_path)
    assert max(card, unseen) < RIGHT
    assert unseen < APART * card


@pytest.mark.parametrize("slow", ["travel [m]", "force [N]"])
def test_step_and_fill_mend_two_rates(tmp_path: Path, slow: str) -> None:
    """200 Hz and 40 Hz in one file, with empty cells."""
    written(tmp_path / "bench.csv", np.arange(0.0, GIVEN - 0.02, 0.005), slow=slow)
    code, said = init(tmp_path)
    assert code == 1
    assert "every 0.025 s (40 Hz)" in said
    assert "the file has two rates" in said
    [remedy] = re.findall(r"(--step \S+ --read fill=\d+) in slide-fmu init", said)
    code, said = init(tmp_path, *remedy.split())
    assert code == 0, said
    card, unseen = errors(tmp_path)
    assert max(card, unseen) < RIGHT
    assert unseen < APART * card
