"""A system that does not keep its word is refused, with what came, what was expected, a remedy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mbs_models.oscillators.oscillators import DuffingOscillator, LinearOscillator
from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.core.units import require_unit
from slide_fmu.data.contract import check_system
from slide_fmu.pipeline.case_checks import check_case
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.reading import load_recipe
from slide_fmu.systems.base import Linearization, State
from slide_fmu.systems.contract import ContractError
from slide_fmu.systems.errors import LoadError, SimulationError
from slide_fmu.systems.function.record import RecordSystem
from slide_fmu.systems.loading import load_system
from slide_fmu.systems.simulation import simulate
from slide_fmu.systems.specification import Specification
from tests.memory.plain_systems import Acceleration, Lag, Play, Through
from tests.recipes import tiny_recipe

INPUTS = np.random.default_rng(0).uniform(-1.0, 1.0, (24, 1))
TRAINING = Path(__file__).parents[2] / "training"


def refused(system: Any, message: str, step: float = 0.05) -> None:
    with pytest.raises(ContractError, match=message):
        check_system(system, step, INPUTS)


def changed(**values: Any) -> Lag:
    system = Lag()
    for name, value in values.items():
        setattr(system, name, value)
    return system


@pytest.mark.parametrize("kind", [Lag, Play, Through])
def test_system_that_can_only_be_simulated_passes(kind: type[Lag]) -> None:
    check_system(kind(), 0.05, INPUTS)


def test_outputs_that_follow_their_own_input_at_once_pass() -> None:
    check_system(Acceleration(), 0.01, INPUTS)


@pytest.mark.parametrize("kind", [LinearOscillator, DuffingOscillator])
def test_system_with_all_offers_passes(kind: Any) -> None:
    check_system(kind(step=0.03), 0.03, 1000.0 * INPUTS)


@pytest.mark.parametrize("name", ["linear", "duffing", "mass_chain", "slider_crank"])
def test_recipe_of_the_project_passes(name: str) -> None:
    check_case(case_of(load_recipe(TRAINING / f"{name}.toml")))


@pytest.mark.parametrize("step", [0.1, None, "0.05", True])
def test_another_step_is_refused(step: Any) -> None:
    refused(changed(step=step), rf"Lag \(.*plain_systems\.py\)\.step is {step!r}; expected 0\.05")


X = Signal("x", "m", -1.0, 1.0)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"inputs": ()}, r"\.inputs is \(\); expected a tuple of slide_fmu\.Signal, at least one"),
        ({"outputs": [X]}, r"\.outputs is \[Signal.*expected a tuple"),
        ({"inputs": ("force",)}, r"\.inputs is \('force',\); expected a tuple"),
        ({"inputs": (X,), "outputs": (X,)}, r"share the names \['x'\]; .*: rename one of each"),
    ],
)
def test_wrong_signals_are_refused(values: dict[str, Any], message: str) -> None:
    refused(changed(**values), message)


class Random(Lag):
    def simulate(self, inputs: FloatArray) -> FloatArray:
        noise = getattr(self, "noise", np.random.default_rng(0))
        self.noise = noise
        return super().simulate(inputs) + noise.uniform(-0.1, 0.1, (len(inputs) + 1, 1))


class Foreseeing(Lag):
    def simulate(self, inputs: FloatArray) -> FloatArray:
        outputs = super().simulate(inputs)
        return np.concatenate([outputs[1:], outputs[-1:]])


def test_outputs_that_change_from_call_to_call_are_refused() -> None:
    refused(Random(), r"\.simulate gives .* for twice the same inputs, of output 'x' in sample 0")


def test_outputs_that_know_the_future_are_refused() -> None:
    message = (
        r"\.simulate gives another output in sample 12 where the inputs change from inputs\[12"
    )
    refused(Foreseeing(), message)


class OtherStart(LinearOscillator):
    def simulate(self, inputs: FloatArray) -> FloatArray:
        return super().simulate(inputs) + 1.0


class Forgetful(LinearOscillator):
    def set_state(self, state: State) -> None:
        super().set_state(State(state.coordinates, 0.0 * state.velocities, state.last_input))


class NoState(LinearOscillator):
    def get_state(self) -> Any:
        return np.zeros(2)


class OtherStates(LinearOscillator):
    def random_state(self, rng: Any, first_input: Any = None) -> State:
        return State(np.zeros(2), np.zeros(2), np.zeros(1))


class Unsquare(LinearOscillator):
    def linearize(self, state: State) -> Linearization:
        right = super().linearize(state)
        return Linearization(right.mass, np.eye(2), right.stiffness, right.constraints)


class NotLinear(LinearOscillator):
    def linearize(self, state: State) -> Any:
        return np.eye(2)


class Moving(LinearOscillator):
    def linearize(self, state: State) -> Linearization:
        self.set_state(State(state.coordinates + 1.0, state.velocities, state.last_input))
        return super().linearize(state)


class Raising(LinearOscillator):
    def get_state(self) -> State:
        return {}["nothing"]


@pytest.mark.parametrize(
    ("kind", "message"),
    [
        (OtherStart, r"\.begin gives .* for the same inputs, by simulate and step by step"),
        (Forgetful, r"\.set_state gives .* for what follows a state that was saved and restored"),
        (NoState, r"\.get_state gives a ndarray; expected a slide_fmu\.State: return one"),
        (OtherStates, r"\.random_state gives arrays of the shapes .*; expected .*, as get_state"),
        (
            Unsquare,
            r"\.linearize gives a damping matrix of shape \(2, 2\); expected finite .*1, 1",
        ),
        (NotLinear, r"\.linearize gives a ndarray; expected a Linearization or a StateMatrix"),
        (Moving, r"\.linearize changes the current state; expected the state as it was"),
        (Raising, r"\.get_state raised KeyError: 'nothing' \(.*test_contract\.py, line \d+\)"),
    ],
)
def test_offer_that_does_not_keep_its_word_is_refused(kind: Any, message: str) -> None:
    with pytest.raises(ContractError, match=message):
        check_system(kind(step=0.03), 0.03, 1000.0 * INPUTS)


def test_recipe_of_a_system_that_breaks_the_contract_is_refused() -> None:
    recipe = tiny_recipe(system={"model": "tests.data.test_contract:Moving"})
    with pytest.raises(ContractError, match="changes the current state"):
        check_case(case_of(recipe))


def test_message_about_a_system_of_this_package_names_the_model_of_the_user() -> None:
    rng = np.random.default_rng(0)
    signals = [Signal("u", "1", -1.0, 1.0)], [Signal("y", "1", -1.0, 1.0)]
    noisy = RecordSystem(
        lambda t, u, p: u + rng.standard_normal(u.shape),
        inputs=signals[0],
        outputs=signals[1],
        step=0.05,
    )
    with pytest.raises(ContractError, match=r"^system 'noisy.py': RecordSystem.simulate gives"):
        check_system(noisy, 0.05, INPUTS, "noisy.py")


def of(outputs: Any) -> Lag:
    """A system whose simulation gives something else, or raises it."""

    class Given(Lag):
        def simulate(self, inputs: FloatArray) -> Any:
            if isinstance(outputs, BaseException):
                raise outputs
            return outputs

    return Given()


BAD = np.zeros((25, 1))
BAD[7] = np.nan


@pytest.mark.parametrize(
    ("outputs", "message"),
    [
        (
            BAD,
            r"gave output 'x' = nan m in sample 7 \(t = 0\.35 s\) under the input",
        ),
        (
            np.zeros((24, 1)),
            r"gave an array of shape \(24, 1\); expected \(25, 1\): a row for the",
        ),
        (np.zeros(25), r"gave an array of shape \(25,\); expected \(25, 1\)"),
        (None, r"shape"),
        ("text", r"gave str \(.*\); expected an array of numbers of shape \(25, 1\)"),
        (
            ZeroDivisionError("by zero"),
            r"\.simulate raised ZeroDivisionError: by zero \(.*line \d+\)",
        ),
        (SystemExit(3), r"\.simulate raised SystemExit: 3 \(.*line \d+\)"),
    ],
)
def test_wrong_outputs_are_named(outputs: Any, message: str) -> None:
    with pytest.raises(SimulationError, match=message):
        simulate(of(outputs), INPUTS)


class BadStep(LinearOscillator):
    RESULT: Any = None

    def advance(self, inputs: FloatArray) -> FloatArray:
        right, self.steps = super().advance(inputs), getattr(self, "steps", 0) + 1
        if self.steps < 5:
            return right
        if isinstance(self.RESULT, BaseException):
            raise self.RESULT
        return self.RESULT


@pytest.mark.parametrize(
    ("result", "message"),
    [
        (
            KeyError("q"),
            r"BadStep\.advance raised KeyError: 'q' \(.*\) in sample 4 \(t = 0\.12 s\)",
        ),
        (
            [1.0, 2.0],
            r"BadStep\.advance gave outputs of shape \(2,\) in sample 4 \(t = 0\.12 s\) under \[",
        ),
        (
            [1.0, 2.0],
            r"expected an array of shape \(1,\), one number for each output: correct the m",
        ),
        (None, r"BadStep\.advance gave None in sample 4 \(t = 0\.12 s\) under \["),
        (["a"], r"BadStep\.advance gave \['a'\] in sample 4 \(t = 0\.12 s\) under \["),
        (
            SystemExit(3),
            r"BadStep\.advance raised SystemExit: 3 \(.*\) in sample 4 \(t = 0\.12 s\)",
        ),
        (
            [np.inf],
            r"BadStep\.advance gave output 'position' = inf m in sample 5 \(t = 0\.15 s\) u",
        ),
        (
            [np.nan],
            r"BadStep\.advance gave output 'position' = nan m in sample 5 \(t = 0\.15 s\) u",
        ),
    ],
)
def test_wrong_step_is_named(result: Any, message: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(BadStep, "RESULT", result)
    with pytest.raises(SimulationError, match=message):
        simulate(BadStep(step=0.03), INPUTS)


def test_inputs_that_are_not_finite_are_refused() -> None:
    inputs = INPUTS.copy()
    inputs[3] = np.inf
    with pytest.raises(ValueError, match=r"inputs in sample 3: \[inf\]; expected finite numbers"):
        simulate(Lag(), inputs)


@pytest.mark.parametrize(
    "unit",
    [
        "1",
        "N.m",
        "m/s2",
        "m^3/s",
        "kg.m2",
        "W/(m2.K)",
        "1/min",
        "degC",
        "%",
        "kN*m",
        "s-1",
        "um",
        "kWh",
        "Wb",
        "mmHg",
        "lbf.ft",
        "psi",
        "dB",
        "gon",
        "mrad/s",
        "GPa",
        "L/min",
    ],
)
def test_known_units_pass(unit: str) -> None:
    require_unit("x", unit)


@pytest.mark.parametrize(
    ("unit", "suggestion"),
    [
        ("Nm", "'N.m'"),
        ("meters", "'m'"),
        ("-", "'1'"),
        ("", "'1'"),
        ("°C", "'degC'"),
        ("kmh", "'"),
        ("nm.furlong", "'fur'"),
        ("Newton", "'N'"),
        ("sec", "'s'"),
        ("inch", "'in'"),
        ("m/xyzzy", "'xyzzy' is none"),
    ],
)
def test_unknown_units_are_refused_with_suggestions(unit: str, suggestion: str) -> None:
    with pytest.raises(ValueError, match=r"signal 'x': unit .*; expected known units") as caught:
        require_unit("x", unit)
    assert suggestion in str(caught.value)


class Furlongs(Lag):
    def __init__(self, step: float = 0.05) -> None:
        super().__init__(step)
        self.outputs = (Signal("x", "furlongs", -1.0, 1.0),)


def test_system_with_an_unknown_unit_is_not_loaded() -> None:
    with pytest.raises(LoadError, match=r"signal 'x': unit 'furlongs'; expected known units"):
        load_system(Specification("tests.data.test_contract:Furlongs", step=0.05))
