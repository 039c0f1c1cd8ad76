"""Constraints that depend on each other are found before exudyn fails on them, again and again."""

from __future__ import annotations

from typing import Any

import exudyn as exu
import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.errors import LoadError

DEPENDENT = 1e-10
"""Unit vectors of constraints depend on each other where a singular value is below this part of
the largest one."""


MOVED = 1e-2
"""To see whether constraints depend on each other elsewhere, coordinates are moved by so much (m,
rad), and then back to where constraints hold."""

CORRECTIONS, HOLD = 20, 1e-12
"""Most corrections, and their largest change, until constraints hold."""

SINGULAR = 1e-6
"""Directions in which constraints act by less than this part of the most are left to a motion."""


def require_independent_constraints(mbs: Any) -> None:
    """Refuse an assembled model in which constraints depend on each other where it begins.

    exudyn cannot tell their forces apart: its matrices are singular. Either constraints say the
    same twice, in every configuration; or the initial one is singular, as a linkage whose bars lie
    in one line: then constraints that are moved a little, and still hold, are independent.

    Raises:
        LoadError: the message says which of both it is, and names the objects whose constraints
            depend on each other.
    """
    if mbs.systemData.AEsize() < 2:
        return
    constraints = _slopes(mbs)
    acting, rows, surplus = _examined(constraints)
    if not surplus:
        return
    names = _objects_with(mbs, {int(acting[row]) for row in rows})
    if not _examined(_slopes_elsewhere(mbs, constraints))[2]:
        raise LoadError(
            f"the initial configuration is singular: there, {surplus} of {len(acting)} "
            f"constraints say what others say already, those of {', '.join(names)}, but not when "
            "it has moved a little; expected independent constraints, since a linkage in such a "
            "position may go on in several ways: let the model begin in another position"
        )
    raise LoadError(
        f"{surplus} of {len(acting)} constraints say what others say already, in the initial "
        f"configuration: those of {', '.join(names)} depend on each other; expected independent "
        "constraints, since forces of dependent ones cannot be told apart: remove a joint, free "
        "axes of it (constrainedAxes), or put a stiff spring in its place"
    )


def _slopes(mbs: Any) -> FloatArray:
    """Return the derivatives of all constraints by the coordinates, where the model begins."""
    transposed = mbs.ComputeLinearizedSystem(returnConstraintJacobian=True)[3]
    return np.array(transposed, dtype=np.float64).reshape(mbs.systemData.ODE2Size(), -1).T


def _slopes_elsewhere(mbs: Any, slopes: FloatArray) -> FloatArray:
    """Return the derivatives in a configuration nearby where all constraints hold.

    Args:
        mbs: the model, whose initial configuration stays as it is.
        slopes: the derivatives there, (n_constraints, n_coordinates).
    """
    initial = exu.ConfigurationType.Initial
    begin = np.array(mbs.systemData.GetODE2Coordinates(initial))
    _, singular, directions = np.linalg.svd(slopes)
    rank = int(np.sum(singular > SINGULAR * np.max(singular)))
    free = directions[rank:]
    at = begin + MOVED * free.T @ np.random.default_rng(0).standard_normal(len(free))
    for _ in range(CORRECTIONS):
        mbs.systemData.SetODE2Coordinates(at.tolist(), initial)
        slopes = _slopes(mbs)
        change = np.linalg.pinv(slopes, rcond=SINGULAR) @ _violations(mbs)
        at = at - change
        if np.max(np.abs(change)) < HOLD:
            break
    mbs.systemData.SetODE2Coordinates(begin.tolist(), initial)
    return slopes


def _violations(mbs: Any) -> FloatArray:
    """Return by how much each constraint is violated in the initial configuration."""
    settings: Any = exu.SimulationSettings()
    solver: Any = exu.MainSolverStatic()
    settings.solution.file.write = False
    settings.staticSolver.verboseMode = 0
    solver.InitializeSolver(mbs, settings)
    solver.ComputeAlgebraicEquations(mbs, False)
    residual = np.array(solver.GetSystemResidual(), dtype=np.float64)
    solver.FinalizeSolver(mbs, settings)
    return residual[mbs.systemData.ODE2Size() + mbs.systemData.ODE1Size() :]


def _examined(constraints: FloatArray) -> tuple[NDArray[np.intp], list[int], int]:
    """Return which constraints act, and what ``_dependent`` finds of these."""
    lengths = np.linalg.norm(constraints, axis=1)
    acting = np.flatnonzero(lengths > 0.0)  # others only say that a force is zero
    return acting, *_dependent(constraints[acting] / lengths[acting, None])


def _dependent(units: FloatArray) -> tuple[list[int], int]:
    """Return which rows, (n, n_coordinates), depend on others, and how many could be left out."""
    left, singular, _ = np.linalg.svd(units)
    rank = int(np.sum(singular > DEPENDENT * np.max(singular, initial=0.0)))
    combinations = left[:, rank:]
    parts = np.max(np.abs(combinations), axis=1, initial=0.0)
    return np.flatnonzero(parts > np.sqrt(DEPENDENT)).tolist(), len(units) - rank


def _objects_with(mbs: Any, numbers: set[int]) -> list[str]:
    """Return the objects that have constraints of these numbers, with their types."""
    data = mbs.systemData
    named = []
    for index in range(data.NumberOfObjects()):
        if numbers & set(map(int, data.GetObjectLTGAE(index))):
            item = mbs.GetObject(index)
            named.append(f"{item['name']!r} ({item['objectType']})")
    return named
