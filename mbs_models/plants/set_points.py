"""A drive moves with continuous velocity between set points that come once per sample."""

from __future__ import annotations

from dataclasses import dataclass

from slide_fmu.core.signals import FloatArray


@dataclass(frozen=True, eq=False)
class SetPoints:
    """The desired motion of drives follows a uniform quadratic B-spline.

    The set points phi_k are the control points. From sample k to k + 1, with the newest set point
    phi_(k+1), the acceleration is constant, (phi_(k+1) - 2 phi_k + phi_(k-1)) / h^2; at sample k
    the rate is (phi_k - phi_(k-1)) / h and the position (phi_k + phi_(k-1)) / 2. So the motion
    lags half a step behind the set points, its velocity is continuous, and it needs nothing but
    the last three of them.

    Attributes:
        position: desired positions at a sample, shape (n,), in rad or m.
        rate: desired rates at this sample, shape (n,), in rad/s or m/s.
    """

    position: FloatArray
    rate: FloatArray

    @staticmethod
    def at_rest(position: FloatArray) -> SetPoints:
        """Return the motion of set points that have always been the same, shape (n,)."""
        return SetPoints(position, 0.0 * position)

    def newest(self, step: float) -> FloatArray:
        """Return the set point phi_k that came last, shape (n,), for the sample step h in s."""
        return self.position + 0.5 * step * self.rate

    def acceleration(self, set_points: FloatArray, step: float) -> FloatArray:
        """Return the constant acceleration per s^2 over the step in s to phi_(k+1), both (n,)."""
        return (set_points - self.newest(step) - step * self.rate) / step**2

    def after(self, time: float, acceleration: FloatArray) -> SetPoints:
        """Return the motion at a time in s within the step, or at its end."""
        return SetPoints(
            self.position + time * self.rate + 0.5 * time**2 * acceleration,
            self.rate + time * acceleration,
        )
