"""Small lessons: a linear oscillator and one with a cubic spring, as difference equations."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable

import numpy as np
import pytest

from slide_fmu.apps.compare.baselines.lesson import Lesson, Motions
from slide_fmu.core.scaling import range_scaling
from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.core.window import Window
from slide_fmu.features.base import FeatureOffer
from slide_fmu.fitting.feature_choice import choose_features

WINDOW = Window(0.1, 60, 20)
needs_sysidentpy = pytest.mark.skipif(
    importlib.util.find_spec("sysidentpy") is None,
    reason="sysidentpy, of the extra compare, is not installed",
)

Equation = Callable[[float, float, float, float], float]
"""Gives y[k + 1] from y[k], y[k - 1], u[k] and u[k - 1]."""


def linear(y: float, before: float, u: float, u_before: float) -> float:
    """A damped oscillation."""
    return 1.5 * y - 0.7 * before + 0.1 * u + 0.05 * u_before


def cubic(y: float, before: float, u: float, u_before: float) -> float:
    """The same with a spring that hardens."""
    return linear(y, before, u, u_before) - 0.1 * y**3


def record(equation: Equation, count: int, seed: int, samples: int = 200) -> Motions:
    """Trajectories under random inputs in -1 .. 1, each from a state of its own."""
    rng = np.random.default_rng(seed)
    inputs = rng.uniform(-1, 1, (count, samples, 1))
    outputs = np.zeros((count, samples + 1, 1))
    outputs[:, 0, 0] = rng.uniform(-0.2, 0.2, count)
    for u, y in zip(inputs[:, :, 0], outputs[:, :, 0], strict=True):
        y[1] = equation(y[0], y[0], u[0], 0.0)
        for k in range(1, samples):
            y[k + 1] = equation(y[k], y[k - 1], u[k], u[k - 1])
    return inputs, outputs


def lesson(equation: Equation, seed: int = 0) -> Lesson:
    """A lesson of eight trajectories, and three to judge by."""
    signals = (Signal("force", "N", -1.0, 1.0),)
    training = record(equation, 8, 1)
    offered = FeatureOffer(signals, range_scaling(signals), WINDOW.step, None)
    features = choose_features(("inputs",), offered, training[0])
    return Lesson(WINDOW, features, training, record(equation, 3, 2), seed)


def error(values: FloatArray, truth: FloatArray) -> float:
    """RMS error from the second half of a trajectory on, over the standard deviation."""
    half = len(truth) // 2
    return float(np.sqrt(np.mean((values - truth)[half:] ** 2)) / truth[half:].std())


def silent(*_: object) -> None:
    """A progress that nobody looks at."""
