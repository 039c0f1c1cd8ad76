"""A car is cut between suspension and wheel: both halves are damped, forget, and can be learnt."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from scipy.integrate import solve_ivp

from slide_fmu.core.signals import FloatArray
from tests.own_models.systems import car_body, car_wheel
from tests.own_models.systems.cut_machine import CutMachine, Partner, smooth_command

HERE = Path(__file__).parent
KNOT = 0.02
"""The road is a straight line over each of these times, in s."""
STATES = 2
"""Of the wheel; the states of body and driver follow."""
KERB = 0.02
"""Height in m from which the road falls to 0 within the first step, when the car is let go."""

Command = Callable[[FloatArray], FloatArray]

PARTNERS: Mapping[str, Partner] = {"first road": {}, "second road": {}, "third road": {}}
"""The roads differ by the seed alone."""


def road(partner: Partner, seed: int, stop: float) -> Command:
    """Return heights in m of a road over time: sines of 0.3 to 6 Hz, up to 60 mm in sum."""
    times = KNOT * np.arange(round(stop / KNOT) + 1)
    heights = smooth_command(seed, 0.0, 0.06, (2.0, 40.0))(times)

    def command(time: FloatArray) -> FloatArray:
        return np.asarray(np.interp(time, times, heights))

    return command


def whole(partner: Partner, command: Command, step: float, stop: float) -> dict[str, FloatArray]:
    """Return the height of the wheel and the force on it of the whole car, without any cut."""
    of_body, of_wheel = (SimpleNamespace(**one.parameters) for one in (car_body, car_wheel))
    per_knot = round(KNOT / step)
    times, x = KNOT * np.arange(round(stop / KNOT) + 1), np.zeros(STATES + len(car_body.start))
    heights, found = command(times), [x]

    def push(x: FloatArray) -> float:
        return float(car_body.g(x[STATES:], [x[0]], of_body)[0])

    for height, slope in zip(heights[:-1], np.diff(heights) / KNOT, strict=True):

        def rates(
            t: float, x: FloatArray, height: float = height, slope: float = slope
        ) -> list[float]:
            inputs = [height + slope * t, push(x)]
            wheel = car_wheel.f(x[:STATES], inputs, of_wheel, [slope, 0.0])
            return [*wheel, *car_body.f(x[STATES:], [x[0]], of_body)]

        at = step * np.arange(1, per_knot + 1)
        run = solve_ivp(rates, (0.0, KNOT), x, "DOP853", at, rtol=1e-9, atol=1e-12)
        found.extend(run.y.T)
        x = run.y[:, -1]
    return {
        "wheel": np.array([x[0] for x in found]),
        "half.force": np.array(list(map(push, found))),
    }


CAR_IN_TWO = CutMachine(
    half=str(HERE / "car_body.py"),
    partner=str(HERE / "car_wheel.py"),
    partners=PARTNERS,
    links=[("partner.wheel", "half.wheel"), ("half.force", "partner.force")],
    force="force",
    motion=("wheel",),
    command="road",
    step=0.01,
    integration=None,
    free=({}, "wheel", KERB),
    drive=road,
    whole=whole,
    place=lambda inputs: inputs[:, 0],
    let_go=lambda time: KERB if time <= 0 else 0.0,
)
