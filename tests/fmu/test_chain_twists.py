"""Chains whose axes cross at special angles, in the runtime and in numpy.

The runtime leaves products with 0 and 1 out, so that right angles have code of their own.
"""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from slide_fmu.features.chain_motion import ChainMotion
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.fmu.native import NativeSurrogate
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.any_step import outputs_of_steps
from tests.fmu.native import Load
from tests.fmu.samples import CellShape, Shape, random_surrogate

RIGHT = 0.5 * np.pi
TWISTS = (0.0, RIGHT, -RIGHT, np.pi, 0.7)
KINDS = ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))
"""Which of two joints are prismatic."""


def with_chain(
    surrogate: Surrogate, twists: tuple[float, ...], kinds: tuple[float, ...]
) -> Surrogate:
    """The same network on a chain with other angles between its axes."""
    network = surrogate.network
    assert isinstance(network, StateSpace)
    known = network.features
    motion = known.features
    assert isinstance(motion, ChainMotion)
    chain = replace(motion.chain, alpha=np.array(twists), prismatic=np.array(kinds))
    moved = ChainMotion(chain, motion.law, motion.middle, motion.half_range, motion.step)
    features = FeatureMap(moved, known.chosen, known.scaling)
    other = StateSpace(
        network.cell, network.n_samples, network.n_out, features, network.roles, network.turned
    )
    return replace(surrogate, network=other)


def of_angles(twists: tuple[float, ...], kinds: tuple[float, ...]) -> Surrogate:
    shape = Shape(n_inputs=2, n_outputs=2, features="chain", cell=CellShape())
    return with_chain(random_surrogate(shape), twists, kinds)


@pytest.mark.parametrize("kinds", KINDS)
@pytest.mark.parametrize("twists", list(itertools.product(TWISTS, repeat=2)))
def test_records_and_numpy_agree_at_special_angles(
    twists: tuple[float, ...], kinds: tuple[float, ...]
) -> None:
    surrogate = of_angles(twists, kinds)
    inputs = np.random.default_rng(1).uniform(-1, 1, (60, 2))
    expected = surrogate.predict_newest(inputs)[: surrogate.window.n_truncated]
    found = NativeSurrogate(surrogate).predict(inputs[None])[0][: len(expected)]
    np.testing.assert_allclose(found, expected, rtol=0, atol=2e-6 * np.ptp(expected))


@pytest.mark.parametrize("twists", [(RIGHT, 0.0), (-RIGHT, RIGHT), (np.pi, 0.0), (0.0, np.pi)])
def test_steps_and_numpy_agree_at_special_angles(twists: tuple[float, ...], load: Load) -> None:
    surrogate = of_angles(twists, KINDS[0])
    inputs = np.random.default_rng(2).uniform(-1, 1, (40, 2))
    expected = surrogate.predict_newest(inputs)
    found = outputs_of_steps(load(surrogate).instance().start(), inputs, 1.0)
    np.testing.assert_allclose(found, expected, rtol=0, atol=2e-6 * np.ptp(expected))
