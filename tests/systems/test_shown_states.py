"""A function system shows the states on which its outputs depend, behind its outputs."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest

from slide_fmu.core.signals import Signal
from slide_fmu.systems.base import Motion
from slide_fmu.systems.function.system import FunctionSystem
from slide_fmu.systems.simulation import outputs_of, simulate, simulate_motions

INPUTS = (Signal("force", "N", -1.0, 1.0, hold="first_order"),)
STEP = 0.05


def play(x: Any) -> Any:
    """Return the force of a spring with play."""
    return np.sign(x) * np.maximum(np.abs(x) - 0.2, 0.0)


def rates(x: Any, u: Any, p: Any) -> list[Any]:
    """A mass on a spring with play, a lag that only sees it, and a wheel that rolls on."""
    position, speed, lag, _ = x
    return [speed, u[0] - 8.0 * play(position) - 2.0 * speed - position, position - lag, speed]


def of(outputs: Any, count: int) -> FunctionSystem:
    """The system with these outputs."""
    signals = [Signal(f"y{k}", "m", -1.0, 1.0) for k in range(count)]
    return FunctionSystem(
        rates, outputs, inputs=INPUTS, outputs=signals, start=[0.0] * 4, step=STEP
    )


def random_inputs(seed: int, samples: int = 60) -> np.ndarray[Any, Any]:
    return np.random.default_rng(seed).uniform(-1, 1, (samples, 1))


@pytest.mark.parametrize(
    ("outputs", "count", "shown"),
    [
        (lambda x, u, p: [x[0]], 1, ["state_0", "state_1"]),
        (lambda x, u, p: x[0] * x[0], 1, ["state_0", "state_1"]),
        (lambda x, u, p: [x[2], u[0]], 2, ["state_0", "state_1", "state_2"]),
        (lambda x, u, p: [x[3]], 1, ["state_0", "state_1", "state_3"]),
        (lambda x, u, p: [u[0]], 1, []),
    ],
)
def test_states_are_shown_on_which_outputs_depend(
    outputs: Any, count: int, shown: list[str]
) -> None:
    """The lag and the wheel are left out, unless an output is made of them."""
    showing = of(outputs, count).showing_states()
    assert [signal.name for signal in showing.outputs[count:]] == shown


def test_showing_system_moves_as_the_other_one() -> None:
    """One by one, and many motions at once."""
    system = of(lambda x, u, p: [x[0], 2.0 * x[2]], 2)
    showing = system.showing_states()
    motions = [Motion(random_inputs(seed)) for seed in range(5)]
    together = [outputs_of(one) for one in simulate_motions(showing, motions)]
    for motion, found in zip(motions, together, strict=True):
        expected = simulate(system, motion.inputs).outputs
        alone = simulate(showing, motion.inputs).outputs
        np.testing.assert_array_equal(alone[:, :2], expected)
        np.testing.assert_allclose(found, alone, rtol=0, atol=1e-9)
        np.testing.assert_array_equal(found[:, 0], found[:, 2])
        np.testing.assert_array_equal(found[:, 1], 2.0 * found[:, 4])


def test_showing_system_is_the_same_one_again_and_one_with_another_solver_has_its_own() -> None:
    system = of(lambda x, u, p: [x[0]], 1)
    showing = system.showing_states()
    assert system.showing_states() is showing
    assert showing.showing_states() is showing
    other = system.with_solver(system.solver)
    assert other.showing_states() is not showing


def one_state(x: Any, u: Any, p: Any) -> list[Any]:
    return [x[0]]


def test_system_that_has_shown_its_states_goes_to_another_process() -> None:
    system = of(one_state, 1)
    inputs = random_inputs(3)
    expected = simulate(system.showing_states(), inputs).outputs
    sent = pickle.loads(pickle.dumps(system))
    np.testing.assert_array_equal(simulate(sent.showing_states(), inputs).outputs, expected)
