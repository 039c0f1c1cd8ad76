"""What does not forget at rest is named, and what does, however slowly, is not."""

from __future__ import annotations

import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mbs_models.oscillators.oscillators import LinearOscillator
from slide_fmu.memory import motions, sizing
from slide_fmu.memory.decay import Decay
from slide_fmu.memory.lengths import find_lengths
from slide_fmu.memory.motions import motions_of
from slide_fmu.memory.path_dependence import path_dependence
from slide_fmu.memory.sizing import NotForgettingError, require_window, size_window
from slide_fmu.memory.time_budget import TimeBudget
from slide_fmu.recipe.case import case_of
from slide_fmu.systems.base import Linearization, State
from tests.marks import first
from tests.memory.test_lengths import of_lag
from tests.memory.test_sizing import oscillator
from tests.recipes import tiny_recipe
from tests.refusals import refused

HELD = {"kind": "held_random", "weight": 1.0}
STEPS = {"kind": "steps", "weight": 1.0, "amplitude": [0.1, 0.9], "duration": [0.3, 2.0]}


@pytest.fixture(autouse=True)
def few_motions(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(motions, "MOTIONS", 4)


def found(name: str, excitation: dict[str, Any] = HELD) -> Any:
    recipe = of_lag(name, window={"n_in": 120}, data={"excitation": [excitation]})
    return path_dependence(
        motions_of(recipe.guess, case_of(recipe.guess).system, None, None, TimeBudget()), 128
    )


@pytest.mark.parametrize("excitation", [HELD, STEPS], ids=["held", "steps"])
@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("BoucWen", "hysteresis"),
        ("Play", "hysteresis"),
        ("Buckled", "rests"),
        ("Integrator", "integral"),
        ("WrongSign", "growing"),
    ],
)
def test_lasting_difference_has_its_reason(
    name: str, reason: str, excitation: dict[str, Any]
) -> None:
    result = found(name, excitation)
    assert result is not None
    assert result.reason == reason
    assert result.part > 0.3


@pytest.mark.parametrize("excitation", [HELD, STEPS], ids=["held", "steps"])
@pytest.mark.parametrize(
    "name", ["Lag", "TwoLags", "Friction", "DeadZone", "Acceleration", "Undamped", "Through"]
)
def test_what_forgets_or_never_rests_is_not_named(name: str, excitation: dict[str, Any]) -> None:
    assert found(name, excitation) is None


@pytest.mark.parametrize("noise", [1e-6, 1e-4])
def test_noise_of_a_solver_is_no_past(noise: float, monkeypatch: pytest.MonkeyPatch) -> None:
    from tests.memory.plain_systems import Lag

    simulate, rng = Lag.simulate, np.random.default_rng(0)

    def noisy(self: Lag, inputs: Any) -> Any:
        outputs = simulate(self, inputs)
        return outputs + noise * rng.standard_normal(outputs.shape)

    monkeypatch.setattr(Lag, "simulate", noisy)
    assert found("Lag") is None


def test_states_that_are_drawn_are_the_pasts_of_a_system_that_draws_them() -> None:
    recipe = tiny_recipe()
    assert (
        path_dependence(motions_of(recipe, case_of(recipe).system, None, None, TimeBudget()), 100)
        is None
    )


@pytest.mark.parametrize(
    ("name", "words"),
    first(
        [
            (
                "BoucWen",
                r"hysteresis: .* stay apart by [\d.]+ % .* replace it by a smooth friction",
            ),
            ("Buckled", r"several positions of rest: .* at 2 different outputs after 8 pasts"),
            ("Integrator", r"an integral or a free direction: .* whatever the input"),
        ]
    ),
)
def test_window_of_what_does_not_forget_is_refused_by_name(name: str, words: str) -> None:
    recipe = of_lag(name)
    with pytest.raises(NotForgettingError, match=rf"recipe 'tiny': {words}"):
        find_lengths(recipe, case_of(recipe.guess).system)
    given = of_lag(name, window={"n_in": 120}).guess
    sizing = size_window(given, case_of(given).system)
    assert not sizing.forgets
    with pytest.raises(NotForgettingError, match=words):
        require_window(given, sizing)


class Wrong(LinearOscillator):
    """Its equations have other damping than it has."""

    FACTOR = 3.0

    def linearize(self, state: State) -> Linearization:
        right = super().linearize(state)
        damping = self.FACTOR * right.damping
        return Linearization(right.mass, damping, right.stiffness, right.constraints)


@pytest.mark.parametrize("factor", [3.0, 1.0 / 3.0])
def test_linearization_that_contradicts_the_measured_decay_is_refused(
    factor: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Wrong, "FACTOR", factor)
    recipe = oscillator("LinearOscillator", n_in=130)
    sizing = size_window(recipe, Wrong(damping=8.0, step=0.03))
    assert sizing.refusal is not None
    numbers = re.search(
        r"decay in ([\d.]+) s along motions .* measured are ([\d.]+) s", sizing.refusal
    )
    assert numbers is not None
    assert float(numbers[2]) / float(numbers[1]) == pytest.approx(factor, rel=0.05)
    with refused(NotForgettingError, "equations contradict"):
        require_window(recipe, sizing)


def test_step_in_which_all_is_forgotten_is_named_as_the_reason(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As where milliseconds were meant: every motion has decayed at its first sample."""
    monkeypatch.setattr(sizing, "_rate_near_rest", lambda *_: None)
    slow, fast = (Decay(np.array([np.log(1e-3) / time]), 1e-3) for time in (140.0, 3.3))
    linearized: Any = SimpleNamespace(decay=fast, modes=SimpleNamespace(modes=()))
    about: Any = SimpleNamespace(system=SimpleNamespace(step=15.0))
    found = sizing.contradiction(about, linearized, slow)
    assert found is not None
    assert found.startswith("window.step = 15 s is longer than 3.3 s")


@pytest.mark.parametrize("factor", [1.5, 1.0 / 1.5])
def test_linearization_that_is_a_little_off_is_not_refused(
    factor: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Wrong, "FACTOR", factor)
    recipe = oscillator("LinearOscillator", n_in=130)
    assert size_window(recipe, Wrong(damping=8.0, step=0.03)).refusal is None
