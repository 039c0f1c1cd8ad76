"""A drive law describes by a few numbers how the joints of a machine follow their set points."""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass

import numpy as np

from slide_fmu.core.signals import FloatArray

EXACT = 1e-9
"""Tolerance of the sums of the weights."""

Weights = tuple[float, float, float]
"""Factors of the newest set point, of the one before it, and of the one before that."""


@dataclass(frozen=True)
class DriveLaw:
    """A DriveLaw gives the motion of a joint at the end of a step from its last three set points.

    Position, rate times the step h, and acceleration times h^2 are weighted sums of the set
    points. A joint whose set points rest is at rest at that point; with set points that move
    evenly it moves at the same rate. The motion between the samples needs no number: features are
    formed at the samples.

    Attributes:
        position: weights of the position; their sum is 1.
        rate: weights of the rate times h; their sum is 0.
        acceleration: weights of the acceleration times h^2; their sum is 0.

    Raises:
        ValueError: weights are not finite, or a joint with them would not keep to its set points.
    """

    position: Weights
    rate: Weights
    acceleration: Weights

    def __post_init__(self) -> None:
        for name, weights in vars(self).items():
            if len(weights) != 3 or not all(math.isfinite(weight) for weight in weights):
                raise ValueError(
                    f"drive law: {name} = {weights}; expected three finite weights, of the newest "
                    "set point and of the two before"
                )
        even = np.array([0.0, -1.0, -2.0])  # set points that rise by one in each step
        demands = {
            "a joint that rests where its set points do": (
                [sum(weights) for weights in astuple(self)],
                [1.0, 0.0, 0.0],
            ),
            "a joint as fast as set points that move evenly": (
                [float(even @ self.rate), float(even @ self.acceleration)],
                [1.0, 0.0],
            ),
        }
        for what, (sums, wanted) in demands.items():
            if max(abs(a - b) for a, b in zip(sums, wanted, strict=True)) > EXACT:
                kind = "sums" if len(wanted) == 3 else "rate and acceleration under a unit ramp"
                raise ValueError(
                    f"drive law {self}: {kind} {sums}; expected {wanted}, those of {what}"
                )

    @classmethod
    def of_numbers(cls, newest: float, oldest: float, rate: float, curvature: float) -> DriveLaw:
        """Make the law from the four numbers that define it; its other weights follow.

        Args:
            newest, oldest: weights of the newest and the oldest set point in the position.
            rate, curvature: weights of the newest set point in rate and acceleration.
        """
        place = (newest, 1.0 - newest - oldest, oldest)
        return cls(
            place, (rate, 1.0 - 2.0 * rate, rate - 1.0), (curvature, -2 * curvature, curvature)
        )

    def numbers(self) -> tuple[float, float, float, float]:
        """Return the four numbers of ``of_numbers``."""
        return self.position[0], self.position[2], self.rate[0], self.acceleration[0]

    def motion(self, points: FloatArray, step: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return positions, rates and accelerations of joints at the end of steps.

        Set points (B, N + 2, n) in rad or m, ``step`` s apart, give three arrays (B, N, n). All
        are formed from differences of set points, because these round least.
        """
        between = points[:, 1:-1]
        newer, older = points[:, 2:] - between, between - points[:, :-2]
        place, rate, acceleration = (
            weights[0] * newer - weights[2] * older for weights in astuple(self)
        )
        return between + place, rate / step, acceleration / step**2


DRIVE_LAWS = {
    "linear": DriveLaw.of_numbers(1.0, 0.0, 1.0, 1.0),
    "quadratic_b_spline": DriveLaw.of_numbers(0.5, 0.0, 1.0, 1.0),
    "cubic_b_spline": DriveLaw.of_numbers(1 / 6, 1 / 6, 0.5, 1.0),
}
"""Laws by name. ``linear``: joints move evenly from one set point to the next, and reach it at the
end of the step. ``quadratic_b_spline``: acceleration is constant in every step; half a step late.
``cubic_b_spline``: acceleration is continuous; one step late."""
DEFAULT_LAW = "quadratic_b_spline"
"""The law if none is given."""
