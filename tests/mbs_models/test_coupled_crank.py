"""A crank behind a coupling against rigid dynamics, and the cut machine against the whole."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mbs_models.slider_crank.coupled_crank import CoupledCrank
from mbs_models.slider_crank.slider_crank import director
from mbs_models.slider_crank.slider_crank_plant import (
    CRANK_LENGTH,
    CRANK_MASS,
    ROD_LENGTH,
    ROD_MASS,
)
from slide_fmu.core.signals import FloatArray
from tests.own_models.systems.cut_machine import relative_error
from tests.own_models.systems.motor_crank import MOTOR_CRANK
from tests.refusals import refused

SPEED = 1.0
"""Of the shaft in rad/s: slow enough for a rod that hardly bends."""


def inertia(angle: FloatArray) -> FloatArray:
    """Of a rigid mechanism at the crank, in kg m^2, from the speeds at 1 rad/s."""
    sine = CRANK_LENGTH * np.sin(angle) / ROD_LENGTH
    turn = -CRANK_LENGTH * np.cos(angle) / (ROD_LENGTH * np.sqrt(1 - sine**2))
    tip = CRANK_LENGTH * np.stack([-np.sin(angle), np.cos(angle)])
    end = tip + ROD_LENGTH * turn * np.stack([sine, np.sqrt(1 - sine**2)])
    rod = ((tip**2).sum(0) + (tip * end).sum(0) + (end**2).sum(0)) * ROD_MASS / 3
    return CRANK_MASS * CRANK_LENGTH**2 / 3 + rod + end[0] ** 2


def test_torque_at_a_constant_speed_is_that_of_rigid_bodies() -> None:
    system = CoupledCrank(bending_stiffness=50.0, step=0.02)
    angles = SPEED * 0.02 * np.arange(420)
    system.set_state(system.straight_state(0.0, SPEED))
    torque = np.array([system.advance(director(angle))[0] for angle in angles[1:]])
    slope = (inertia(angles[1:] + 1e-4) - inertia(angles[1:] - 1e-4)) / 2e-4
    expected = 0.5 * slope * SPEED**2
    assert np.abs(torque - expected)[200:].max() < 0.05 * np.abs(expected).max()


def test_crank_at_rest_needs_no_torque() -> None:
    system = CoupledCrank()
    system.begin(director(0.7))
    torque = [system.advance(director(0.7))[0] for _ in range(20)]
    assert np.abs(torque).max() < 1e-3


@pytest.mark.extended
def test_halves_follow_the_whole_machine(tmp_path: Path) -> None:
    partner = {"inertia": 0.5}
    command, step, stop = MOTOR_CRANK.drive(partner, 1, 1.5), 0.01, 1.5
    true = MOTOR_CRANK.whole(partner, command, step, stop)
    run = MOTOR_CRANK.run(tmp_path, {}, partner, command, step, stop)
    for name, values in true.items():
        assert relative_error(run[f"partner.{name}"], values) < 0.01
    added = run["partner.work"][-1] - MOTOR_CRANK.work(run, step)
    assert abs(added) < 2e-3 * run["partner.exchanged"][-1]


def test_shaft_without_direction_is_refused() -> None:
    with refused(ValueError, "shaft_x, shaft_y = [0. 0.]", "correct the input"):
        CoupledCrank().rest_state(np.zeros(2))
