"""A flange that turns a little is described by Euler angles, rotation vectors and moments.

Euler angles (a, b, c) turn about x, the new y, and the new z. The rotation vector theta of the
reduced socket belongs to them to the second order: theta = (a, b, c) + (b c, -a c, a b) / 2.
"""

from __future__ import annotations

import math

import numpy as np

from slide_fmu.core.signals import FloatArray

_ROUNDS = 60
"""The fixed-point search for Euler angles takes this many rounds: a socket needs fewer."""


def rotation_of(euler: FloatArray) -> FloatArray:
    """Return the rotation matrix R of Euler angles in rad, shape (3,): R v is in world axes."""
    a, b, c = euler.tolist()
    ca, sa, cb, sb = math.cos(a), math.sin(a), math.cos(b), math.sin(b)
    cc, sc = math.cos(c), math.sin(c)
    return np.array(
        [
            [cb * cc, -cb * sc, sb],
            [ca * sc + sa * sb * cc, ca * cc - sa * sb * sc, -sa * cb],
            [sa * sc - ca * sb * cc, sa * cc + ca * sb * sc, ca * cb],
        ]
    )


def vector_of(rotation: FloatArray) -> FloatArray:
    """Return the rotation vector (axis times angle in rad, (3,)) of a rotation matrix, (3, 3).

    It must turn by less than half a turn.
    """
    # twice the sine of the angle times the axis: exact for small angles, unlike the arc cosine
    twice = np.array(
        [
            rotation[2, 1] - rotation[1, 2],
            rotation[0, 2] - rotation[2, 0],
            rotation[1, 0] - rotation[0, 1],
        ]
    )
    sine = 0.5 * math.sqrt(float(twice @ twice))
    if sine == 0.0:
        return twice
    angle = math.atan2(sine, 0.5 * (float(np.trace(rotation)) - 1.0))
    return np.asarray(0.5 * twice * angle / sine)


def euler_of(theta: FloatArray) -> FloatArray:
    """Return the Euler angles in rad that solve the second-order relation to theta, both (3,)."""
    euler = theta
    for _ in range(_ROUNDS):
        a, b, c = euler
        euler = theta - 0.5 * np.array([b * c, -a * c, a * b])
    return np.asarray(euler)


def moment_of(theta: FloatArray, torque: FloatArray) -> FloatArray:
    """Return the moment m in N m that does work on theta', for a torque in world axes, all (3,).

    To the second order theta' = omega - theta x omega / 2, and the torque is m + theta x m / 2.
    """
    x, y, z = 0.5 * theta
    return np.linalg.solve(np.array([[1.0, -z, y], [z, 1.0, -x], [-y, x, 1.0]]), torque)
