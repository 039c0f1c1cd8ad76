"""A reference system is made again with a solver that works less and is less accurate.

Every solver has a ladder of settings, the finest first. Which settings there are follows from the
kind of system: a function has the tolerances of its method, sample by sample and over whole
motions, as its user would integrate it; a model with a parameter ``substeps`` the number of its
integration steps, an FMU a tolerance, or the steps that an importer does.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

from slide_fmu.systems.base import System
from slide_fmu.systems.errors import LoadError
from slide_fmu.systems.function.integration import EXPLICIT, Solver
from slide_fmu.systems.function.system import FunctionSystem
from slide_fmu.systems.loading import describe_model, load_system
from slide_fmu.systems.specification import Specification

LOOSEST = 0.1
"""The largest relative tolerance that is tried."""
SUBSTEPS, TOLERANCES = "substeps", ("rtol", "tolerance")
"""Parameters that say how finely a model is solved, where it does not tell itself."""
OFTEN_TRIED = ("RK45", "RK23")
"""Explicit methods of lower order: they are the faster ones where little accuracy is wanted."""
OF_USERS = ("RK45", "DOP853", "LSODA")
"""Methods that a user of scipy takes, by one call over a whole motion."""


@dataclass(frozen=True, eq=False)
class Rung:
    """A Rung is one setting of a solver.

    Attributes:
        solver: its name, for people.
        setting: how accurate it is, for people, for example ``"rtol = 1e-06"``.
        make: makes the system; raises a ``LoadError`` where it cannot be made so.
    """

    solver: str
    setting: str
    make: Callable[[], System]


def ladders(system: System, made: Specification) -> list[list[Rung]]:
    """Return the ladders of a system; each has its settings from the finest on.

    The first rung of the first ladder is the system as it is. There is that rung alone where the
    solver cannot be loosened.

    Args:
        system: the system as it is.
        made: what it was made from.
    """
    if isinstance(system, FunctionSystem):
        own = system.solver
        methods = dict.fromkeys((*OF_USERS, own.method))
        whole = [replace(own, method=method) for method in methods]
        return [
            _of_function(system.with_solver, own),
            *(_of_function(system.over_motions, solver) for solver in whole),
            *(_of_function(system.with_solver, solver) for solver in _others(own)),
        ]
    of_parameters = [] if made.kind == "object" else list(_of_parameters(system, made))
    return of_parameters or [[Rung(solver_of(system), "as it is", lambda: system)]]


def solver_of(system: System) -> str:
    """Name what integrates a system, as far as that is known."""
    return system.solved_by or "its own solver"


def _others(own: Solver) -> list[Solver]:
    """Return solvers that may be faster than the one of a function if less is asked of them."""
    if own.method not in EXPLICIT:
        return []
    return [replace(own, method=method) for method in OFTEN_TRIED if method != own.method]


def _of_function(made: Callable[[Solver], System], finest: Solver) -> list[Rung]:
    rungs = []
    for factor in _factors(finest.rtol):
        solver = replace(finest, rtol=finest.rtol * factor, atol=finest.atol * factor)
        setting = f"rtol = {solver.rtol:.2g}, atol = {solver.atol:.2g}"

        def make(solver: Solver = solver) -> System:
            return made(solver)

        rungs.append(Rung(made(solver).solved_by or solver.method, setting, make))
    return rungs


def _of_parameters(system: System, made: Specification) -> Iterator[list[Rung]]:
    """Yield the ladders of a system that is made again with another parameter."""
    for name, finest in (system.fineness or _fineness(made)).items():
        if name.endswith(SUBSTEPS):
            levels = _counts(int(finest)) if finest > 1 else []
        else:
            levels = [finest * factor for factor in _factors(finest)] if finest > 0 else []
        if len(levels) > 1:
            yield [_rung(system, made, name, level) for level in levels]


def _rung(system: System, made: Specification, name: str, level: float) -> Rung:
    if name.endswith(SUBSTEPS):
        level = int(level)
        setting = f"steps of {1e3 * system.step / level:.3g} ms"
    else:
        setting = f"tolerance {level:.2g}"
    changed = replace(made, parameters={**made.parameters, name: level})
    return Rung(solver_of(system), setting, lambda: load_system(changed))


def _fineness(made: Specification) -> dict[str, float]:
    """Return the parameters of a model that say by their names how finely it is solved."""
    try:
        declared = describe_model(made.model, made.kind).parameters
    except LoadError:  # it cannot be made without its parameters
        declared = ()
    values = {**{one.name: one.value for one in declared}, **made.parameters}
    fineness: dict[str, float] = {}
    for name in (*TOLERANCES, SUBSTEPS):
        value = values.get(name)
        known = isinstance(value, int) if name == SUBSTEPS else isinstance(value, float)
        if known:
            fineness[name] = float(value or 0)
    return fineness


def _factors(tolerance: float) -> list[float]:
    """Return factors on a tolerance, about three to each other, up to the loosest one."""
    count = int(2 * math.log10(LOOSEST / tolerance) + 1e-9)
    return [10 ** (k / 2) for k in range(max(count, 0) + 1)]


def _counts(finest: int) -> list[float]:
    """Return numbers of steps, about 0.7 to each other, down to one."""
    halves = int(2 * math.log2(finest))
    counts = {max(1, round(finest * 2 ** (-k / 2))) for k in range(halves + 2)}
    return sorted(counts, reverse=True)
