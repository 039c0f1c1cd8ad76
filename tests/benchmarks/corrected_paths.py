"""Smooth random paths of the robot, corrected by its surrogate; the finest model judges.

    python tests/benchmarks/corrected_paths.py --paths 10 --json -

Paths go from place to place within 60 % of the joints' ranges, by least jerk, at most 1.5 times as
slow as the recipe's speeds admit. Those on which the joints move the tool with a condition number
of 100 or more at some sample stand apart.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from figures_out import measure_and_write
from seeds import CORRECTED_PATHS

from slide_fmu.apps.motion import MotionError, PathTask, coordinates_of
from slide_fmu.apps.motion.compensation import chain_of_surrogate, condition_along
from slide_fmu.apps.motion.path_correction import correct, read_path
from slide_fmu.core.figures import plain
from slide_fmu.core.progress import Stages
from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.export import load

FMU = Path(__file__).parents[2] / "fmus" / "robot_6r" / "robot_6r.fmu"
REACH, SPEED, SAMPLES_AT_REST = 0.6, 1.2, 30
WELL_CONDITIONED = 100.0


def random_path(low: FloatArray, high: FloatArray, step: float, rng: np.random.Generator) -> str:
    """Draw a path and give it as CSV."""
    start, goal = rng.uniform(REACH * low, REACH * high, (2, len(low)))
    duration = 1.5 * np.abs(goal - start).max() / SPEED
    time = step * np.arange(int(duration / step) + SAMPLES_AT_REST)
    done = np.minimum(time / duration, 1.0)[:, None]
    joints = start + done**3 * (10 - 15 * done + 6 * done**2) * (goal - start)
    names = ["time", *(f"joint_{i + 1}" for i in range(len(low)))]
    rows = np.concatenate([time[:, None], joints], axis=1)
    return (
        "\n".join([",".join(names), *(",".join(f"{v:.12g}" for v in row) for row in rows)]) + "\n"
    )


def measure(chosen: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Correct paths until enough of them are well conditioned; say how much less they are off."""
    surrogate, rng = load(FMU), np.random.default_rng(chosen.seed)
    low, high = (np.array([getattr(s, end) for s in surrogate.inputs]) for end in ("low", "high"))
    robot = chain_of_surrogate(surrogate)
    assert robot is not None
    chain, ranges = robot.tool_position, 0.5 * (high - low)
    progress = bar("paths")
    good: list[float] = []
    others: list[float | str] = []
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "path.csv"
        while len(good) < chosen.paths:
            progress(len(good), chosen.paths)
            place.write_text(random_path(low, high, surrogate.window.step, rng), encoding="utf-8")
            path = read_path(str(place), coordinates_of(surrogate.inputs), surrogate).motion
            well = condition_along(chain, path, ranges).max() < WELL_CONDITIONED
            task = PathTask(kind="compensate", path=str(place))
            try:
                figures = plain(correct(FMU, task, verify=True).figures())
            except MotionError as refused:
                if well:  # the proof is about these: none may be left out
                    raise
                others.append(str(refused))
            else:
                (good if well else others).append(figures["reference"]["times_less"])
    progress(chosen.paths, chosen.paths)
    return {
        "seed": chosen.seed,
        "times_less": good,
        "least": min(good),
        "median": float(np.median(good)),
        "badly_conditioned": others,
    }


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--paths", type=int, default=10)
    parser.add_argument("--seed", type=int, default=CORRECTED_PATHS)
    measure_and_write(parser, measure)
