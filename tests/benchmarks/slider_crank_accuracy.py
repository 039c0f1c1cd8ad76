"""Error and speed of settings of the flexible slider-crank, side by side.

    python tests/benchmarks/slider_crank_accuracy.py --json -

The motions are phases of constant angular acceleration. The error is that of the deflection
against the finest setting: its RMS over the deflection's standard deviation, in percent, without
the start. Speeds are simulated seconds per second of processor time, drive, outputs and Python
included; all settings take turns on each motion.
"""

from __future__ import annotations

import argparse
import time
from typing import Any

import numpy as np
from figures_out import write_figures

from mbs_models.slider_crank.slider_crank import SliderCrank, director
from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.simulation import simulate

FINEST = (40, 160)
"""Elements and substeps of what counts as the truth."""
CHECKS = {"half the substeps": (40, 80), "half the elements": (20, 160)}
"""What the truth itself is uncertain by."""
CANDIDATES = [
    (4, 4),
    (4, 5),
    (6, 4),
    (6, 5),
    (6, 8),
    (6, 10),
    (8, 10),
    (8, 16),
    (10, 20),
    (20, 20),
]
START = 96
"""Samples left out: 3 s."""
SPEED, ACCELERATION = 8.0, 20.0
"""Largest of the crank, in rad/s and rad/s^2."""


def angles(count: int, step: float, rng: np.random.Generator) -> FloatArray:
    """Desired crank angles in rad: 20 to 60 steps of one acceleration, a tenth of them zero."""
    accelerations: list[float] = []
    while len(accelerations) < count:
        value = rng.uniform(-ACCELERATION, ACCELERATION) * float(rng.uniform() > 0.1)
        accelerations += [value] * int(rng.integers(20, 61))
    speeds, speed = np.empty(count), 0.0
    for k in range(count):
        speed = float(np.clip(speed + step * accelerations[k], -SPEED, SPEED))
        speeds[k] = speed
    return np.asarray(rng.uniform(-np.pi, np.pi) + step * np.cumsum(speeds))


def run(setting: tuple[int, int], inputs: FloatArray) -> tuple[FloatArray, float]:
    """Deflection in m after the start, and simulated seconds per second."""
    system = SliderCrank(elements=setting[0], substeps=setting[1])
    start = system.rest_state(inputs[0])
    simulate(system, inputs[:1], start)  # builds the model
    begin = time.process_time()
    outputs = simulate(system, inputs, start).outputs
    spent = time.process_time() - begin
    return outputs[START:, 0], len(inputs) * system.step / spent


def measure(samples: int, motions: int) -> dict[str, Any]:
    """Worst errors and median speeds over the motions."""
    errors: dict[str, list[float]] = {}
    speeds: dict[str, list[float]] = {}
    largest: list[float] = []
    settings = {f"{e} elements, {s} substeps": (e, s) for e, s in CANDIDATES}
    for seed in range(motions):
        path = angles(samples, SliderCrank().step, np.random.default_rng(seed))
        inputs = np.array([director(angle) for angle in path])
        exact, _ = run(FINEST, inputs)
        largest.append(float(np.max(np.abs(exact))))
        for name, setting in {**CHECKS, **settings}.items():
            found, speed = run(setting, inputs)
            error = np.sqrt(np.mean((found - exact) ** 2)) / np.std(exact)
            errors.setdefault(name, []).append(100.0 * float(error))
            speeds.setdefault(name, []).append(speed)
    table = {
        name: {
            "error_percent_mean": float(np.mean(errors[name])),
            "error_percent_worst": max(errors[name]),
            "simulated_seconds_per_second": float(np.median(speeds[name])),
        }
        for name in errors
    }
    return {"motions": motions, "samples": samples, "largest_deflection_m": largest, **table}


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=640)
    parser.add_argument("--motions", type=int, default=4)
    parser.add_argument("--json", default="-")
    arguments = parser.parse_args()
    write_figures(measure(arguments.samples, arguments.motions), arguments.json)


if __name__ == "__main__":
    main()
