"""A problem is refused whose points, limits or tolerance are no numbers for its coordinates."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import slide_fmu as slide
from slide_fmu.apps.motion import Limits, MotionError, MoveProblem, ViaPoints
from tests.refusals import refused

ROOT = Path(__file__).parents[3]


def duffing() -> slide.Surrogate:
    return slide.load(ROOT / "fmus" / "duffing" / "duffing.fmu")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"start": np.zeros(2)}, r"start has the shape \(2,\); expected \(1,\), one number for"),
        ({"goal": np.array([np.nan])}, "goal is .*; expected finite numbers"),
        ({"tolerance": float("nan")}, "tolerance is .*; expected more than 0"),
        ({"via": ViaPoints(np.array([300.0]), np.ones(1))}, r"via 1 has the shape \(\)"),
        ({"via": ViaPoints(np.array([[300.0]]), np.zeros(1))}, "via_tolerance is .* more than 0"),
    ],
)
def test_problems_of_other_numbers_are_refused(changes: dict[str, Any], message: str) -> None:
    none = np.array([np.inf])
    limits = Limits(np.array([-1000.0]), np.array([1000.0]), none, none, none)
    terms = {"start": np.zeros(1), "goal": np.array([600.0]), "tolerance": 2e-3} | changes
    with pytest.raises(MotionError, match=message):
        MoveProblem(surrogate=duffing(), limits=limits, **terms)


def test_limits_of_a_problem_are_above_zero() -> None:
    none, wrong = np.array([np.inf]), np.array([-5.0])
    limits = Limits(np.array([-1000.0]), np.array([1000.0]), wrong, none, none)
    with refused(MotionError, "speed is", "expected more than 0"):
        MoveProblem(duffing(), np.zeros(1), np.array([600.0]), limits, 2e-3)
