"""This module measures the time of a simulated second of a recipe."""

from __future__ import annotations

from slide_fmu.core.own_time import own_time
from slide_fmu.data.draws import PROBE, Stream, draw, drawn_at_once
from slide_fmu.data.failing_motions import Tolerance
from slide_fmu.recipe.case import Case
from slide_fmu.systems.errors import SimulationError
from slide_fmu.systems.simulation import simulate_motions

TIMED, TIMED_SAMPLES = 2.0, 100
"""Least time in s for which motions are simulated, and samples of the first motion behind
its burn-in. The first motion is enough if it takes this time."""
AT_ONCE = 64
"""Most motions that are timed together, where the system simulates several at once."""


def simulation_time(case: Case) -> tuple[float, str | None, tuple[str, ...]]:
    """Return the time in s of a simulated second, of motions as the data have them.

    Waits for a core do not count (``own_time``), so that numbers of trajectories that follow from
    it are the same on a busy machine.

    That is the time of one process, which simulates as many at once as it does for the data. The
    text is a remark on failed motions, or None. The system's own remarks after these motions
    follow.
    """
    recipe, system = case.recipe, case.system
    tolerance = Tolerance(recipe.data.most_failures)
    short = min(recipe.data.duration, TIMED_SAMPLES * recipe.window.step)
    count = min(AT_ONCE, drawn_at_once(recipe, system, recipe.data.duration))
    begin, simulated = own_time(), 0.0
    while simulated == 0.0 or own_time() - begin < TIMED:
        duration = recipe.data.duration if simulated and count == 1 else short
        stream, motions = Stream(PROBE, recipe.data.seed, (1.0, 1.0), duration), []
        for _ in range(count):
            tolerance.tried += 1
            try:
                motions.append(draw(recipe, system, stream, tolerance.tried - 1).motion)
            except SimulationError as error:
                tolerance.count(error)
        for answer in simulate_motions(system, motions):
            if isinstance(answer, SimulationError):
                tolerance.count(answer)
            else:
                simulated += duration + recipe.data.burn_in
    return (own_time() - begin) / simulated, tolerance.remark, system.remarks
