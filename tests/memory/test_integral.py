"""Outputs that integrate are found before there is a recipe, and no others."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from slide_fmu.core.signals import Signal
from slide_fmu.memory.path_dependence import path_dependence_without_recipe as integral
from slide_fmu.memory.sizing import NotForgettingError
from slide_fmu.propose.proposal import InitOptions, propose
from slide_fmu.systems.base import System
from slide_fmu.systems.function.system import FunctionSystem
from slide_fmu.systems.loading import load_system
from tests.marks import first
from tests.refusals import refused
from tests.systems.function_models import specifications as models


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
    found = integral(made(name))
    assert found is not None
    assert str(found).startswith("an integral or a free direction: ")
    assert found.time == pytest.approx(200.0)


@pytest.mark.parametrize("name", first(["wrong sign", "pushed"]))
def test_unstable_system_is_called_so(name: str) -> None:
    found = integral(made(name))
    assert found is not None
    assert found.part > 1e6
    assert str(found).startswith("an unstable system: ")


def test_unstable_system_whose_motion_is_limited_is_called_so() -> None:
    """A difference that has grown to the size of the limit cycle grows no further."""
    found = integral(made("limit cycle"))
    assert found is not None
    assert 2 < found.part < 1e3
    assert str(found).startswith("an unstable system: ")


@pytest.mark.extended
@pytest.mark.parametrize("name", ["lag", "slow lag", "undamped", "hardly damped", "two wells"])
def test_system_that_forgets_or_has_another_reason_is_let_through(name: str) -> None:
    assert integral(made(name)) is None


@pytest.mark.parametrize(
    "model", [models.bistable, models.bouc_wen, models.first_order_lag, models.thermal_masses]
)
def test_other_systems_without_fading_memory_are_let_through(model: Any) -> None:
    assert integral(load_system(model())) is None


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
