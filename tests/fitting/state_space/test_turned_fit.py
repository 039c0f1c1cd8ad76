"""Fits of gated cells with states that turn: to a mass on a spring that turns with a chain."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.fitting.checkpoint import read_checkpoint
from slide_fmu.fitting.problem import Problem
from slide_fmu.fitting.state_space.cell import simulate
from slide_fmu.fitting.state_space.fit_data import fit_data
from slide_fmu.fitting.state_space.multi_start import MultiStart
from slide_fmu.recipe.learning import StateSpaceRecipe
from tests.fitting.plants import ARM
from tests.fitting.state_space.springs import (
    QUICK,
    WINDOW,
    Pair,
    fit,
    map_of,
    problem_of,
    relative_error,
)
from tests.progress import silent
from tests.refusals import refused

SOFTER = 0.5
"""How much softer the spring is along the direction that turns; across it, 0.8."""
TURNED_BETTER = 5.0
"""So many times the error of a unit that sees turned pairs of states is less than that of one
that does not."""
SMALL = 0.02
"""Error of the former on other motions, relative to the outputs."""
LOADS = ("wrench_change", "frame")
TABLE: dict[str, Any] = {
    "order": 6,
    "padding": 0,
    "hidden": 1,
    "units": "gated",
    "drive": LOADS[:1],
    "schedule": LOADS[1:],
}
TURNED = {**TABLE, "turned_pairs": 2}
LEVEL, UPRIGHT = (
    complex(0.65 - 0.25 * k, math.sqrt(0.3 - (0.65 - 0.25 * k) ** 2)) for k in (0.55, 0.8)
)
"""Poles of the mass: on a spring of the mean stiffness in the plane, and upright."""
EIGENVALUES = np.log(np.array([LEVEL, LEVEL, UPRIGHT])) / WINDOW.step
"""Of both directions in the plane, and upright."""


def joint_angles(seed: int) -> torch.Tensor:
    """Sums of slow sines, (6, 160, 2)."""
    rng = np.random.default_rng(seed)
    speed, phase = rng.uniform(0.1, 6, (6, 1, 2, 12)), rng.uniform(0, 2 * np.pi, (6, 1, 2, 12))
    size = rng.uniform(0, 1, (6, 1, 2, 12)) / speed * np.array([[2.0], [0.5]])
    time = WINDOW.step * np.arange(160)[None, :, None, None]
    return torch.from_numpy((size * np.sin(speed * time + phase)).sum(3))


def turning(inputs: torch.Tensor, features: FeatureMap) -> Pair:
    """A mass pushed by the chain's force, on a spring that turns with the chain."""
    loads = features.along(inputs.numpy()).astype(np.float64)
    cosine, sine = loads[:, :, 6], loads[:, :, 7]
    position, velocity, outputs = np.zeros((6, 3)), np.zeros((6, 3)), np.zeros((6, 161, 3))
    for k in range(160):
        along = np.stack([cosine[:, k], sine[:, k], np.zeros(6)], axis=1)
        soft = (along * position).sum(1, keepdims=True) * along
        velocity = 0.3 * velocity - 0.8 * position + SOFTER * soft + loads[:, k, :3]
        position = position + 0.5 * velocity
        outputs[:, k + 1] = position
    return inputs, torch.from_numpy(outputs)


def records(seed: int) -> Pair:
    return turning(joint_angles(seed), map_of(joint_angles(1), LOADS, ARM))


def problem_in(folder: Path, eigenvalues: Any = None) -> Problem:
    return problem_of(
        folder,
        names=LOADS,
        chain=ARM,
        training=records(1),
        validation=records(2),
        eigenvalues=eigenvalues,
    )


def runs(problem: Problem) -> dict[str, Any]:
    """The runs that a fit consisted of, by name."""
    return dict(read_checkpoint(problem.checkpoint, torch.device("cpu")))


@pytest.mark.extended
@pytest.mark.parametrize("eigenvalues", [None, EIGENVALUES], ids=["memories", "eigenvalues"])
def test_turned_pairs_find_what_turns_with_a_chain(tmp_path: Path, eigenvalues: Any) -> None:
    plain, turned = (problem_in(tmp_path / name, eigenvalues) for name in ("plain", "turned"))
    without, found = fit(plain, TABLE), fit(turned, TURNED)
    assert found.network.turned == 2
    assert without.network.turned == 0
    assert TURNED_BETTER * found.error < without.error
    assert relative_error(found.network, records(3)) < SMALL
    linear = [name for name in runs(turned) if name.startswith("linear")]
    assert linear == ["linear, 6 states, from turned pairs"]
    assert not any("turned" in name for name in runs(plain))


def multi_start_of(problem: Problem, **changes: Any) -> MultiStart:
    table, training = StateSpaceRecipe(**TURNED | changes), QUICK
    return MultiStart(fit_data(problem, table, training), silent)


@pytest.mark.parametrize("number", [0, 1])
def test_starts_keep_the_coordinates_of_pairs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    """The states of the linear model, neither scaled nor mixed; the unit acts on nothing yet."""
    multi_start = multi_start_of(problem_in(tmp_path, EIGENVALUES))
    linear, begun = multi_start.linear(6), []

    def descend(name: str, shape: Any, theta: torch.Tensor, *others: Any) -> Any:
        begun.append((shape, theta))
        return linear

    monkeypatch.setattr(multi_start, "run", descend)
    multi_start.start(linear, 1, number)
    ((shape, theta),) = begun
    assert (shape.turned, shape.n_units) == (2, 1)
    of_linear, of_start = linear.shape.split(linear.state.best), shape.split(theta)
    assert torch.equal(of_start.a, of_linear.a)
    assert torch.equal(of_start.b, of_linear.b)
    assert torch.equal(of_start.c, of_linear.c)
    features = multi_start.data.part.features
    for one, other in zip(
        simulate(shape, theta, features),
        simulate(linear.shape, linear.state.best, features),
        strict=True,
    ):
        torch.testing.assert_close(one, other)


def test_pairs_of_what_is_no_vector_are_refused(tmp_path: Path) -> None:
    """Refused before anything is fitted."""
    inputs, outputs = records(1)
    flat = problem_of(
        tmp_path, names=LOADS, chain=ARM, training=(inputs, outputs[:, :, :2]),
        validation=(inputs, outputs[:, :, :2]),
    )  # fmt: skip
    with refused(ValueError, "turned_pairs = 2", "2 with 6"):
        fit(flat, TURNED)
    frame = {**TURNED, "drive": ("frame",), "schedule": LOADS[:1]}
    with refused(ValueError, "turned_pairs = 2", "2 with 2"):
        fit(problem_in(tmp_path), frame)
    assert not flat.checkpoint.exists()
