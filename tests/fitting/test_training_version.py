"""Checkpoints of former code are used as long as the trainings give the same results.

Short trainings of all kinds are held to the results that they had when ``TRAINING_VERSION`` was
raised last. If this test fails, trainings give other results than before. If that is wanted,
raise ``TRAINING_VERSION`` in ``slide_fmu/fitting/checkpoint.py`` by 1, and put the new results
here, under the new version. If it is not, the change has a mistake.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import torch

from slide_fmu.bounds import fit as bounds
from slide_fmu.bounds.companion import Companion
from slide_fmu.data.trajectories import Split
from slide_fmu.fitting.checkpoint import TRAINING_VERSION
from slide_fmu.fitting.network import Fit, fit_network
from slide_fmu.fitting.preparation import Work
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import Recipe
from tests.progress import no_stages
from tests.recipes import ESTIMATOR, tiny_recipe, tiny_state_space_recipe

DIGITS = 1e-4
"""Relative difference of the same training on other processors, or with other versions of torch,
at most; a change of the code that changes results at all usually changes them by more."""

RESULTS: dict[int, dict[str, dict[str, float]]] = {
    6: {
        "feed-forward": {
            "surrogate": 0.9417400,
            "error estimator": 0.8025624,
            "prediction": 9.349718e-08,
        },
        "state-space": {
            "surrogate": 0.001400873,
            "companion": 0.002781056,
            "error bound": 0.08001552,
            "prediction": 3.400140e-04,
            "tolerance": 0.005373427,
        },
    },
}
"""The smallest validation error of each training, the RMS of a prediction in m, and the tolerance
of the bound in scaled units, by the version of the code."""

N = 320
"""Number of samples of a trajectory: 5 s."""

FEED_FORWARD = tiny_recipe(
    data={"estimator": 2, "estimator_validation": 1},
    network={"hidden": [6]},
    training={"expert": {"precision": "float64"}},
    estimator=ESTIMATOR,
)
STATE_SPACE = tiny_state_space_recipe(
    data={"duration": 5.0},
    network={"hidden": 3, "padding": 1},
    training={
        "starts": 2,
        "iterations": 4,
        "expert": {"segment": 64, "start_iterations": 3, "kept": 1, "kept_iterations": 3},
    },
    bound={"expert": {"hidden": [4], "steps": 50, "batch": 64, "attempts": 1}},
)


def split(seed: int, count: int) -> Split:
    """Return the response of the recipe's oscillator, x'' + 40 x' + 1600 x = u, to held forces.

    It is computed here, so that a change of systems or excitations changes nothing.
    """
    step = 1 / 64
    inputs = np.repeat(np.random.default_rng(seed).uniform(-1, 1, (count, N // 8, 1)), 8, axis=1)
    outputs = np.zeros((count, N + 1, 1))
    position, speed = np.zeros(count), np.zeros(count)
    for k in range(N):
        for _ in range(64):
            force = 0.99 * inputs[:, k, 0] - 40 * speed - 1600 * (position + 2e5 * position**3)
            speed += step / 64 * force
            position += step / 64 * speed
        outputs[:, k + 1, 0] = position
    return Split(inputs, outputs, np.zeros(count, np.int64))


COUNTS = {
    "train": 6,
    "validation": 3,
    "estimator": 4,
    "estimator_validation": 2,
    "companion": 6,
    "bound": 8,
    "calibration": 60,
}


@cache
def split_of(name: str) -> Split:
    """Return a split, which has a seed of its own."""
    return split(list(COUNTS).index(name), COUNTS[name])


@pytest.fixture(autouse=True)
def _fixed_data_and_threads(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """All trainings learn from the same data, with one thread."""
    monkeypatch.setattr(Work, "splits", lambda self, *names: [split_of(name) for name in names])
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


def results_of(fit: Fit) -> dict[str, float]:
    """Return what the test holds of a fit."""
    predicted = fit.surrogate.predict_newest(split_of("validation").inputs[0])
    errors = {stage: min(history.validation_error) for stage, history in fit.histories.items()}
    found = {**errors, "prediction": float(np.sqrt(np.mean(predicted**2)))}
    bound = fit.surrogate.bound
    return found if bound is None else {**found, "tolerance": float(bound.tolerances[0])}


def work_on(recipe: Recipe, folder: Path) -> Work:
    return Work(case_of(recipe), folder, folder, no_stages)


def test_trainings_give_the_results_of_their_version(tmp_path: Path) -> None:
    work = work_on(FEED_FORWARD, tmp_path)
    found = {"feed-forward": results_of(bounds._with_estimator(work, fit_network(work)))}
    work = work_on(STATE_SPACE, tmp_path)
    fit = fit_network(work)
    found["state-space"] = results_of(
        bounds._with_bound(work, fit, Companion(work, False).of(fit))
    )
    expected = RESULTS[TRAINING_VERSION]
    assert found == {kind: pytest.approx(values, rel=DIGITS) for kind, values in expected.items()}
