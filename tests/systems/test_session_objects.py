"""Systems that a Python session gives as objects: here, in workers, and nowhere else."""

from __future__ import annotations

import math
import sys
from types import ModuleType

import pytest

from slide_fmu.data.isolated_process import crosses
from slide_fmu.data.pool import in_parallel, process_pool
from slide_fmu.recipe.case import Case
from slide_fmu.systems.declared import SignalTable
from slide_fmu.systems.errors import LoadError
from slide_fmu.systems.function.system import FunctionSystem
from slide_fmu.systems.loading import load_system
from slide_fmu.systems.specification import Specification
from tests.memory.plain_systems import Lag
from tests.recipes import case_of_object
from tests.refusals import refused
from tests.systems.function_models import specifications as models


def object_of(**more: object) -> Specification:
    values = {"given": Lag(step=0.02), **more}
    return Specification("oscillator", kind="object", **values)  # type: ignore[arg-type]


def test_given_system_is_itself_and_no_copy() -> None:
    system = Lag(step=0.02)
    assert load_system(object_of(given=system)) is system
    assert load_system(object_of(given=system, step=0.02)) is system


@pytest.mark.parametrize(
    ("more", "found", "expected"),
    [
        ({"step": 0.01}, "has the step 0.02 s", "expected the same window.step, not 0.01"),
        ({"step": 0.005, "part_of": 4}, "data.substeps = 4", "set data.substeps = 1, or give"),
        ({"parameters": {"mass": 1.0}}, "an object has its own", "remove them"),
        ({"inputs": {"force": SignalTable(range=(0.0, 1.0))}}, "an object has", "its own"),
    ],
)
def test_recipe_says_nothing_else_about_a_given_system(
    more: dict[str, object], found: str, expected: str
) -> None:
    with refused(LoadError, found, expected):
        load_system(object_of(**more))


def test_system_of_another_session_is_refused_with_a_remedy() -> None:
    with refused(LoadError, "'oscillator' is an", "Python session", "file"):
        load_system(object_of(given=None))


def step_of(case: Case) -> float:
    return case.system.step


def test_given_system_crosses_to_worker_processes() -> None:
    case = case_of_object(Lag(step=0.02))
    with process_pool(1) as pool:
        assert in_parallel(pool, step_of, [(case,)], lambda done: None) == [0.02]


def test_no_workers_are_this_process_with_its_progress() -> None:
    heard: list[int] = []
    with process_pool(0) as pool:
        found = in_parallel(pool, math.sqrt, [(4.0,), (9.0,)], heard.append)
    assert (pool, found, heard) == (None, [2.0, 3.0], [1, 2])


def test_system_of_functions_in_a_session_does_not_cross(monkeypatch: pytest.MonkeyPatch) -> None:
    system = load_system(models.thermal_masses())
    assert isinstance(system, FunctionSystem)
    signals = {"inputs": system.inputs, "outputs": system.outputs}
    session = ModuleType("__main__")
    exec("def f(x, u, p): return x\ndef g(x, u, p): return x", vars(session))
    monkeypatch.setitem(sys.modules, "__main__", session)
    own = FunctionSystem(
        vars(session)["f"], vars(session)["g"], start=[1.0, 1.0, 1.0], step=0.1, **signals
    )
    anonymous = FunctionSystem(
        lambda x, u, p: x, lambda x, u, p: x, start=[1.0, 1.0, 1.0], step=0.1, **signals
    )
    assert [crosses(one) for one in (own, anonymous)] == [False, False]
    assert crosses(Lag(step=0.02))
