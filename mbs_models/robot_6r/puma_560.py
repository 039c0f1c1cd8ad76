"""The Puma 560 has these lengths, masses and limits, and these gains of its joint control.

Lengths and masses are those of the robotics toolbox with the changes of the paper: link 1 has a
mass and full inertia, because the base moves; inertias obey the triangle inequality.
"""

from __future__ import annotations

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.features.serial_chain import SerialChain

JOINTS = 6
"""Number of joints of the arm."""
LIMITS = np.array([2.7925, 1.9199, 2.3562, 0.99 * np.pi, 1.7453, 0.99 * np.pi])
"""Joint angles lie within plus and minus these limits in rad."""
STIFFNESS = np.array([4e4, 4e4, 4e4, 100.0, 100.0, 10.0])
"""Proportional gains P of the joint control in N m/rad, as in the paper."""
DAMPING = np.array([400.0, 400.0, 100.0, 1.0, 1.0, 0.1])
"""Differential gains D of the joint control in N m s/rad, as in the paper."""
GRAVITY = np.array([0.0, 0.0, -9.81])
"""Acceleration of gravity, along minus z, in m/s^2."""

_QUARTER = np.pi / 2.0
_INERTIAS = [
    [0.2, 0.35, 0.2],
    [0.13, 0.524, 0.539],
    [0.066, 0.086, 0.025],
    [0.0018, 0.0013, 0.0018],
    [3e-4, 4e-4, 3e-4],
    [1.5e-4, 1.5e-4, 4e-5],
]
_CENTRES = [
    [0.0, 0.0, 0.0],
    [-0.3638, 0.006, 0.2275],
    [-0.0203, -0.0141, 0.07],
    [0.0, 0.019, 0.0],
    [0.0, 0.0, 0.0],
    [0.0, 0.0, 0.032],
]


def puma_560(tool: FloatArray) -> SerialChain:
    """Return the arm on an upright base, with a tool point in the last link frame in m, (3,)."""
    return SerialChain.denavit_hartenberg(
        a=np.array([0.0, 0.4318, 0.0203, 0.0, 0.0, 0.0]),
        d=np.array([0.075, 0.0, 0.15005, 0.4318, 0.0, 0.0]),
        alpha=_QUARTER * np.array([1.0, 0.0, -1.0, 1.0, -1.0, 0.0]),
        masses=np.array([20.0, 17.4, 4.8, 0.82, 0.34, 0.09]),
        centres=np.array(_CENTRES),
        inertias=np.array([np.diag(row) for row in _INERTIAS]),
        gravity=GRAVITY,
        tool=tool,
    )
