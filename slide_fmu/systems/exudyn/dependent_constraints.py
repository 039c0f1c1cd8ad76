"""Constraints that depend on each other are found before exudyn fails on them, again and again."""

from __future__ import annotations

from typing import Any

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.errors import LoadError

DEPENDENT = 1e-10
"""Unit vectors of constraints depend on each other where a singular value is below this part of
the largest one."""


def require_independent_constraints(mbs: Any) -> None:
    """Refuse an assembled model in which constraints say the same twice.

    exudyn cannot tell their forces apart: its matrices are singular, in every step.

    Raises:
        LoadError: the message names the objects whose constraints depend on each other.
    """
    size = mbs.systemData.ODE2Size()
    if mbs.systemData.AEsize() < 2:
        return
    transposed = mbs.ComputeLinearizedSystem(returnConstraintJacobian=True)[3]
    constraints = np.array(transposed, dtype=np.float64).reshape(size, -1).T
    lengths = np.linalg.norm(constraints, axis=1)
    acting = np.flatnonzero(lengths > 0.0)  # others only say that a force is zero
    rows, surplus = _dependent(constraints[acting] / lengths[acting, None])
    if not surplus:
        return
    names = _objects_with(mbs, {int(acting[row]) for row in rows})
    raise LoadError(
        f"{surplus} of {len(acting)} constraints say what others say already, in the initial "
        f"configuration: those of {', '.join(names)} depend on each other; expected independent "
        "constraints, since forces of dependent ones cannot be told apart: remove a joint, free "
        "axes of it (constrainedAxes), or put a stiff spring in its place"
    )


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
