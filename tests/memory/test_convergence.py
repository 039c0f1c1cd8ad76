"""Measured decay: pairs of motions that meet, and some that never do."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mbs_models.oscillators.oscillators import (
    DuffingOscillator,
    LinearOscillator,
)
from slide_fmu.core.signals import FloatArray
from slide_fmu.memory.convergence import NoGapError, measured_decay, measured_rate
from slide_fmu.systems.base import State
from tests.memory.plain_systems import Lag
from tests.refusals import refused

PAPER = math.log(100) / 4
"""1.151 s to 1 %: m = 1 kg, d = 8 N s/m."""


@pytest.mark.parametrize("amplitude", [0.1, 0.01, 1e-4])
def test_measured_decay_of_the_linear_oscillator_is_exact(amplitude: float) -> None:
    system = LinearOscillator()
    start = system.rest_state(np.array([800.0]))
    inputs = np.random.default_rng(0).uniform(-2000, 2000, (400, 1))
    found = measured_rate(system, inputs, start, system.rest_state(np.zeros(1)), amplitude)
    assert found == pytest.approx(-4, rel=0.02)


@pytest.mark.extended
def test_two_motions_of_a_bistable_duffing_never_meet() -> None:
    """Above its resonance a harmonic force has two lasting responses, large and small."""
    system = DuffingOscillator()
    inputs = 1000.0 * np.sin(55.0 * system.step * np.arange(600))[:, None]
    start = [State(np.array([x]), np.zeros(1), np.zeros(1)) for x in np.linspace(-2, 2, 9)]
    rates = [measured_rate(system, inputs, start[0], other) for other in start[1:]]
    assert 0.0 in rates
    assert min(rates) < math.log(0.01) / 3.0


def test_measured_decay_needs_two_motions_and_enough_samples() -> None:
    system = LinearOscillator()
    same = system.rest_state(np.zeros(1))
    with refused(ValueError, "the outputs are the same"):
        measured_rate(system, np.zeros((100, 1)), same, same)
    coarse = LinearOscillator(step=1.0, substeps=400)
    with refused(ValueError, "sample the system more finely"):
        measured_rate(coarse, np.zeros((100, 1)), same, coarse.rest_state(np.array([900.0])), 0.2)
    with refused(ValueError, "no inputs"):
        measured_decay(system, [], np.random.default_rng(0))


class DeadZone(Lag):
    """A lag of what an input exceeds half its range by."""

    def simulate(self, inputs: FloatArray) -> FloatArray:
        return super().simulate(np.sign(inputs) * np.maximum(np.abs(inputs) - 0.5, 0.0))


def test_pairs_of_motions_within_a_dead_zone_are_left_out() -> None:
    rng = np.random.default_rng(1)
    small, large = rng.uniform(-0.4, 0.4, (200, 1)), rng.uniform(-1.0, 1.0, (200, 1))
    found = measured_decay(DeadZone(), [small, small, large, large], rng)
    assert len(found.rates) == 2  # those that start after a large motion
    assert found.rates == pytest.approx([-2.0, -2.0], rel=1e-3)
    with refused(NoGapError, "different pasts"):
        measured_decay(DeadZone(), [small, small], rng)


def test_motions_that_meet_at_once_count_as_meeting_in_three_samples() -> None:
    records = [np.random.default_rng(index).uniform(-1.0, 1.0, (50, 1)) for index in range(3)]
    found = measured_decay(Lag(time_constant=0.001), records, np.random.default_rng(0))
    assert found.worst == pytest.approx(3 * 0.05)


def test_measured_rate_of_a_record_that_is_too_short_is_zero() -> None:
    system = LinearOscillator()
    first, second = system.rest_state(np.zeros(1)), system.rest_state(np.array([900.0]))
    assert measured_rate(system, np.zeros((50, 1)), first, second) == 0.0
