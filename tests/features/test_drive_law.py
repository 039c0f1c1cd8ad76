"""Drive laws against the curves that they stand for."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.interpolate import BSpline

from slide_fmu.core.signals import FloatArray
from slide_fmu.features.drive_law import DEFAULT_LAW, DRIVE_LAWS, DriveLaw

STEP = 0.02
POINTS = np.random.default_rng(0).normal(size=(2, 12, 3))


def spline(degree: int) -> Callable[[int], FloatArray]:
    """Derivatives by s at the ends of steps of a uniform spline with these control points."""
    knots = np.arange(POINTS.shape[1] + degree + 1) - degree
    curve = BSpline(knots, POINTS, degree, axis=1)
    ends = np.arange(2, POINTS.shape[1]) - degree + 1  # of the steps in which a point is newest

    def derivative(order: int) -> FloatArray:
        return np.asarray(curve.derivative(order)(ends - 1e-9)) / STEP**order

    return derivative


@pytest.mark.parametrize(("name", "degree"), [("quadratic_b_spline", 2), ("cubic_b_spline", 3)])
def test_law_is_that_of_its_spline_at_the_ends_of_steps(name: str, degree: int) -> None:
    found = DRIVE_LAWS[name].motion(POINTS, STEP)
    derivative = spline(degree)
    for order, part in enumerate(found):
        assert part == pytest.approx(derivative(order), rel=1e-5, abs=1e-5), order


def test_linear_law_reaches_every_set_point() -> None:
    place, rate, acceleration = DRIVE_LAWS["linear"].motion(POINTS, STEP)
    assert place == pytest.approx(POINTS[:, 2:])
    assert rate == pytest.approx(np.diff(POINTS, axis=1)[:, 1:] / STEP)
    assert acceleration == pytest.approx(np.diff(POINTS, 2, axis=1) / STEP**2)


@pytest.mark.parametrize("law", DRIVE_LAWS.values(), ids=DRIVE_LAWS)
def test_law_is_made_of_four_numbers(law: DriveLaw) -> None:
    assert DriveLaw.of_numbers(*law.numbers()) == law
    again = DriveLaw(law.position, law.rate, law.acceleration)
    for one, other in zip(again.motion(POINTS, STEP), law.motion(POINTS, STEP), strict=True):
        assert np.array_equal(one, other)


def test_default_is_one_of_the_laws() -> None:
    assert DEFAULT_LAW in DRIVE_LAWS


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"position": (0.5, 0.4, 0.0)}, r"sums \[0.9, 0.0, 0.0\]; expected \[1.0, 0.0, 0.0\]"),
        ({"rate": (1.0, 0.0, 0.0)}, "those of a joint that rests where its set points do"),
        ({"rate": (0.5, -0.5, 0.0)}, r"unit ramp \[0.5, 0.0\]; expected \[1.0, 0.0\], those of"),
        ({"acceleration": (1.0, -1.0, 0.0)}, "those of a joint as fast as set points that move"),
        ({"acceleration": (math.nan, 0.0, 0.0)}, r"acceleration = .*; expected three finite"),
        ({"rate": (1.0, -1.0)}, r"rate = \(1.0, -1.0\); expected three finite weights"),
    ],
)
def test_weights_of_a_joint_that_leaves_its_set_points_are_refused(
    change: dict[str, tuple[float, ...]], message: str
) -> None:
    linear = vars(DRIVE_LAWS["linear"])
    with pytest.raises(ValueError, match=message):
        DriveLaw(**{**linear, **change})
