"""The training loop: resumed without a trace, best weights kept, divergence reported."""

from __future__ import annotations

import math
import random
import signal
import subprocess
import sys
import time
from itertools import pairwise
from pathlib import Path

import pytest
import torch

import tests.fitting.regression as regression
from slide_fmu.fitting.errors import TrainingError
from slide_fmu.fitting.training import (
    evaluate,
    learning_rate,
    train,
)
from slide_fmu.fitting.windows import WindowData
from slide_fmu.recipe.learning import TrainingRecipe
from tests.fitting.regression import EXACT, RECIPE, Slow, regression_data
from tests.progress import silent
from tests.recipes import with_expert
from tests.refusals import refused

LEAST_SQUARES = 1e-6
"""RMSE that Adam reaches in 1500 steps on an exactly solvable problem, far below 1."""

SINGLE = 1e-6
"""The weights of a block are float32."""


def recipe(**changes: object) -> TrainingRecipe:
    found = with_expert(RECIPE, **changes)
    assert isinstance(found, TrainingRecipe)
    return found


@pytest.fixture(scope="module")
def unbroken(tmp_path_factory: pytest.TempPathFactory) -> dict[str, torch.Tensor]:
    weights, _ = regression.fit(tmp_path_factory.mktemp("unbroken") / "c.pt")
    return weights


@pytest.mark.extended
def test_killed_training_ends_with_the_weights_of_an_unbroken_one(
    tmp_path: Path, unbroken: dict[str, torch.Tensor]
) -> None:
    checkpoint, weights = tmp_path / "c.pt", tmp_path / "weights.pt"
    command = [sys.executable, regression.__file__, str(checkpoint), str(weights)]
    moments = random.Random(0)
    kill_after = moments.choice([60, 80, 100])
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        reached = next(int(line) for line in process.stdout if int(line) >= kill_after)
        time.sleep(moments.uniform(0.0, 0.2))  # up to one interval of checkpoints
        process.send_signal(signal.SIGKILL)
    assert process.returncode == -signal.SIGKILL
    assert not weights.exists()
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True)
    first = int(done.stdout.splitlines()[0])
    assert reached <= first < RECIPE.steps  # it did go on, from a checkpoint
    found = torch.load(weights, weights_only=True)
    assert found.keys() == unbroken.keys()
    assert all(torch.equal(found[key], unbroken[key]) for key in unbroken)


@pytest.mark.parametrize("stop_at", [0, 20, 100, 180, 200])
def test_stopped_training_goes_on_without_a_trace(
    tmp_path: Path, unbroken: dict[str, torch.Tensor], stop_at: int
) -> None:
    class Stop(Exception):
        pass

    def stop(done: int, total: int, error: float | None = None) -> None:
        if done == stop_at:
            raise Stop

    with pytest.raises(Stop):
        regression.fit(tmp_path / "c.pt", stop)
    reported: list[tuple[int, int, float]] = []
    weights, history = regression.fit(tmp_path / "c.pt", lambda *state: reported.append(state))
    assert all(torch.equal(weights[key], unbroken[key]) for key in unbroken)
    assert history.step == tuple(range(20, 201, 20))
    assert [done for done, _, _ in reported] == list(range(stop_at, 201, 20))
    assert reported[-1][2] == min(history.validation_error)
    _, whole = regression.fit(tmp_path / "other.pt")
    assert history == whole


def test_finished_training_is_not_repeated(tmp_path: Path) -> None:
    first, _ = regression.fit(tmp_path / "c.pt")
    before = (tmp_path / "c.pt").read_bytes()
    second, _ = regression.fit(tmp_path / "c.pt", delay=10.0)  # a single step would take minutes
    assert all(torch.equal(first[key], second[key]) for key in first)
    assert (tmp_path / "c.pt").read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["c.pt"]


def test_a_least_squares_problem_is_solved(tmp_path: Path) -> None:
    model = Slow()
    exact = recipe(
        steps=1500, weight_decay=0.0, input_jitter=0.0, validate_every=500, learning_rate=0.05
    )
    data, other = regression_data(1), regression_data(2)
    history = train(model, data, other, exact, tmp_path / "c.pt", silent)
    assert history.validation_error[-1] < LEAST_SQUARES
    assert torch.allclose(model.linear.weight, EXACT, atol=LEAST_SQUARES)
    assert history.step == (500, 1000, 1500)
    assert history.training_error[0] > history.training_error[-1]


def test_every_step_sees_other_windows_that_the_seed_chooses(tmp_path: Path) -> None:
    def seen(seed: int) -> list[tuple[float, ...]]:
        rows: list[tuple[float, ...]] = []

        class Watching(Slow):
            def forward(self, windows: torch.Tensor) -> torch.Tensor:
                if torch.is_grad_enabled():  # not a validation
                    rows.extend(map(tuple, windows[:, :, 0].tolist()))
                return super().forward(windows)

        data = regression_data(1)
        plain = recipe(seed=seed, steps=30, flip_signs=False, input_jitter=0.0)
        train(Watching(), data, data, plain, tmp_path / f"{seed}.pt", silent)
        return rows

    first, other = seen(1), seen(2)
    assert len(first) == 30 * 16
    assert len(set(first)) == 64  # all windows there are
    assert first[:16] != first[16:32]
    assert first != other
    assert set(first) == set(other)


def test_best_validation_weights_are_kept(tmp_path: Path) -> None:
    """Validation by the opposite targets: the longer the training, the worse."""
    data = regression_data(1)
    opposite = WindowData(data.inputs, -data.targets, data.window)
    model = Slow()
    history = train(model, data, opposite, RECIPE, tmp_path / "c.pt", silent)
    best = min(history.validation_error)
    assert best == history.validation_error[0] < history.validation_error[-1]
    assert evaluate(model, opposite) == pytest.approx(best, rel=1e-12)


def test_last_steps_are_validated_too(tmp_path: Path) -> None:
    odd = recipe(steps=25, validate_every=10)
    data = regression_data(1)
    assert train(Slow(), data, data, odd, tmp_path / "c.pt", silent).step == (10, 20, 25)


def test_evaluate_is_the_rmse_of_all_windows() -> None:
    data, model = regression_data(1), Slow()
    windows, targets = data.cut(torch.arange(data.n_windows))
    with torch.no_grad():
        expected = (model(windows) - targets).square().mean().sqrt()
    assert evaluate(model, data) == pytest.approx(float(expected), rel=1e-12)


def test_learning_rate_warms_up_and_falls_like_a_cosine() -> None:
    schedule = recipe(steps=100, learning_rate=1.0, warm_up=0.1, final_learning_rate=0.2)
    rates = [learning_rate(schedule, step) for step in range(101)]
    assert rates[:10] == pytest.approx([(k + 1) / 11 for k in range(10)])
    assert rates[10] == max(rates) == pytest.approx(1.0)
    assert rates[55] == pytest.approx(0.6)  # midway between highest and final
    assert rates[100] == pytest.approx(0.2)
    assert all(a > b for a, b in pairwise(rates[10:]))
    assert learning_rate(recipe(warm_up=0.0, learning_rate=1.0), 0) == 1.0


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_divergence_is_reported_with_its_remedy(tmp_path: Path, value: float) -> None:
    model, data = Slow(), regression_data(1)
    with torch.no_grad():
        model.linear.weight[0, 0] = value
    with refused(TrainingError, "loss at step 0", "lower training."):
        train(model, data, data, RECIPE, tmp_path / "c.pt", silent)
    with refused(TrainingError, "validation error", "lower training."):
        evaluate(model, data)


def test_too_high_a_learning_rate_diverges(tmp_path: Path) -> None:
    data, wild = regression_data(1), recipe(learning_rate=1e200, warm_up=0.0)
    with refused(TrainingError, "diverged"):
        train(Slow(), data, data, wild, tmp_path / "c.pt", silent)
    assert not (tmp_path / "c.pt").exists()  # nothing that a second try would go on from
