"""How a flange that turns a little is described: Euler angles, rotation vector, moments.

Euler angles turn about x, the new y, and the new z. The rotation vector theta of the reduced
socket belongs to them to the second order: (a, b, c) + (b c, -a c, a b) / 2.
"""

from __future__ import annotations

import math

import numpy as np

from slide_fmu.core.signals import FloatArray

_ROUNDS = 60


def rotation_of(euler: FloatArray) -> FloatArray:
    """Rotation matrix R of Euler angles in rad, shape (3,): R v is in world axes."""
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
    """Rotation vector in rad of a rotation matrix that turns by less than half a turn."""
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
    """Euler angles in rad of the socket's theta, shape (3,), by the second order."""
    euler = theta
    for _ in range(_ROUNDS):
        a, b, c = euler
        euler = theta - 0.5 * np.array([b * c, -a * c, a * b])
    return np.asarray(euler)


def moment_of(theta: FloatArray, torque: FloatArray) -> FloatArray:
    """Moment m along theta of a torque in world axes: m + theta x m / 2 is the torque."""
    x, y, z = 0.5 * theta
    return np.linalg.solve(np.array([[1.0, -z, y], [z, 1.0, -x], [-y, x, 1.0]]), torque)
