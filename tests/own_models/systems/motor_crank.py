"""A slider-crank is cut at the shaft of its motor, on the motor's side of a coupling."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from mbs_models.slider_crank.motor import parameters
from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.base import Stepping
from slide_fmu.systems.loading import load_system
from slide_fmu.systems.specification import Specification
from tests.own_models.systems.cut_machine import CutMachine, Partner, smooth_command

WHOLE_STEP = 0.00125
"""Integration step of the whole machine in s."""

Command = Callable[[FloatArray], FloatArray]

PARTNERS: Mapping[str, Partner] = {
    "rotor 2 kg m^2": {"inertia": 2.0},
    "rotor 0.5 kg m^2": {"inertia": 0.5},
    "rotor 0.1 kg m^2": {"inertia": 0.1},
    "rotor 0.1 kg m^2, soft controller": {
        "inertia": 0.1,
        "proportional": 100.0,
        "differential": 10.0,
    },
}


def whole(partner: Partner, command: Command, step: float, stop: float) -> dict[str, FloatArray]:
    """Return how far the whole machine's motor lags behind, and its speed."""
    model = "mbs_models.slider_crank.motor_crank"
    known = {key: value for key, value in {**parameters, **partner}.items() if key != "offset"}
    system = load_system(Specification(model, {**known, "substeps": 1}, WHOLE_STEP, "exudyn"))
    assert isinstance(system, Stepping)
    times = 0.5 * WHOLE_STEP * np.arange(2 * round(stop / WHOLE_STEP) + 1)
    speed = command(times)  # Simpson's rule gives the angle that the motor follows
    moved = (speed[:-1:2] + 4 * speed[1::2] + speed[2::2]) * WHOLE_STEP / 6
    followed = np.concatenate([[0.0], np.cumsum(moved)])
    found = system.simulate(followed[1:, None])
    every = round(step / WHOLE_STEP)
    return {"lag": (followed - found[:, 0])[::every], "rate": found[::every, 1]}


def shaft_angle(inputs: FloatArray) -> FloatArray:
    """Return the angle of the shaft in rad from its cosine and sine, without jumps."""
    return np.unwrap(np.arctan2(inputs[:, 1], inputs[:, 0]))


MOTOR_CRANK = CutMachine(
    half="mbs_models.slider_crank.coupled_crank:CoupledCrank",
    partner="mbs_models.slider_crank.motor",
    partners=PARTNERS,
    links=[
        ("partner.shaft_x", "half.shaft_x"),
        ("partner.shaft_y", "half.shaft_y"),
        ("half.torque", "partner.torque"),
    ],
    force="torque",
    motion=("shaft_x", "shaft_y"),
    command="speed",
    step=0.01,
    integration=0.0025,
    free=({"inertia": 0.1, "offset": 0.1}, "lag", 0.1),
    drive=lambda partner, seed, stop: smooth_command(seed, 2.0, 3.0, (0.5, 5.0)),
    whole=whole,
    place=shaft_angle,
)
