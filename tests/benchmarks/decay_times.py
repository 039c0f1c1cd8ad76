"""Decay times of the paper's flexible slider-crank and robot, linearized and measured.

    python tests/benchmarks/decay_times.py --json - --picture decay_times.png

Decay to 1 %. The slider-crank stands still at angles all around, without its drive as in the
paper, then with two drives. The robot moves as in the paper: from pose to pose to pose in 1 s
each, from rest. Its decay time on a motion is that of the mean rate over the motion, or from the
start: when the product of all exp(Re(v) h) so far reaches 1 %. Measured is the time in which the
outputs of two motions from random states meet, without any linearization.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np
from decay_times_picture import CrankCase, Findings, draw
from figures_out import write_figures

from mbs_models.robot_6r.robot_6r import Robot6R
from mbs_models.slider_crank.slider_crank import SliderCrank
from slide_fmu.core.signals import FloatArray
from slide_fmu.excitation.point_to_point import Moves, PointToPoint
from slide_fmu.excitation.speed_ramps import SpeedRamps
from slide_fmu.memory.decay import Decay, decay_along, measured_decay
from slide_fmu.memory.modes import spectrum
from slide_fmu.systems.base import State, System

DRIVES = {"no drive": (0.0, 0.0), "drive": (1000.0, 100.0), "weak drive": (10.0, 100.0)}
"""P in N m/rad and D in N m s/rad by name; the last is that of the paper's code."""
SLOWEST = 3
"""Modes of the slider-crank that are looked at."""
MEASURED_DECAYS = 3.0
"""Length of the slider-crank's measured motions, in decay times."""
ROBOT_SUBSTEPS = 16
"""Of the robot: with 8, numerical ringing of up to 0.01 mm hides the end of small decays."""
MOVE = 1.0
"""Duration of a move of the robot in s."""
PAPER_POSES = np.array(
    [
        [-2.3, -1.18, -2.14, -1.09, -0.39, -1.42],
        [1.83, -0.55, -1.03, 0.27, -1.25, 1.88],
        [-2.38, 1.87, 1.28, -1.87, -1.73, 1.96],
    ]
)
"""Of the trajectory in the paper's figure, in rad."""


def crank_case(gains: tuple[float, float], angles: FloatArray) -> CrankCase:
    """Decay times of the slowest modes at crank angles in rad."""
    system = SliderCrank(proportional=gains[0], differential=gains[1])
    spectra = [spectrum(system.linearize(system.straight_state(a, 0.0))) for a in angles]
    modes = [found.modes[:SLOWEST] for found in spectra]
    times = np.array([[mode.decay_time for mode in row] for row in modes])
    frequencies = np.array([[mode.eigenvalue.imag for mode in row] for row in modes])
    return CrankCase(gains, times, frequencies, len(spectra[0].rigid))


def crank_measured(case: CrankCase, pairs: int, rng: np.random.Generator) -> Decay:
    """Decay times of pairs of motions under the paper's ramps of speed."""
    system = SliderCrank(
        proportional=case.gains[0], differential=case.gains[1], elements=6, substeps=4
    )
    ramps = SpeedRamps(kind="speed_ramps", weight=1.0, speed=8.0, acceleration=20.0)
    count = round(MEASURED_DECAYS * float(np.max(case.times)) / system.step)
    time = system.step * np.arange(count)
    records = [ramps.inputs(system.inputs, time, 1.0, rng) for _ in range(pairs)]
    return measured_decay(system, records, rng)


def robot_motions(system: System, count: int, rng: np.random.Generator) -> list[FloatArray]:
    """Desired angles in rad at all samples, shape (N + 1, 6): the paper's motion, then random."""
    time = system.step * np.arange(round(2 * MOVE / system.step) + 1)
    moves = Moves(MOVE * np.arange(2), np.full(2, MOVE), np.full(2, 0.5), PAPER_POSES)
    kind = PointToPoint(kind="point_to_point", weight=1.0)
    drawn = (kind.inputs(system.inputs, time, 1.0, rng) for _ in range(count))
    return [moves.at(time), *drawn]


def states_along(system: System, set_points: FloatArray) -> list[State]:
    """States at all samples, from the static equilibrium at the first set points."""
    system.set_state(system.rest_state(set_points[0]))
    states = [system.get_state()]
    for row in set_points[1:]:
        system.advance(row)
        states.append(system.get_state())
    return states


def find(angles: int, trajectories: int, pairs: int, seed: int) -> Findings:
    """All decay times.

    Args:
        angles: number of crank angles around the circle.
        trajectories: random motions of the robot.
        pairs: measured pairs of motions: of the slider-crank for each drive, of the robot for
            each motion.
        seed: of the motions and of the measured states.
    """
    rng = np.random.default_rng(seed)
    around = np.linspace(0.0, 2.0 * np.pi, angles)
    cranks = {name: crank_case(gains, around) for name, gains in DRIVES.items()}
    measured = {
        name: crank_measured(case, pairs, rng)
        for name, case in cranks.items()
        if case.gains[0] > 0
    }
    robot = Robot6R(substeps=ROBOT_SUBSTEPS)
    motions = robot_motions(robot, trajectories, rng)
    linearized = [decay_along(robot, states_along(robot, motion)) for motion in motions]
    met = [measured_decay(robot, [motion] * pairs, rng) for motion in motions]
    return Findings(around, cranks, measured, robot.step, linearized, met)


def figures(found: Findings) -> dict[str, Any]:
    """The decay times as plain values."""
    cranks = {name: _crank_figures(case) for name, case in found.cranks.items()}
    for name, decay in found.crank_measured.items():
        cranks[name]["measured_decay_time_s"] = _spread(decay.times)
    keys = robot_figures(found)
    drawn = {key: _spread(values[1:]) for key, values in keys.items()}
    paper = {key: float(values[0]) for key, values in keys.items()}
    return {
        "slider_crank": cranks,
        "robot": {
            "random_trajectories": {"count": len(found.linearized) - 1, **drawn},
            "paper_trajectory": paper,
        },
    }


def robot_figures(found: Findings) -> dict[str, FloatArray]:
    """Decay times in s on the robot's motions, shape (1 + trajectories,) each."""
    return {
        "decay_time_of_mean_rate_s": np.array([decay.mean for decay in found.linearized]),
        "largest_decay_time_on_the_way_s": np.array([decay.worst for decay in found.linearized]),
        "decay_time_from_start_s": found.from_start(),
        "measured_decay_time_of_mean_rate_s": np.array([d.mean for d in found.measured]),
    }


def _crank_figures(case: CrankCase) -> dict[str, Any]:
    modes = [{"least": float(min(mode)), "largest": float(max(mode))} for mode in case.times.T]
    return {
        "proportional_N_m_per_rad": case.gains[0],
        "differential_N_m_s_per_rad": case.gains[1],
        "rigid_body_eigenvalues": case.rigid,
        "decay_times_of_slowest_modes_s": modes,
    }


def _spread(times: FloatArray) -> dict[str, float]:
    return {
        "least": float(np.min(times)),
        "mean": float(np.mean(times)),
        "median": float(np.median(times)),
        "largest": float(np.max(times)),
    }


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--angles", type=int, default=181)
    parser.add_argument("--trajectories", type=int, default=50)
    parser.add_argument("--pairs", type=int, default=6)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--picture", type=Path)
    parser.add_argument("--json", default="-")
    arguments = parser.parse_args()
    found = find(arguments.angles, arguments.trajectories, arguments.pairs, arguments.seed)
    write_figures(figures(found), arguments.json)
    if arguments.picture is not None:
        draw(found, arguments.picture)


if __name__ == "__main__":
    main()
