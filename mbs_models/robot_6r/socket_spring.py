"""The socket's flange turns so far that the order of its turns begins to matter for its forces.

The reduced socket is linear in the flange's displacement u and rotation vector theta. exudyn's
joints turn the flange by Euler angles (a, b, c) instead, with theta = (a, b, c) + e,
e = (b c, -a c, a b) / 2 to the second order; angles here stay below 0.05 rad. Leaving e out
changes a fast motion of the robot by 0.4 %.
"""

# mypy: allow-untyped-calls
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from slide_fmu.core.signals import FloatArray


@dataclass(frozen=True)
class SocketSpring:
    """The spring has the flange's stiffness, symmetric about z (``Socket.symmetric``).

    Its forces are minus K (s + d s') for s = (u, theta). K is diagonal but for bending, which
    couples u_y with theta_x and, with the other sign, u_x with theta_y.

    Attributes:
        lateral: stiffness of u_x and u_y in N/m.
        axial: stiffness of u_z in N/m.
        bending: stiffness of theta_x and theta_y in N m/rad.
        torsion: stiffness of theta_z in N m/rad.
        coupling: coupling of u_y and theta_x in N/rad.
        damping: d in s.
    """

    lateral: float
    axial: float
    bending: float
    torsion: float
    coupling: float
    damping: float

    @staticmethod
    def of(stiffness: FloatArray, damping: float) -> SocketSpring:
        """Return the spring of a symmetric flange's stiffness, shape (6, 6), and d in s."""
        k = stiffness.tolist()
        return SocketSpring(k[0][0], k[2][2], k[3][3], k[5][5], k[1][3], damping)

    def beyond_linear(self, places: Sequence[float], rates: Sequence[float]) -> list[float]:
        """Return what the second order adds to forces that are linear in u, a, b, c.

        Places are u in m and Euler angles in rad, rates their derivatives, 6 numbers each. The
        result is generalized forces on u in N and on a, b, c in N m: -K (e + d e') and, because
        theta' has a part that turns with the angles, minus the transposed derivative of e times
        the moments.
        """
        d, half_d = self.damping, 0.5 * self.damping
        x, y, _, a, b, c = places
        v_x, v_y, _, p, q, r = rates
        e_a = 0.5 * b * c + half_d * (q * c + b * r)
        e_b = -0.5 * a * c - half_d * (p * c + a * r)
        e_c = 0.5 * a * b + half_d * (p * b + a * q)
        m_a = 0.5 * (self.bending * (a + d * p) + self.coupling * (y + d * v_y))
        m_b = 0.5 * (self.bending * (b + d * q) - self.coupling * (x + d * v_x))
        m_c = 0.5 * self.torsion * (c + d * r)
        return [
            self.coupling * e_b,
            -self.coupling * e_a,
            0.0,
            -self.bending * e_a + c * m_b - b * m_c,
            -self.bending * e_b - c * m_a - a * m_c,
            -self.torsion * e_c - b * m_a + a * m_b,
        ]

    def exudyn_force(self) -> Any:
        """Return a function for exudyn: force and torque K (s + d s') between ground and flange.

        exudyn gives u, Euler angles, velocity and angular velocity omega of the flange against
        the ground. theta' = omega - theta x omega / 2 to the second order. Moments m along theta
        do work on theta', so the torque is m + theta x m / 2.
        """
        lateral, axial, coupling = self.lateral, self.axial, self.coupling
        bending, torsion, damping = self.bending, self.torsion, self.damping

        def force(  # type: ignore[no-untyped-def]  # noqa: PLR0913 (exudyn calls it so)
            mbs, t, item, u, angles, v, omega, stiffness, damping_, frame0, frame1, offset
        ):  # fmt: skip
            a, b, c = angles[0], angles[1], angles[2]
            x, y, z = a + 0.5 * b * c, b - 0.5 * a * c, c + 0.5 * a * b
            p, q, r = omega[0], omega[1], omega[2]
            x_d = x + damping * (p - 0.5 * (y * r - z * q))
            y_d = y + damping * (q - 0.5 * (z * p - x * r))
            z_d = z + damping * (r - 0.5 * (x * q - y * p))
            u_x, u_y = u[0] + damping * v[0], u[1] + damping * v[1]
            m_x, m_y = bending * x_d + coupling * u_y, bending * y_d - coupling * u_x
            m_z = torsion * z_d
            return [
                lateral * u_x - coupling * y_d,
                lateral * u_y + coupling * x_d,
                axial * (u[2] + damping * v[2]),
                m_x + 0.5 * (y * m_z - z * m_y),
                m_y + 0.5 * (z * m_x - x * m_z),
                m_z + 0.5 * (x * m_y - y * m_x),
            ]

        return force
