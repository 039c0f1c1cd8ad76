"""Modes are found in a free response, and shapers make a linear oscillator stand still."""

from __future__ import annotations

import numpy as np
import pytest

from slide_fmu.apps.motion.shapers import NONE, RingingMode, Shaper, ringing_modes, shapers
from slide_fmu.core.signals import FloatArray

STEP = 0.01


def ringing(modes: list[tuple[float, float, float]], count: int = 300) -> FloatArray:
    """The sum of modes of frequency, damping ratio and amplitude, in two outputs."""
    time = STEP * np.arange(count)
    total = np.zeros((count, 2))
    for index, (frequency, damping, amplitude) in enumerate(modes):
        damped = frequency * np.sqrt(1 - damping**2)
        wave = amplitude * np.exp(-damping * frequency * time)
        total[:, 0] += wave * np.cos(damped * time + index)
        total[:, 1] += 0.3 * wave * np.sin(damped * time)
    return total


def test_two_modes_are_found_with_frequency_damping_and_order() -> None:
    found = ringing_modes(ringing([(12.0, 0.05, 1.0), (31.0, 0.1, 0.4)]), STEP)
    assert len(found) == 2
    for mode, (frequency, damping) in zip(found, [(12.0, 0.05), (31.0, 0.1)], strict=True):
        assert mode.frequency == pytest.approx(frequency, rel=1e-4)
        assert mode.damping == pytest.approx(damping, rel=1e-3)
    assert found[0].energy > found[1].energy > 0


def test_a_response_that_does_not_ring_has_no_modes() -> None:
    time = STEP * np.arange(300)[:, None]
    assert ringing_modes(np.exp(-3 * time), STEP) == []
    assert ringing_modes(np.zeros((300, 2)), STEP) == []
    assert ringing_modes(ringing([(12.0, 0.05, 1.0)], 20), STEP) == []


def left_over(shaper: Shaper, frequency: float, damping: float) -> float:
    """Vibration after the last impulse, relative to that of one impulse (Singer and Seering)."""
    decay = damping * frequency
    damped = frequency * np.sqrt(1 - damping**2)
    last = shaper.delays[-1]
    waves = shaper.parts * np.exp((decay + 1j * damped) * shaper.delays)
    return float(np.exp(-decay * last) * np.abs(waves.sum()))


MODES = [RingingMode(12.0, 0.05, 0.9), RingingMode(31.0, 0.1, 0.1)]


def test_shapers_leave_nothing_of_their_modes() -> None:
    found = {shaper.name: shaper for shaper in shapers(MODES)}
    assert list(found) == ["ZV on 1 mode", "ZVD on 1 mode", "ZV on 2 modes", "ZVD on 2 modes"]
    for name, shaper in found.items():
        assert np.all(np.diff(shaper.delays) >= 0)
        assert shaper.parts.sum() == pytest.approx(1.0)
        assert left_over(shaper, 12.0, 0.05) < 1e-12
        if "2 modes" in name:
            assert left_over(shaper, 31.0, 0.1) < 1e-12


def test_zvd_is_less_sensitive_to_the_frequency_than_zv() -> None:
    zv, zvd = shapers(MODES[:1])
    assert left_over(zvd, 12.6, 0.05) < 0.3 * left_over(zv, 12.6, 0.05)


def test_no_modes_have_no_shapers() -> None:
    assert shapers([]) == []
    assert NONE.parts.sum() == 1
