"""A quarter car over a road: a cubic bump stop, an asymmetric damper, an input that moves.

Equations, trajectories and training in numpy and torch alone, so that what is measured about
moving inputs depends on no other model. Body and wheel move vertically; under a compression s =
z_wheel - z_body the suspension presses with k s + k_stop s^3 + c s' - c_more |s'| (rounded at 0).
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch

from slide_fmu.bounds.input_forecast import fit_forecast
from slide_fmu.core.progress import Progress
from slide_fmu.core.scaling import Affine, range_scaling
from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.core.window import Window
from slide_fmu.features.differences import Differences
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.fitting.problem import Problem
from slide_fmu.fitting.state_space.fit import fit_state_space
from slide_fmu.recipe.learning import LeastSquaresExpert, LeastSquaresRecipe, StateSpaceRecipe
from slide_fmu.surrogate.surrogate import Surrogate

STEP, SUBSTEPS = 0.01, 16
BODY, WHEEL = 300.0, 40.0  # kg
SPRING, STOP, TYRE = 2.0e4, 4.0e6, 2.0e5  # N/m, N/m^3, N/m
DAMPING, MORE_IN_REBOUND, ROUNDING = 1.5e3, 5.0e2, 0.02  # N s/m, N s/m, m/s
ROAD = (Signal("road", "m", -0.1, 0.1, "height of the road", hold="first_order"),)
OUTPUTS = (
    Signal("body_acceleration", "m/s2", -30.0, 30.0),
    Signal("suspension_travel", "m", -0.2, 0.2),
    Signal("tyre_deflection", "m", -0.05, 0.05),
)
WINDOW = Window(STEP, 360, 120)
"""2.4 s truncated: the body's motion has decayed to less than 1 %."""


def rates(state: FloatArray, road: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Time derivative of states (4, N) and outputs (3, N), under heights of the road (N,)."""
    body, wheel, v_body, v_wheel = state
    travel, speed = wheel - body, v_wheel - v_body
    damper = DAMPING * speed - MORE_IN_REBOUND * (np.hypot(speed, ROUNDING) - ROUNDING)
    force = SPRING * travel + STOP * travel**3 + damper
    acceleration = force / BODY
    deflection = road - wheel
    slope = np.stack([v_body, v_wheel, acceleration, (TYRE * deflection - force) / WHEEL])
    return slope, np.stack([acceleration, travel, deflection])


def simulate(road: FloatArray, step: float = STEP, substeps: int = SUBSTEPS) -> FloatArray:
    """Outputs (N, samples, 3) at the times of the heights of the road (N, samples).

    The road is a straight line between its samples. At the first one the car stands still on it.
    """
    state = np.zeros((4, len(road)))
    state[:2] = road[:, 0]
    h = step / substeps
    outputs = [rates(state, road[:, 0])[1]]
    for before, after in zip(road.T, road.T[1:], strict=False):
        for part in range(substeps):
            r = [before + (after - before) * (part + x) / substeps for x in (0.0, 0.5, 1.0)]
            k1 = rates(state, r[0])[0]
            k2 = rates(state + 0.5 * h * k1, r[1])[0]
            k3 = rates(state + 0.5 * h * k2, r[1])[0]
            k4 = rates(state + h * k3, r[2])[0]
            state = state + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        outputs.append(rates(state, after)[1])
    return np.stack(outputs).transpose(2, 0, 1)


def rough_road(
    rng: np.random.Generator, count: int, amplitude: float, corner: float, step: float = STEP
) -> FloatArray:
    """White noise through a first-order filter with a corner in rad/s; standard deviation in m."""
    pole = np.exp(-corner * step)
    noise = rng.normal(0, amplitude * np.sqrt(1 - pole**2), count)
    heights = np.empty(count)
    heights[0] = 0.0
    for k in range(1, count):
        heights[k] = pole * heights[k - 1] + noise[k]
    return heights


def sines(rng: np.random.Generator, count: int, largest: float) -> FloatArray:
    """A sum of sines of random frequencies up to 80 rad/s, faster ones with less amplitude."""
    time = STEP * np.arange(count)
    frequencies = np.exp(rng.uniform(np.log(2.0), np.log(80.0), 8))
    amplitudes = rng.uniform(0.2, 1, 8) / np.sqrt(1 + (frequencies / 15) ** 2)
    phases = rng.uniform(0, 2 * np.pi, 8)
    heights = amplitudes @ np.sin(frequencies[:, None] * time + phases[:, None])
    return np.asarray(largest * heights / np.abs(heights).max())


def roads(seed: int, count: int, samples: int) -> FloatArray:
    """Roads to learn from, (count, samples), in m: smooth and rough ones in turns."""
    rng, found = np.random.default_rng(seed), []
    for index in range(count):
        if index % 2 == 0:
            heights = sines(rng, samples, rng.uniform(0.005, 0.08))
        else:
            heights = rough_road(rng, samples, rng.uniform(0.003, 0.03), rng.uniform(1, 12))
        found.append(np.clip(heights, ROAD[0].low, ROAD[0].high))
    return np.array(found)


@dataclass(frozen=True)
class Effort:
    """How much is learnt from, and how long."""

    trajectories: int = 48
    samples: int = 900
    hidden: int = 16
    starts: int = 2
    iterations: int = 40


def train(effort: Effort, seed: int, progress: Progress) -> Surrogate:
    """Learn the surrogate of the quarter car, with the forecast of the road."""
    parts = []
    for part_seed, count in ((seed, effort.trajectories), (seed + 1, effort.trajectories // 4)):
        heights = roads(part_seed, count, effort.samples)
        parts.append((heights[:, 1:, None], simulate(heights)))
    scaling = range_scaling(ROAD)
    spread = parts[0][1].reshape(-1, len(OUTPUTS)).std(axis=0)
    of_outputs = Affine(np.zeros(len(OUTPUTS)), spread)
    seen = scaling.apply(parts[0][0])
    deviation = np.float64(np.float32(seen.std()))
    features = FeatureMap(Differences(1), (0,), Affine.of_channels([0.0], [deviation]))
    tensors = [
        tuple(
            torch.as_tensor(values, dtype=torch.float64)
            for values in (features.along(scaling.apply(u)), of_outputs.apply(y))
        )
        for u, y in parts
    ]
    network = StateSpaceRecipe(order=4, hidden=effort.hidden)
    training = LeastSquaresRecipe(
        seed=seed,
        starts=effort.starts,
        iterations=effort.iterations,
        expert=LeastSquaresExpert(kept=1),
    )
    with tempfile.TemporaryDirectory() as folder:
        problem = Problem(WINDOW, features, *tensors, Path(folder) / "fit.pt")
        fitted = fit_state_space(problem, network, training, progress).network
    forecast = fit_forecast(ROAD, parts[0][0], planned=False)
    scalings = scaling, of_outputs
    return Surrogate("quarter_car", WINDOW, ROAD, OUTPUTS, *scalings, fitted, None, forecast)
