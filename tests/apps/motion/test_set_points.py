"""Set points at another rate pass the samples, are smooth, and rest at both ends."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from slide_fmu.apps.motion import Coordinate, Limits, MotionError
from slide_fmu.apps.motion.set_points import MotionCurve, write_curve
from tests.acceptance.conftest import invoke
from tests.fmu.samples import sum_surrogate
from tests.marks import first
from tests.refusals import refused

ROOT = Path(__file__).parents[3]
AXIS = (Coordinate("x", "m", -10.0, 10.0), Coordinate("y", "m", -10.0, 10.0))
STEP = 0.05


def limits(speed: float, acceleration: float) -> Limits:
    wide, two = np.full(2, np.inf), np.ones(2)
    return Limits(-wide, wide, speed * two, acceleration * two, 2 * acceleration / STEP * two)


def fastest_samples() -> np.ndarray:
    """Samples of a move that starts and stops with full acceleration, at rest at both ends."""
    accelerations = np.concatenate([np.full(10, 4.0), np.zeros(5), np.full(10, -4.0)])
    speeds = np.cumsum(accelerations) * STEP
    positions = np.concatenate([[0.0], np.cumsum(speeds) * STEP])
    return np.stack([positions, -0.5 * positions], axis=1)


def test_curve_passes_its_samples_rests_at_its_ends_and_says_which_limit_it_exceeds() -> None:
    samples = fastest_samples()
    curve = MotionCurve(AXIS, samples, STEP, limits(2.0, 4.0))
    time = STEP * np.arange(1, len(samples) + 1)
    np.testing.assert_allclose(curve.spline(time), samples, atol=1e-9)
    ends = np.array([0.0, curve.duration])
    np.testing.assert_allclose(curve.spline(ends), samples[[0, -1]], atol=1e-9)
    for order in (1, 2):
        np.testing.assert_allclose(curve.spline(ends, nu=order), 0, atol=1e-8)
    fine = np.linspace(0, curve.duration, 2000)
    rows = np.stack([curve.spline(fine, nu=order) for order in (1, 2)], axis=1)
    assert "the acceleration reaches" in str(curve.remark(rows))
    wide = MotionCurve(AXIS, samples, STEP, limits(4.0, 8.0))
    assert wide.remark(rows) is None


def test_inputs_that_hold_over_a_step_have_no_other_rate(tmp_path: Path) -> None:
    curve = MotionCurve(AXIS, fastest_samples(), STEP, limits(2.0, 4.0))
    with refused(MotionError, "hold over each step", "leave --rate away"):
        write_curve(sum_surrogate(), curve, 0.001, tmp_path / "a.csv")


@pytest.mark.parametrize("rate", [np.inf, np.nan, 2.0])
def test_rate_that_gives_no_rows_within_the_motion_is_refused(rate: float, tmp_path: Path) -> None:
    curve = MotionCurve(AXIS, fastest_samples(), STEP, limits(2.0, 4.0))
    with refused(MotionError, f"--rate {rate:g}", "takes 1.35 s", "0.005"):
        write_curve(sum_surrogate(hold="first_order"), curve, rate, tmp_path / "a.csv")
    assert not (tmp_path / "a.csv").exists()


@pytest.mark.parametrize("task", first(["closed_path", "pick_and_place"]))
def test_set_points_at_a_rate_have_positions_speeds_and_accelerations(
    task: str, tmp_path: Path
) -> None:
    robot = ROOT / "fmus" / "robot_6r" / "robot_6r.fmu"
    toml = ROOT / "docs" / "tutorials" / f"{task}.toml"
    done = invoke("motion", robot, toml, "-o", tmp_path, "--rate", "0.002")
    assert done.exit_code == 0, done.output
    table = np.genfromtxt(tmp_path / "set_points.csv", delimiter=",", names=True)
    assert table.dtype.names is not None
    assert table.dtype.names[:4] == ("time", "joint_1", "joint_1_speed", "joint_1_acceleration")
    np.testing.assert_allclose(np.diff(table["time"]), 0.002)
    slopes = np.gradient(table["joint_2"], table["time"])[2:-2]
    np.testing.assert_allclose(slopes, table["joint_2_speed"][2:-2], atol=0.02)
    assert [table["joint_6_speed"][at] for at in (0, -1)] == pytest.approx([0, 0], abs=1e-9)
