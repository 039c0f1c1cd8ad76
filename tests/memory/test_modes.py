"""Modes of linearized systems against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from slide_fmu.core.signals import FloatArray
from slide_fmu.memory.modes import (
    UnstableModeError,
    nullspace,
    slowest_rate,
    spectrum,
    time_to_decay,
)
from slide_fmu.systems.base import Linearization, StateMatrix
from tests.refusals import refused

CLOSED_FORM = 1e-9
"""Relative; the eigenvalues of a chain of 40 masses keep about 11 digits."""


def linear(
    mass: object, damping: object, stiffness: object, constraints: object = None
) -> Linearization:
    m, d, k = (np.atleast_2d(np.asarray(a, dtype=float)) for a in (mass, damping, stiffness))
    g = np.zeros((0, len(m))) if constraints is None else np.asarray(constraints, dtype=float)
    return Linearization(m, d, k, g)


def chain(n: int, a: float, b: float) -> tuple[Linearization, FloatArray]:
    """n unit masses, fixed-free, k = 900 N/m, D = a M + b K; and the natural frequencies."""
    stiffness = 900.0 * (2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    stiffness[-1, -1] = 900.0
    omega = 60.0 * np.sin((2 * np.arange(1, n + 1) - 1) * math.pi / (2 * (2 * n + 1)))
    return linear(np.eye(n), a * np.eye(n) + b * stiffness, stiffness), omega


def in_order(values: list[complex]) -> list[complex]:
    return sorted(values, key=lambda v: (round(v.imag, 6), v.real))


@pytest.mark.parametrize("n", [1, 2, 5, 40])
@pytest.mark.parametrize(("a", "b"), [(1.0, 0.0), (0.5, 1e-3), (0.0, 0.05)])
def test_modes_of_a_chain_of_masses_are_those_of_the_closed_form(
    n: int, a: float, b: float
) -> None:
    linearization, omega = chain(n, a, b)
    half = 0.5 * (a + b * omega**2)
    root = np.sqrt((half**2 - omega**2).astype(complex))
    expected = np.concatenate([-half + root, (-half - root)[root.real > 0]])
    found = spectrum(linearization)
    assert_allclose(
        in_order([mode.eigenvalue for mode in found.modes]),
        in_order((expected.real + 1j * np.abs(expected.imag)).tolist()),
        rtol=CLOSED_FORM,
    )
    assert found.rigid == ()
    assert found.n_instant == 0
    assert found.decay_time == pytest.approx(math.log(0.01) / expected.real.max())


def test_mode_of_the_paper_s_oscillator_has_its_published_decay_time() -> None:
    found = spectrum(linear(1.0, 8.0, 1600.0))
    (mode,) = found.modes
    assert mode.natural_frequency == pytest.approx(40.0)
    assert mode.damping_ratio == pytest.approx(0.1)
    assert found.decay_time == pytest.approx(math.log(100) / 4)
    assert spectrum(linear(1.0, 8.0, 1600.0), 0.1).decay_time == pytest.approx(math.log(10) / 4)


@pytest.mark.parametrize("angle", [0.0, 0.7, math.pi / 2, 3.0])
@pytest.mark.parametrize("copies", [1, 2])
def test_modes_of_a_pendulum_in_redundant_coordinates_are_those_of_its_angle(
    angle: float, copies: int
) -> None:
    """Centre of mass x, y and angle of a rod on a joint with spring and damper."""
    mass, inertia, length, k, d, drag = 2.0, 0.4, 1.5, 70.0, 3.0, 0.8
    joint = [[1, 0, length * math.sin(angle)], [0, 1, -length * math.cos(angle)]]
    linearization = linear(
        np.diag([mass, mass, inertia]),
        np.diag([drag, drag, d]),
        np.diag([0.0, 0.0, k]),
        joint * copies,
    )
    total = inertia + mass * length**2
    half = 0.5 * (d + drag * length**2) / total
    (mode,) = spectrum(linearization).modes
    assert mode.eigenvalue == pytest.approx(complex(-half, math.sqrt(k / total - half**2)))


def test_nullspace_is_orthonormal_and_meets_the_constraints() -> None:
    rng = np.random.default_rng(0)
    constraints = rng.normal(size=(4, 2)) @ rng.normal(size=(2, 7))
    free = nullspace(constraints)
    assert free.shape == (7, 5)
    assert_allclose(constraints @ free, 0.0, atol=1e-12)
    assert_allclose(free.T @ free, np.eye(5), atol=1e-12)
    assert nullspace(np.zeros((0, 3))).shape == (3, 3)
    assert nullspace(np.eye(3)).shape == (3, 0)


def test_fully_constrained_system_has_no_modes() -> None:
    assert spectrum(linear(1.0, 8.0, 1600.0, [[1.0]])).modes == ()


def test_rigid_body_modes_are_reported_apart() -> None:
    free_pair = linear(np.eye(2), np.array([[1, -1], [-1, 1]]), 50 * np.array([[1, -1], [-1, 1]]))
    found = spectrum(free_pair)
    assert len(found.rigid) == 2
    (mode,) = found.modes
    assert mode.eigenvalue == pytest.approx(complex(-1, math.sqrt(99)))
    alone = spectrum(linear(3.0, 0.0, 0.0))
    assert (alone.modes, len(alone.rigid), alone.decay_time) == ((), 2, 0.0)
    dragged = spectrum(linear(3.0, 6.0, 0.0))
    assert (len(dragged.rigid), dragged.modes[0].eigenvalue) == (1, pytest.approx(-2.0))


def test_slow_control_pole_is_a_mode_and_not_rigid() -> None:
    assert spectrum(linear(1.0, 100.0, 10.0)).decay_time == pytest.approx(46.0, rel=2e-3)


@pytest.mark.parametrize(("damping", "stiffness"), [(-0.5, 1600.0), (8.0, -1.0)])
def test_unstable_mode_is_named(damping: float, stiffness: float) -> None:
    linearization = linear(
        np.diag([1.0, 1.0]), np.diag([8.0, damping]), np.diag([900.0, stiffness])
    )
    with refused(UnstableModeError, "mode with v = 0.", "grows"):
        spectrum(linearization)


def test_undamped_mode_never_decays() -> None:
    assert spectrum(chain(5, 0.0, 0.0)[0]).decay_time == math.inf


def test_coordinates_without_mass_follow_at_once() -> None:
    held = spectrum(linear(np.diag([1.0, 0.0]), np.diag([8.0, 0.0]), np.diag([1600.0, 500.0])))
    assert held.n_instant == 2
    assert held.decay_time == pytest.approx(math.log(100) / 4)
    creeping = spectrum(linear(np.diag([1.0, 0.0]), np.diag([8.0, 5.0]), np.diag([1600.0, 10.0])))
    assert creeping.n_instant == 1
    assert creeping.modes[0].eigenvalue == pytest.approx(-2.0)


def test_undetermined_systems_are_refused() -> None:
    with refused(ValueError, "stiffness nor"):
        spectrum(linear(np.diag([1.0, 0.0]), np.diag([8.0, 0.0]), np.diag([1600.0, 0.0])))
    with refused(ValueError, "mass matrix is zero"):
        spectrum(linear(0.0, 8.0, 1600.0))
    with refused(ValueError, "damping matrix is not finite"):
        spectrum(linear(1.0, math.nan, 1600.0))


@pytest.mark.parametrize("amplitude", [0.0, 1.0, -0.1, 2.0])
def test_remaining_amplitude_is_a_fraction(amplitude: float) -> None:
    with refused(ValueError, "remaining amplitude"):
        time_to_decay(-4.0, amplitude)


def test_slowest_rate_may_be_growth() -> None:
    pair = linear(np.eye(2), np.diag([8.0, -2.0]), np.diag([1600.0, 100.0]))
    assert slowest_rate(pair) == pytest.approx(1.0)
    assert slowest_rate(linear(1.0, 8.0, 1600.0)) == pytest.approx(-4.0)
    assert slowest_rate(linear(1.0, 0.0, 1600.0)) == 0.0
    assert slowest_rate(linear(1.0, 0.0, 0.0)) == 0.0  # a free mass forgets nothing


def test_slowest_rate_of_a_rate_limiter_in_its_limit_is_zero() -> None:
    assert slowest_rate(StateMatrix(np.array([[-5.0]]))) == -5.0
    assert slowest_rate(StateMatrix(np.zeros((1, 1)))) == 0.0
