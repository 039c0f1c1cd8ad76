"""Why harmonic forces of the Duffing recipe stay small: a large one has two lasting responses."""

from __future__ import annotations

import numpy as np
import pytest

from mbs_models.oscillators.oscillators import DuffingOscillator
from slide_fmu.systems.base import State
from slide_fmu.systems.simulation import simulate

FREQUENCIES = (40.0, 44.0, 48.0, 50.7, 54.0, 58.0)
"""Angular frequencies in rad/s, from the resonance of small motions upwards."""


def remaining_difference(amplitude: float, frequency: float, seconds: float) -> float:
    """Largest difference in the last second between motions from different initial states.

    Returns:
        Relative to the largest deflection of all of them.
    """
    system = DuffingOscillator(substeps=12)
    time = system.step * np.arange(round(seconds / system.step))
    inputs = (amplitude * np.sin(frequency * time))[:, None]
    starts = [(0.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (0.0, 60.0), (0.0, -60.0), (1.5, 60.0)]
    motions = np.array(
        [
            simulate(system, inputs, State(np.array([x]), np.array([v]), np.zeros(1))).outputs
            for x, v in starts
        ]
    )
    last = motions[:, -round(1.0 / system.step) :]
    return float(np.max(np.ptp(last, axis=0)) / np.max(np.abs(last)))


@pytest.mark.parametrize("frequency", FREQUENCIES)
def test_at_the_recipes_limit_the_initial_state_is_forgotten(frequency: float) -> None:
    # six seconds are five decay times to 1 % of the linearized oscillator
    assert remaining_difference(250.0, frequency, 6.0) < 0.01


@pytest.mark.extended
def test_beyond_the_recipes_limit_two_responses_last() -> None:
    differences = [remaining_difference(750.0, frequency, 20.0) for frequency in FREQUENCIES]
    assert max(differences) > 0.5
