"""Steps at which the exact boom and its cylinder, coupled by Newton's method, zigzag and grow.

Boom and cylinder are linearized over one step at rest. The most negative eigenvalue of both
together is printed: below -1, a zigzag from step to step grows by this factor. Runs of the piston
of 10 kg that is let go confirm it. The force on the piston moves along a straight line to its
value at the end of each step, or has this value over the whole step.

    PYTHONPATH=. python tests/benchmarks/coupled_zigzag.py --json -
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from scipy.linalg import block_diag

from slide_fmu.apps.reference.reference_slave import write_reference_fmu
from slide_fmu.core.progress import Stages
from slide_fmu.core.signals import FloatArray, Hold
from slide_fmu.systems.base import Restorable, State
from slide_fmu.systems.declared import SignalTable
from slide_fmu.systems.loading import load_system
from slide_fmu.systems.specification import Specification
from tests.benchmarks.coupled_systems import METHODS, is_stable
from tests.benchmarks.figures_out import measure_and_write
from tests.own_models.systems.boom_cylinder import BOOM_CYLINDER, LOAD, START
from tests.own_models.systems.cut_machine import Partner

STEPS = (0.4, 0.6, 0.7, 0.8, 1.0, 1.2, 1.5, 2.0, 2.4, 2.7, 3.0, 4.0, 6.0, 10.0, 20.0)
"""Communication steps in ms."""
CHANGE = 1e-6
"""Change of a state, or of an input, as a part of its size, at least of 1."""
HOLDS: dict[str, Hold] = {"force moves": "first_order", "force is held": "zero_order"}
PARTNERS: dict[str, Partner] = {
    f"piston {mass:g} kg": {"load": LOAD, "mass": mass} for mass in (10.0, 20.0, 60.0)
}


def cylinder(partner: Partner, step: float, hold: Hold) -> Specification:
    """Return the cylinder with inputs that move or are held over each step in s."""
    table = SignalTable(hold=hold)
    inputs = {"force": table, "valve": table}
    return Specification(BOOM_CYLINDER.partner, dict(partner), step, "function", inputs)


def linearized(system: Any, inputs: FloatArray) -> tuple[FloatArray, ...]:
    """Return A, B, C, D of x' = A x + B u, y = C x + D u over a step, at rest under the inputs.

    u is the first input, and y the first output; states end with the input of the step before.
    """
    assert isinstance(system, Restorable)
    rest = system.rest_state(inputs)
    count = len(rest.coordinates)
    at = np.concatenate([rest.coordinates, rest.velocities, inputs[:1], inputs[:1]])

    def stepped(x: FloatArray) -> FloatArray:
        before, now = np.append(x[-2], inputs[1:]), np.append(x[-1], inputs[1:])
        system.set_state(State(x[:count], x[count:-2], before))
        output = system.advance(now)
        state = system.get_state()
        return np.concatenate([state.coordinates, state.velocities, now[:1], output[:1]])

    columns = [
        (stepped(at + change) - stepped(at - change)) / (2 * change.sum())
        for change in np.diag(CHANGE * np.maximum(1.0, np.abs(at)))
    ]
    rates = np.array(columns).T
    return rates[:-1, :-1], rates[:-1, -1], rates[-1, :-1], rates[-1, -1]


def zigzag(boom: Any, piston: Any) -> float:
    """Return the most negative eigenvalue of both halves that agree at the end of each step."""
    (a, b, c, d), (e, g, h, k) = boom, piston
    force = np.concatenate([c, d * h]) / (1 - d * k)  # by the states of both before the step
    length = np.concatenate([np.zeros(len(a)), h]) + k * force
    both = block_diag(a, e) + np.vstack([np.outer(b, length), np.outer(g, force)])
    return float(np.linalg.eigvals(both).real.min())


def measure(arguments: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Return eigenvalues of all pistons, and whether runs of the lightest come to rest."""
    found: dict[str, Any] = {}
    progress = bar("steps")
    at_rest = np.array([START]), np.array([LOAD, 0.0])
    with tempfile.TemporaryDirectory() as place:
        for number, milliseconds in enumerate(arguments.steps):
            progress(number, len(arguments.steps))
            step = 1e-3 * milliseconds
            boom = linearized(BOOM_CYLINDER.half_system(step), at_rest[0])
            of_step: dict[str, Any] = {}
            for words, hold in HOLDS.items():
                pistons = {
                    name: linearized(load_system(cylinder(one, step, hold)), at_rest[1])
                    for name, one in PARTNERS.items()
                }
                of_step[words] = {name: zigzag(boom, one) for name, one in pistons.items()}
            held = Path(place) / f"held_{number}.fmu"
            write_reference_fmu(cylinder(BOOM_CYLINDER.free[0], step, "zero_order"), held)
            for words, given in (("force moves", {}), ("force is held", {"partner": held})):
                run = is_stable(BOOM_CYLINDER, Path(place), given, step, METHODS["newton"])
                of_step[words]["run is stable"] = run
            found[f"{milliseconds:g} ms"] = of_step
        progress(len(arguments.steps), len(arguments.steps))
    return found


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--steps", type=float, nargs="+", default=STEPS, help="in ms")
    measure_and_write(parser, measure)
