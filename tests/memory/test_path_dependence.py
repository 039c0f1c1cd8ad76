"""What does not forget at rest is named, with a recipe or without, and what forgets is not."""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mbs_models.oscillators.oscillators import LinearOscillator
from slide_fmu.core.signals import Signal
from slide_fmu.memory import motions, sizing
from slide_fmu.memory.decay import Decay
from slide_fmu.memory.lengths import find_lengths
from slide_fmu.memory.motions import motions_of
from slide_fmu.memory.path_dependence import path_dependence, path_dependence_without_recipe
from slide_fmu.memory.sizing import NotForgettingError, require_window, size_window
from slide_fmu.memory.time_budget import TimeBudget
from slide_fmu.propose.proposal import InitOptions, propose
from slide_fmu.recipe.case import case_of
from slide_fmu.systems.base import Linearization, State, System
from slide_fmu.systems.function.system import FunctionSystem
from slide_fmu.systems.loading import load_system
from tests.marks import first
from tests.memory.test_lengths import of_lag
from tests.memory.test_sizing import oscillator
from tests.recipes import tiny_recipe
from tests.refusals import refused
from tests.systems.function_models import specifications as models

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


def judged(
    measured: float, near: float | None, monkeypatch: pytest.MonkeyPatch
) -> tuple[str | None, list[float]]:
    """Compare decay times in s with 1 s by the equations: along motions, and near rest.

    Returns:
        The contradiction, and the decay times in s with which motions near rest were asked for.
    """
    asked = []

    def rate(_: Any, expected: float) -> float | None:
        asked.append(expected)
        return None if near is None else np.log(1e-3) / near

    def decay(time: float) -> Decay:
        return Decay(np.array([np.log(1e-3) / time]), 1e-3)

    monkeypatch.setattr(sizing, "_rate_near_rest", rate)
    modes = SimpleNamespace(modes=(object(),), decay_time=1.0)
    linearized: Any = SimpleNamespace(decay=decay(1.0), modes=modes)
    about: Any = SimpleNamespace(system=SimpleNamespace(step=0.01))
    return sizing.contradiction(about, linearized, decay(measured)), asked


@pytest.mark.parametrize(
    ("measured", "near", "contradicts"),
    [
        (3.0, 3.0, True),
        (0.3, 0.3, True),
        (3.0, 1.5, False),  # agrees near rest
        (0.3, 0.7, False),
        (3.0, 0.3, False),  # contradicts there too, but in the other direction
        (0.3, 3.0, False),
        (3.0, None, True),  # nothing is known near rest
        (1.5, 3.0, False),  # agrees along motions
    ],
)
def test_equations_are_wrong_only_where_both_places_say_so_in_the_same_direction(
    measured: float, near: float | None, contradicts: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert (judged(measured, near, monkeypatch)[0] is not None) == contradicts


@pytest.mark.parametrize(
    ("measured", "longest"), [(3.0, 3.0), (0.3, 1.0), (-1.0, 1.0)], ids=["slow", "fast", "never"]
)
def test_motion_near_rest_lasts_for_the_longer_decay_that_is_finite(
    measured: float, longest: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A rate above 0, here of -1 s, never decays."""
    assert judged(measured, 3.0, monkeypatch)[1] == [pytest.approx(longest)]


def test_rate_near_rest_is_that_of_the_mode_after_a_small_kick() -> None:
    """The oscillator has the rate d / 2m = 4 1/s; the kick is a hundredth of the range."""
    asked = []

    class Heard(LinearOscillator):
        def simulate(self, inputs: Any) -> Any:
            asked.append(np.array(inputs))
            return super().simulate(inputs)

        def advance(self, inputs: Any) -> Any:
            asked.append(np.array(inputs))
            return super().advance(inputs)

    system = Heard(damping=8.0, step=0.03)
    about: Any = SimpleNamespace(system=system)
    assert sizing._rate_near_rest(about, 1.2) == pytest.approx(-4.0, rel=0.02)
    forces = np.concatenate([np.ravel(one) for one in asked])
    (force,) = system.inputs
    kick = sizing.KICK * 0.5 * (force.high - force.low)
    assert 0.5 * kick < np.max(np.abs(forces - force.start_value)) <= kick
    assert len(forces) == 2 * (sizing.KICK_SAMPLES + np.ceil(sizing.MEASURED_DECAYS * 1.2 / 0.03))


@pytest.mark.parametrize("factor", [1.5, 1.0 / 1.5])
def test_linearization_that_is_a_little_off_is_not_refused(
    factor: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Wrong, "FACTOR", factor)
    recipe = oscillator("LinearOscillator", n_in=130)
    assert size_window(recipe, Wrong(damping=8.0, step=0.03)).refusal is None


def _between(x: Any) -> Any:
    """The force between two masses; rounding splits the double zero eigenvalue of both."""
    return 10.0 * (x[2] - x[0]) + 0.1 * (x[3] - x[1])


MODELS = {
    "integrator": (lambda x, u, p: [u[0]], 1),
    "mass": (lambda x, u, p: [x[1], u[0]], 2),
    "two masses": (  # joined by a damped spring, and fixed nowhere
        lambda x, u, p: [x[1], u[0] + _between(x), x[3], -_between(x)],
        4,
    ),
    "damped mass": (lambda x, u, p: [x[1], u[0] - x[1]], 2),
    "lag": (lambda x, u, p: [u[0] - x[0]], 1),
    "slow lag": (lambda x, u, p: [1e-4 * (u[0] - x[0])], 1),
    "undamped": (lambda x, u, p: [x[1], u[0] - x[0]], 2),
    "hardly damped": (lambda x, u, p: [x[1], u[0] - x[0] - 1e-3 * x[1]], 2),
    "wrong sign": (lambda x, u, p: [x[1], u[0] - x[0] + 0.2 * x[1]], 2),
    "limit cycle": (lambda x, u, p: [x[1], 0.02 * u[0] - x[0] + x[1] * (1 - x[0] ** 2) / 20], 2),
    "pushed": (lambda x, u, p: [x[1], u[0] + x[0] - 0.2 * x[1]], 2),
    "two wells": (lambda x, u, p: [x[1], u[0] + x[0] - x[0] ** 3 - 0.1 * x[1]], 2),
}


def made(name: str) -> System:
    f, n_states = MODELS[name]
    return FunctionSystem(
        f,
        lambda x, u, p: [x[0]],
        inputs=[Signal("force", "N", -1.0, 1.0, hold="first_order")],
        outputs=[Signal("travel", "m", -1.0, 1.0)],
        start=[0.0] * n_states,
        step=0.1,
    )


@pytest.mark.parametrize("name", first(["two masses", "integrator", "mass", "damped mass"]))
def test_output_that_integrates_is_refused_with_the_reason(name: str) -> None:
    found = path_dependence_without_recipe(made(name))
    assert found is not None
    assert str(found).startswith("an integral or a free direction: ")
    assert found.time == pytest.approx(200.0)


@pytest.mark.parametrize("name", first(["wrong sign", "pushed"]))
def test_unstable_system_is_called_so(name: str) -> None:
    found = path_dependence_without_recipe(made(name))
    assert found is not None
    assert found.part > 1e6
    assert str(found).startswith("an unstable system: ")


def test_unstable_system_whose_motion_is_limited_is_called_so() -> None:
    """A difference that has grown to the size of the limit cycle grows no further."""
    found = path_dependence_without_recipe(made("limit cycle"))
    assert found is not None
    assert 2 < found.part < 1e3
    assert str(found).startswith("an unstable system: ")


@pytest.mark.extended
@pytest.mark.parametrize("name", ["lag", "slow lag", "undamped", "hardly damped", "two wells"])
def test_system_that_forgets_or_has_another_reason_is_let_through(name: str) -> None:
    assert path_dependence_without_recipe(made(name)) is None


@pytest.mark.parametrize(
    "name", first(["bistable", "first_order_lag", "thermal_masses", "bouc_wen"], 3)
)
def test_other_systems_without_fading_memory_are_let_through(name: str) -> None:
    assert path_dependence_without_recipe(load_system(getattr(models, name)())) is None


def refuse(folder: Path, step: float | None, damping: float) -> list[int]:
    """Expect ``init`` to refuse a free mass, and return the progress that it showed before."""
    place, shown = folder / "mass.py", list[int]()
    place.write_text(
        'inputs = {"force": {"unit": "N", "range": [-10, 10]}}\n'
        'outputs = {"position": "m"}\nstart = [0.0, 0.0]\n'
        f"def f(x, u, p):\n    return [x[1], (u[0] - {damping} * x[1]) / 2]\n"
        "def g(x, u, p):\n    return [x[0]]\n",
        encoding="utf-8",
    )
    with refused(NotForgettingError, "a free direction", "No window can hold it"):
        propose(
            InitOptions(str(place), step=step), lambda done, total, error=None: shown.append(done)
        )
    return shown


@pytest.mark.extended
@pytest.mark.parametrize("step", [None, 0.1])
def test_init_refuses_an_integral_and_proposes_nothing(tmp_path: Path, step: float | None) -> None:
    refuse(tmp_path, step, damping=0.0)


@pytest.mark.parametrize("damping", first([4.0, 0.2]))  # N s/m; a small one takes longer to show
def test_init_refuses_a_damped_mass_before_it_seeks_a_step(tmp_path: Path, damping: float) -> None:
    assert refuse(tmp_path, None, damping) == []
