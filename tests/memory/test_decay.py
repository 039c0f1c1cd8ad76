"""Decay along linearized motions, and measured decay: pairs of motions that meet or never do."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mbs_models.oscillators.oscillators import (
    DuffingOscillator,
    LinearOscillator,
)
from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.core.window import Window
from slide_fmu.memory.decay import (
    Decay,
    NoGapError,
    convergence_rate,
    decay_along,
    decay_in_pieces,
    measured_decay,
    recommend_window,
    too_short,
)
from slide_fmu.memory.modes import UnstableModeError
from slide_fmu.systems.base import Linearizable, Linearization, Restorable, State
from slide_fmu.systems.simulation import simulate
from tests.memory.plain_systems import Lag
from tests.refusals import refused

PAPER = math.log(100) / 4
"""1.151 s to 1 %: m = 1 kg, d = 8 N s/m."""


def rate_of_two(
    system: Restorable,
    inputs: FloatArray,
    first: State,
    second: State,
    remaining_amplitude: float = 0.01,
) -> float:
    """Measure the rate at which motions from two states meet under the same held inputs."""
    one, other = (simulate(system, inputs, start).outputs for start in (first, second))
    return convergence_rate(system, one - other, remaining_amplitude)


class Rates(Linearizable):
    """Unit mass whose damping is 2 times its coordinate: Re(v) = -q. Linearizes, nothing else."""

    def __init__(self) -> None:
        self.step = 0.1
        self.inputs = self.outputs = (Signal("x", "m", -1.0, 1.0),)

    def rest_state(self, held_input: FloatArray) -> State:
        return State(np.array([1.0]), np.zeros(1), np.zeros(1))

    def set_state(self, state: State) -> None:
        raise NotImplementedError

    def get_state(self) -> State:
        raise NotImplementedError

    def output(self) -> FloatArray:
        raise NotImplementedError

    def advance(self, inputs: FloatArray) -> FloatArray:
        raise NotImplementedError

    def linearize(self, state: State) -> Linearization:
        damping = 2.0 * state.coordinates[:, None]
        return Linearization(np.eye(1), damping, np.array([[1e4]]), np.zeros((0, 1)))


def states(*coordinates: float) -> list[State]:
    return [State(np.array([q]), np.zeros(1), np.zeros(1)) for q in coordinates]


def test_mean_is_the_decay_time_of_the_mean_real_part() -> None:
    found = decay_along(Rates(), states(1.0, 2.0, 6.0), 0.01)
    assert found.times == pytest.approx(math.log(100) / np.array([1.0, 2.0, 6.0]))
    assert found.worst == pytest.approx(math.log(100))
    assert found.mean == pytest.approx(math.log(100) / 3.0)


def test_a_mode_may_grow_for_a_moment() -> None:
    found = decay_along(Rates(), states(1.0, -0.5, 2.5), 0.01)
    assert found.rates == pytest.approx([-1.0, 0.5, -2.5], rel=1e-3)
    assert found.worst == math.inf
    assert found.mean == pytest.approx(math.log(100) / 1.0, rel=1e-3)


def test_decay_along_refuses_a_motion_that_grows_in_the_mean() -> None:
    message = (
        r"grow along the motion: .* Re\(v\) = 0\.5 1/s in the mean over 3 instants "
        r"\(-0\.5 \.\. 1\.5\); .* give the system more damping"
    )
    with pytest.raises(UnstableModeError, match=message):
        decay_along(Rates(), states(-1.5, -0.5, 0.5))
    with refused(ValueError, "no states"):
        decay_along(Rates(), [])


def test_an_undamped_mode_decays_without_end() -> None:
    found = decay_along(Rates(), states(0.0, 0.0))
    assert found.rates.tolist() == [0.0, 0.0]
    assert found.mean == math.inf


def test_stretches_have_the_mean_rates_of_their_instants() -> None:
    one, other = (Decay(np.array(rates), 0.01) for rates in ([-1, -3, -5, 1, -4], [-7.0]))
    found = decay_in_pieces([one, other], 2)
    assert found.rates == pytest.approx([-3.0, -1.5, -7.0])
    assert found.worst == pytest.approx(math.log(100) / 1.5)
    whole = decay_in_pieces([one, other], 9)
    assert whole.rates == pytest.approx([-2.4, -7.0])
    with refused(UnstableModeError, "1 1/s in", "1 instants"):
        decay_in_pieces([one], 1)


@pytest.mark.parametrize(
    ("decay_time", "step", "n_out", "n_in"),
    [(PAPER, 1 / 64, 32, 106), (PAPER, 0.03, 53, 92), (0.0, 0.1, 4, 4), (0.3, 0.1, 5, 8)],
)
def test_recommended_window_just_fits(
    decay_time: float, step: float, n_out: int, n_in: int
) -> None:
    window = recommend_window(decay_time, step, n_out)
    assert window == Window(step, n_in, n_out)
    assert too_short(window, decay_time) is None
    if n_in > n_out:
        assert too_short(Window(step, n_in - 1, n_out), decay_time) is not None


@pytest.mark.parametrize("decay_time", [math.inf, math.nan, -1.0])
def test_window_for_a_system_that_does_not_forget_is_refused(decay_time: float) -> None:
    with refused(ValueError, "decay time"):
        recommend_window(decay_time, 0.1, 5)
    with refused(ValueError, "decay time"):
        too_short(Window(0.1, 10, 5), decay_time)


@pytest.mark.parametrize("amplitude", [0.1, 0.01, 1e-4])
def test_measured_decay_of_the_linear_oscillator_is_exact(amplitude: float) -> None:
    system = LinearOscillator()
    start = system.rest_state(np.array([800.0]))
    inputs = np.random.default_rng(0).uniform(-2000, 2000, (400, 1))
    found = rate_of_two(system, inputs, start, system.rest_state(np.zeros(1)), amplitude)
    assert found == pytest.approx(-4, rel=0.02)


@pytest.mark.extended
def test_two_motions_of_a_bistable_duffing_never_meet() -> None:
    """Above its resonance a harmonic force has two lasting responses, large and small."""
    system = DuffingOscillator()
    inputs = 1000.0 * np.sin(55.0 * system.step * np.arange(600))[:, None]
    start = [State(np.array([x]), np.zeros(1), np.zeros(1)) for x in np.linspace(-2, 2, 9)]
    rates = [rate_of_two(system, inputs, start[0], other) for other in start[1:]]
    assert 0.0 in rates
    assert min(rates) < math.log(0.01) / 3.0


def test_measured_decay_needs_two_motions_and_enough_samples() -> None:
    system = LinearOscillator()
    same = system.rest_state(np.zeros(1))
    with refused(ValueError, "the outputs are the same"):
        rate_of_two(system, np.zeros((100, 1)), same, same)
    coarse = LinearOscillator(step=1.0, substeps=400)
    with refused(ValueError, "sample the system more finely"):
        rate_of_two(coarse, np.zeros((100, 1)), same, coarse.rest_state(np.array([900.0])), 0.2)
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
    assert rate_of_two(system, np.zeros((50, 1)), first, second) == 0.0
