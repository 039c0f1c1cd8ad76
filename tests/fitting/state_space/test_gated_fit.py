"""Fits of gated cells: to a mass whose spring another input stiffens."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from tests.fitting.state_space.springs import WINDOW, Fitted, Pair, fit, problem_of, relative_error
from tests.marks import first

BETTER = 50.0
"""So many times the gated cell's error is less than the linear one's."""
FACTOR_BETTER = 5.0
"""That of a cell whose output has a factor, of a cell that has none."""
STIFFER = 0.35
"""Largest change of the spring's stiffness, which is 0.6 in the middle."""
LEVER = 0.5
"""How much an output's lever arm follows the schedule."""


def stiffened(seed: int, lever: float) -> Pair:
    """Force and a slow schedule, (6, 160, 2); lever times position of the mass, (6, 161, 1)."""
    rng = np.random.default_rng(seed)
    force = rng.uniform(-1, 1, (6, 160))
    phase, speed = rng.uniform(0, 2 * np.pi, (2, 6, 1))
    schedule = np.sin(phase + 0.02 * speed * np.arange(160))
    position, velocity, outputs = np.zeros(6), np.zeros(6), np.zeros((6, 161, 1))
    for k in range(160):
        stiffness = 0.6 + STIFFER * schedule[:, k]
        velocity = 0.3 * velocity - stiffness * position + force[:, k]
        position = position + 0.5 * velocity
        outputs[:, k + 1, 0] = (1 + lever * schedule[:, k]) * position
    inputs = np.stack([force, schedule], axis=2)
    return torch.from_numpy(inputs).float().double(), torch.from_numpy(outputs)


def fitted(folder: Path, lever: float, network: dict[str, Any]) -> Fitted:
    records = {"training": stiffened(1, lever), "validation": stiffened(2, lever)}
    problem = problem_of(folder, eigenvalues=None, **records)
    return fit(problem, {"order": 2, "padding": 0, **network})


GATED: dict[str, Any] = {"units": "gated", "schedule": ("inputs",), "hidden": 2}


@pytest.mark.extended
@pytest.mark.parametrize("lever", first([LEVER, 0.0]))
def test_gated_cell_follows_a_schedule(tmp_path: Path, lever: float) -> None:
    readout: tuple[str, ...] = ("inputs",) if lever else ()
    gated = fitted(tmp_path / "gated", lever, {**GATED, "readout": readout})
    linear = fitted(tmp_path / "linear", lever, {"hidden": 0, "readout": readout})
    assert BETTER * gated.error < linear.error
    unseen = stiffened(3, lever)
    errors = [relative_error(found.network, unseen) for found in (gated, linear)]
    assert BETTER * errors[0] < errors[1]
    cell = gated.network.cell
    assert cell.v is not None
    assert (cell.v.shape, cell.w.shape) == ((2, 2 + 2), (2, 2 + 1))
    assert gated.network.n_samples == WINDOW.n_in


@pytest.mark.extended
def test_lever_arms_need_factors(tmp_path: Path) -> None:
    with_factor, without = (
        fitted(tmp_path / str(len(readout)), LEVER, {**GATED, "readout": readout})
        for readout in (("inputs",), ())
    )
    assert FACTOR_BETTER * with_factor.error < without.error
