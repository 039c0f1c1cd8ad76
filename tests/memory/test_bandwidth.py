"""The step that is proposed for a system."""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest

from mbs_models.oscillators.oscillators import LinearOscillator
from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.memory.bandwidth import own_frequency, proposed_step, tidy_step
from slide_fmu.systems.base import System
from slide_fmu.systems.errors import LoadError, SimulationError
from tests.marks import first
from tests.memory.plain_systems import Acceleration, FixedStep, Lag, Through
from tests.refusals import refused


@pytest.mark.parametrize("time_constant", [1e-3, 1.0, 300.0])
def test_lag_is_sampled_some_times_in_its_time_constant(time_constant: float) -> None:
    """The gain 1 / sqrt(1 + w^2 T^2) is a fifth of the largest at w T = sqrt(24)."""
    found = proposed_step(lambda step: Lag(step, time_constant))
    corner = math.sqrt(24) / (2 * math.pi * time_constant)
    assert found.bandwidth is not None
    # a spectrum at a step of more than the lag shows the corner blurred by what folds back
    assert 0.7 < found.bandwidth / corner < 2.0
    assert 0.4 < found.step * 10.0 * found.bandwidth <= 1.0


@pytest.mark.parametrize("first", first([0.01, 1e-4, 1.0]))
def test_oscillator_is_sampled_some_ten_times_in_its_period(first: float) -> None:
    found = proposed_step(lambda step: LinearOscillator(step=step), first)
    assert found.bandwidth is not None
    assert 40.0 / (2 * math.pi) < found.bandwidth < 20.0
    assert 7.0 < 2 * math.pi / 40.0 / found.step < 16.0


def test_output_that_follows_the_input_at_once_is_sampled_by_its_own_dynamics() -> None:
    found = proposed_step(Acceleration)
    assert found.bandwidth is not None
    assert Acceleration.FREQUENCY / (2 * math.pi) < found.bandwidth < 40.0


def test_system_without_dynamics_keeps_the_first_step() -> None:
    found = proposed_step(Through)
    assert (found.step, found.bandwidth) == (0.01, None)


class Valve(Lag):
    """A lag, and what a valve lets through: a product of the input and the root of the state."""

    def __init__(self, step: float = 0.05, time_constant: float = 2.0) -> None:
        super().__init__(step, time_constant)
        self.inputs = (Signal("valve", "1", 0.2, 1.0, hold="zero_order"),)
        self.outputs = (Signal("level", "m", 0.0, 1.0), Signal("flow", "m3/s", 0.0, 1.0))

    def simulate(self, inputs: FloatArray) -> FloatArray:
        level = super().simulate(inputs)
        return np.hstack([level, np.concatenate([inputs[:1], inputs]) * np.sqrt(level)])


def test_output_that_follows_the_input_by_a_product_is_sampled_by_the_dynamics() -> None:
    found, plain = proposed_step(Valve), proposed_step(lambda step: Lag(step, 2.0))
    assert found.bandwidth is not None
    assert plain.bandwidth is not None
    assert 0.5 < found.bandwidth / plain.bandwidth < 2.0


class Growing(Lag):
    """y' = 0.5 y + u grows beyond all bounds."""

    def simulate(self, inputs: FloatArray) -> FloatArray:
        values, factor = [0.0], math.exp(0.5 * self.step)
        for (value,) in inputs.tolist():
            values.append(factor * values[-1] + self.step * value)
            if not math.isfinite(values[-1]):
                raise SimulationError("it is gone")
        return np.array(values)[:, None]


class Crank(Lag):
    """A lag behind the cosine of an angle, of which it takes no pair off the circle."""

    def __init__(self, step: float = 0.05, time_constant: float = 2.0) -> None:
        super().__init__(step, time_constant)
        self.inputs = (
            Signal("x", "1", -1.0, 1.0, angle="cosine"),
            Signal("y", "1", -1.0, 1.0, angle="sine"),
        )

    def simulate(self, inputs: FloatArray) -> FloatArray:
        assert np.hypot(*inputs.T) == pytest.approx(1.0)
        return super().simulate(inputs[:, :1])


def test_cosine_and_sine_of_an_angle_are_drawn_on_its_circle() -> None:
    found, plain = proposed_step(Crank), proposed_step(Lag)
    assert found.step == pytest.approx(plain.step, rel=0.5)


@pytest.mark.parametrize("first", [0.01, 0.2])
def test_system_that_grows_gives_no_warnings(first: float) -> None:
    """At the second step the outputs end at about 1e222, the square of which is no number."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert proposed_step(Growing, first).step > 0.0


def test_system_with_a_step_of_its_own_is_looked_at_with_that() -> None:
    found = proposed_step(_fixed)
    assert found.bandwidth is not None


class Driven(System):
    """A load on a spring behind a fast drive: its deviation follows the input's acceleration."""

    FREQUENCY, DAMPING, DRIVE = 25.0, 0.1, 1e-6

    def __init__(self, step: float) -> None:
        self.step = step
        self.inputs = (Signal("place", "m", -1.0, 1.0, hold="first_order"),)
        self.outputs = (Signal("deviation", "m", -1.0, 1.0),)

    def simulate(self, inputs: FloatArray) -> FloatArray:
        from scipy.signal import cont2discrete, dlsim

        w = self.FREQUENCY
        drive = [self.DRIVE, 1.0]
        spring = np.polymul(np.polymul([1.0, 2 * self.DAMPING * w, w * w], drive), drive)
        matrices = cont2discrete(([-1.0, 0.0, 0.0], spring), self.step, "foh")
        values = np.concatenate([inputs[:1], inputs])
        _, found = dlsim((*matrices[:2], self.step), values - values[0])
        return np.asarray(found)


def test_output_that_follows_accelerations_is_sampled_by_its_own_vibration() -> None:
    found = proposed_step(Driven, driven=True)
    assert found.own is not None
    assert found.own == pytest.approx(Driven.FREQUENCY / (2 * math.pi), rel=0.3)
    assert found.step == 0.02


@pytest.mark.parametrize(("time_constant", "tolerance"), [(0.5, 0.5), (0.1, 0.2)])
def test_motion_that_is_left_has_the_corner_frequency_of_a_lag(
    time_constant: float, tolerance: float
) -> None:
    found = own_frequency(Lag(0.02, time_constant))
    assert found == pytest.approx(1.0 / (2 * math.pi * time_constant), rel=tolerance)


def test_set_points_after_which_nothing_moves_keep_the_first_step() -> None:
    found = proposed_step(Through, driven=True)
    assert (found.step, found.bandwidth, found.own) == (0.01, None, None)


def test_drives_that_no_step_simulates_are_refused() -> None:
    with refused(SimulationError, "it never moves"):
        proposed_step(Broken, driven=True)


class Broken(Lag):
    def simulate(self, inputs: FloatArray) -> FloatArray:
        raise SimulationError("it never moves")


def _fixed(step: float) -> System:
    try:
        return FixedStep(step)
    except ValueError as error:
        raise LoadError(str(error)) from error


@pytest.mark.parametrize(
    ("step", "tidied"),
    [(0.0101, 0.01), (0.0199, 0.01), (0.99, 0.5), (1.0, 1.0), (3600.0, 2000.0), (0.2, 0.2)],
)
def test_tidy_step_is_rounded_down(step: float, tidied: float) -> None:
    assert tidy_step(step) == tidied


def test_system_that_no_step_simulates_is_refused() -> None:
    with refused(SimulationError, "it never moves"):
        proposed_step(Broken)
