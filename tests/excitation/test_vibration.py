"""Vibration has its frequencies and accelerations, on smooth ways from point to point."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from slide_fmu.excitation import vibration
from tests.excitation.drawn import HIGH, JOINTS, LOW, kind_of, motion
from tests.refusals import refused

BURSTS: dict[str, Any] = {
    "angular_frequency": [20.0, 60.0],
    "acceleration": [4.0, 6.0, 9.0, 12.0],
}


@pytest.mark.parametrize("factor", [1.0, 2.0])
def test_vibration_has_its_frequencies_and_keeps_its_accelerations(
    factor: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(vibration, "REACH", 1e-6)
    still = kind_of("vibration", **BURSTS, single=0.0)
    fine = np.arange(0, 100, 0.002)
    positions = motion(still, JOINTS, 3, factor, fine)
    acceleration = np.abs(np.diff(positions, n=2, axis=0)).max(axis=0) / 0.002**2
    limits = factor * np.array(BURSTS["acceleration"])
    # the swelling of a burst adds little to the acceleration of its sine
    assert np.all(acceleration < 1.15 * limits)
    assert np.all(acceleration > 0.6 * limits)
    away = positions - positions.mean(axis=0)
    crossings = np.sum(np.diff(np.sign(away), axis=0) != 0, axis=0)
    lowest, highest = (np.array(BURSTS["angular_frequency"]) / np.pi * 100).tolist()
    assert np.all((lowest < crossings) & (crossings < highest))


def test_vibration_moves_smoothly_from_point_to_point() -> None:
    fine = np.arange(0, 60, 0.002)
    positions = motion(kind_of("vibration", **BURSTS), JOINTS, 5, 1.0, fine)
    assert np.all((positions >= LOW) & (positions <= HIGH))
    assert np.all(np.ptp(positions, axis=0) > 0.4 * (HIGH - LOW))
    jumps = np.abs(np.diff(positions, axis=0)).max(axis=0)
    fastest = 1.875 * 0.8 * (HIGH - LOW) / 2.0 + np.array(BURSTS["acceleration"]) / 20.0
    assert np.all(jumps < 0.002 * fastest)


def test_single_inputs_vibrate_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(vibration, "REACH", 1e-6)
    alone = kind_of("vibration", **BURSTS, single=1.0)
    fine = np.arange(0, 40, 0.002)
    positions = motion(alone, JOINTS, 2, 1.0, fine)
    moving = np.abs(np.diff(positions, axis=0)) > 1e-7
    assert np.mean(moving.sum(axis=1) <= 1) == 1.0
    assert np.all(moving.any(axis=0))


def test_without_an_acceleration_for_each_input_vibration_is_refused() -> None:
    with refused(ValueError, "expected 3", "4 values", "'q1', 'q2'"):
        kind_of("vibration", **BURSTS).check(JOINTS[:3])
