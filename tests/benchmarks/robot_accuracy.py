"""How accurate and how fast the robot's model is, for every kind of socket and of substeps.

Usage:

    python tests/benchmarks/robot_accuracy.py --json - [--seeds 3] [--redundant]

Motions go from random pose to random pose, in 1 s with constant acceleration and deceleration
as in the paper (``fast``), or in 3 s (``slow``). An error is the RMS of the difference to the
finest reference (finite elements, 64 substeps) over the reference's standard deviation, without
the first move; a speed is in simulated seconds per CPU second, all of one run interleaved.

``--redundant`` adds the authors' formulation (see redundant_robot; needs the extra ``mesh``): its
speed with their mesh and settings on windows of two moves, its own integration error, and the
difference of the package's model to it on a mesh that is as symmetric as the cylinder.
"""

from __future__ import annotations

import argparse
import itertools
import time
from typing import Any

import numpy as np
from figures_out import write_figures

from mbs_models.robot_6r.puma_560 import JOINTS, LIMITS
from mbs_models.robot_6r.robot_6r import Robot6R
from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.simulation import simulate

MOVES, PAUSE = 6, 1
"""Moves in a motion; those that do not count."""
SAMPLES = {"fast": 60, "slow": 180}
"""Samples of a move."""
VARIANTS = [
    *(("spring", substeps) for substeps in (2, 3, 4, 6, 8, 12)),
    *(("finite_element", substeps) for substeps in (3, 4, 8, 16)),
]
FINEST = 64
AUTHORS_SUBSTEPS, AUTHORS_FINEST = 20, 80


def moves(samples: int, seed: int, count: int = MOVES) -> FloatArray:
    """Set points in rad, shape (count * samples + 1, 6), starting at rest at the first row."""
    poses = np.random.default_rng(seed).uniform(-LIMITS, LIMITS, (count + 1, JOINTS))
    s = np.arange(1, samples + 1) / samples
    share = np.where(s < 0.5, 2.0 * s**2, 1.0 - 2.0 * (1.0 - s) ** 2)[:, None]
    legs = [start + (end - start) * share for start, end in itertools.pairwise(poses)]
    return np.vstack([poses[:1], *legs])


def response(system: Robot6R, set_points: FloatArray) -> tuple[FloatArray, float]:
    """Deviations in m from the static equilibrium on, and CPU seconds without the start."""
    rest = system.rest_state(set_points[0])
    system.set_state(rest)
    system.advance(set_points[0])
    begin = time.process_time()
    outputs = simulate(system, set_points[1:], rest).outputs
    return outputs, time.process_time() - begin


def error(found: FloatArray, reference: FloatArray) -> float:
    """RMS of the difference over the reference's standard deviation, all coordinates together."""
    spread = np.sqrt(np.mean(np.var(reference, axis=0)))
    return float(np.sqrt(np.mean((found - reference) ** 2)) / spread)


def variants(seeds: int) -> dict[str, Any]:
    """Errors and speeds of every variant."""
    errors: dict[str, dict[str, list[float]]] = {}
    speeds: dict[str, list[float]] = {}
    largest = np.zeros(3)
    for (motion, samples), seed in itertools.product(SAMPLES.items(), range(seeds)):
        set_points, start = moves(samples, seed), PAUSE * samples
        finest, _ = response(Robot6R(socket="finite_element", substeps=FINEST), set_points)
        largest = np.maximum(largest, np.max(np.abs(finest), axis=0))
        for socket, substeps in VARIANTS:
            name = f"{socket}_{substeps}"
            system = Robot6R(socket=socket, substeps=substeps)
            found, seconds = response(system, set_points)
            of_motion = errors.setdefault(name, {}).setdefault(motion, [])
            of_motion.append(error(found[start:], finest[start:]))
            speeds.setdefault(name, []).append(len(set_points) * system.step / seconds)
    return {
        "largest_deviation_m": largest.tolist(),
        "variants": {
            name: {
                "error": {motion: float(np.mean(found)) for motion, found in of.items()},
                "worst_error": {motion: float(np.max(found)) for motion, found in of.items()},
                "speed": float(np.median(speeds[name])),
            }
            for name, of in errors.items()
        },
    }


def redundant(seeds: int) -> dict[str, Any]:
    """The authors' formulation: its speed, its error, and what the package's differs from it."""
    from redundant_robot import AUTHORS_MESH, RedundantRobot

    from mbs_models.robot_6r.socket import SocketMesh
    from mbs_models.robot_6r.socket_mesh import reduced

    step, samples = Robot6R().step, SAMPLES["fast"]
    speeds, errors, differences = [], [], []
    symmetric = SocketMesh(element_size=0.015)
    ours = Robot6R(socket="finite_element", reduced=reduced(symmetric))
    for seed in range(seeds):
        set_points = moves(samples, seed, count=2)
        runs = []
        for mesh, substeps in (
            (AUTHORS_MESH, AUTHORS_SUBSTEPS),
            (AUTHORS_MESH, AUTHORS_FINEST),
            (symmetric, 8),
        ):
            runs.append(RedundantRobot(mesh, set_points, step))
            runs[-1].run(substeps)
        authors, finest, other = (run.deviation[samples:] for run in runs)
        speeds.append(len(set_points) * step / runs[0].seconds)
        errors.append(error(authors, finest))
        differences.append(error(response(ours, set_points)[0][samples:], other))
    return {
        "speed": float(np.median(speeds)),
        "error": float(np.mean(errors)),
        "difference_of_the_package": differences,
    }


def main() -> None:
    """Print or write the result."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", default="-")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--redundant", action="store_true")
    arguments = parser.parse_args()
    result = variants(arguments.seeds)
    if arguments.redundant:
        result["redundant"] = redundant(arguments.seeds)
    write_figures(result, arguments.json)


if __name__ == "__main__":
    main()
