"""A boom is cut in the rod of the cylinder that lifts it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import SimpleNamespace

import numpy as np
from scipy.integrate import solve_ivp

from mbs_models.boom import cylinder
from mbs_models.boom.boom import Boom
from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.base import Restorable, State, go_on
from slide_fmu.systems.loading import load_system
from slide_fmu.systems.specification import Specification
from tests.own_models.systems.cut_machine import CutMachine, Partner, smooth_command

WHOLE = "mbs_models.boom.boom_with_cylinder"
WHOLE_STEP = 0.001
"""Integration step of the whole machine in s."""
START = 1.5
"""Length of the cylinder in m where all runs begin."""
GAIN, KNOT = 20.0, 0.02
"""An operator opens the valve by GAIN times the length that is missing in m; the record of the
valve is a straight line over each KNOT in s."""

Command = Callable[[FloatArray], FloatArray]


LOAD = 7636.983
"""Force in N that holds the boom at the start; a test compares it."""

PARTNERS: Mapping[str, Partner] = {
    "piston 60 kg": {"load": LOAD, "mass": 60.0},
    "piston 20 kg": {"load": LOAD, "mass": 20.0},
    "piston 10 kg, air in the oil": {"load": LOAD, "mass": 10.0, "bulk_modulus": 6e8},
}


def valve(partner: Partner, seed: int, stop: float) -> Command:
    """Return a record of a valve, with which an operator lets a load follow a smooth length.

    The record is made with a constant force. Whoever plays it back is not corrected.
    """
    p = SimpleNamespace(**{**cylinder.parameters, **partner})
    wanted = smooth_command(seed, 0.0, 0.22, (0.2, 1.5))

    def opening(time: float, length: float) -> float:
        return float(np.tanh(GAIN * (START + float(wanted(np.array(time))) - length)))

    def rates(time: float, x: FloatArray) -> list[float]:
        return cylinder.f(x, [p.load, opening(time, x[0])], p)

    times = KNOT * np.arange(round(stop / KNOT) + 1)
    begun = np.array(cylinder.start(None, p), dtype=np.float64)
    run = solve_ivp(rates, (0.0, times[-1]), begun, "LSODA", times, rtol=1e-6, atol=1e-9)
    openings = np.array([opening(t, x) for t, x in zip(times, run.y[0], strict=True)])

    def command(time: FloatArray) -> FloatArray:
        return np.asarray(np.interp(time, times, openings))

    return command


def whole(partner: Partner, command: Command, step: float, stop: float) -> dict[str, FloatArray]:
    """Return the length of the whole machine's cylinder, its rate, and the bore's pressure."""
    parameters = {**partner, "substeps": 1}
    system = load_system(Specification(WHOLE, parameters, WHOLE_STEP, "exudyn"))
    assert isinstance(system, Restorable)
    p = SimpleNamespace(**{**cylinder.parameters, **partner})
    boom = Boom().rest_state(np.array([START]))
    _, _, *pressures = cylinder.start(None, p)[:4]
    coordinates = np.append(boom.coordinates, [0.0, 0.0])
    velocities = np.append(boom.velocities, [1e-6 * one for one in pressures])
    times = WHOLE_STEP * np.arange(round(stop / WHOLE_STEP) + 1)
    openings = command(times)[:, None]
    system.set_state(State(coordinates, velocities, openings[0]))
    found = go_on(system, openings[1:])[:: round(step / WHOLE_STEP)]
    return {"length": found[:, 0], "rate": found[:, 1], "pressure": 10 * found[:, 2]}


BOOM_CYLINDER = CutMachine(
    half="mbs_models.boom.boom:Boom",
    partner="mbs_models.boom.cylinder",
    partners=PARTNERS,
    links=[("partner.length", "half.length"), ("half.force", "partner.force")],
    force="force",
    motion=("length",),
    command="valve",
    step=0.01,
    integration=0.0025,
    free=({"load": LOAD + 2000.0}, "rate", 0.02),
    drive=valve,
    whole=whole,
    place=lambda inputs: inputs[:, 0],
)
