"""The start of a training at another step follows the network that is known."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from scipy.linalg import expm

from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import Window
from slide_fmu.features.differences import Differences
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.network.state_space.cell import Cell, Roles
from slide_fmu.network.state_space.network import StateSpace
from training.starts.other_step import at_step

H = 0.03
"""Step of the known network in s."""

OSCILLATOR = np.array([[0.0, 1.0], [-40.0, -5.0]])


def known_network(gated: bool) -> StateSpace:
    """Two oscillators, in one or two pairs of states, with a few units; input: a force."""
    rng = np.random.default_rng(4)
    a = np.kron(np.eye(2), expm(OSCILLATOR * H))
    b = np.zeros((4, 2))
    b[:, 0] = (a - np.eye(4)) @ np.linalg.solve(np.kron(np.eye(2), OSCILLATOR), [0, 40, 0, 40])
    units, features = 3, 2
    e = 0.02 * rng.normal(size=(4, units))
    w = rng.normal(size=(units, features + 1 if gated else 4 + features + 1))
    v = rng.normal(size=(units, 4 + features)) if gated else None
    c, d, d0 = rng.normal(size=(1, 4)), np.zeros((1, features)), np.zeros(1)
    arrays = [None if m is None else m.astype(np.float32) for m in (a, b, e, w, c, d, d0, v)]
    a, b, e, w, c, d, d0, v = arrays
    cell = Cell(a, b, e, w, c, d, d0, "gated" if gated else "tanh", v)
    every = (0, 1)
    roles = Roles(every, every, every, every) if gated else None
    return StateSpace(cell, 80, 20, FeatureMap(Differences(1, 1)), roles)


def motions(step: float) -> FloatArray:
    """Smooth inputs, (4, 20 s / step, 1)."""
    time = step * np.arange(round(20 / step))
    rates = np.random.default_rng(5).uniform(1, 6, (4, 3, 1))
    return np.sin(rates * time).mean(axis=1)[:, :, None]


@pytest.mark.parametrize("gated", [False, True])
def test_start_at_a_finer_step_follows_the_known_network(gated: bool) -> None:
    known, window = known_network(gated), Window(0.02, 120, 30)
    start, off = at_step(known, Differences(1, 1), motions(0.02), Fraction(3, 2), window)
    assert (start.n_samples, start.n_out) == (120, 30)
    assert off < 0.02
    truth = known.run(known.features.along(motions(H)))[0][:, 200::2]  # every 60 ms
    found = start.run(start.features.along(motions(0.02)))[0][:, 300::3]
    count = min(truth.shape[1], found.shape[1])
    error = np.std(truth[:, :count] - found[:, :count]) / np.std(truth)
    assert error == pytest.approx(off, abs=0.005)
    assert start.features.scaling.scale[1] == pytest.approx(2 / 3, rel=0.01)
