"""A search finds inputs within their ranges whose error is large relative to its bound.

An error bound holds for inputs like those of its calibration. An optimiser that uses the surrogate
looks for others, and profits from errors that the bound does not cover. This search does the same.
From an unseen trajectory it changes the inputs of one window before the step with the largest
ratio of error to bound, keeps the changes that make it worse, and goes on. It is an evolution
strategy with one parent, one child and the one-fifth success rule (Rechenberg, 1973): the
reference system needs no gradients. Samples that are not trusted do not count, since the FMU says
so there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slide_fmu.core.progress import Progress
from slide_fmu.core.signals import FloatArray, on_circles
from slide_fmu.data.draws import TEST, Draw, Stream, first_that_runs
from slide_fmu.recipe.case import Case
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import System
from slide_fmu.systems.errors import SimulationError
from slide_fmu.validation.attacked import AttackedRun, MeasuredInputs, Target

CHILDREN = 100
"""Number of changes that are tried from each start."""

FIRST_STEP, LEAST_STEP = 0.3, 0.01
"""Standard deviation of the first changes, and of the least ones, in half ranges of the input."""

GROWTH, SHRINKAGE = 1.5, 1.5**-0.25
"""With these factors of the step after a success and a failure, one in five succeeds."""


@dataclass(frozen=True, eq=False)
class Attack:
    """An Attack is the result of the search from one start.

    Attributes:
        before: largest error over its bound where it is trusted, at the start and at the usual
            confidence.
        found: the inputs at the end, measured.
    """

    before: float
    found: MeasuredInputs

    @property
    def after(self) -> float:
        """Largest error over its bound where it is trusted, at the end."""
        return self.found.ratio


def attack(
    surrogate: Surrogate, case: Case, seed: int, starts: int, progress: Progress
) -> list[Attack]:
    """Search from ``starts`` unseen trajectories in range.

    Raises:
        LoadError: the reference system is not installed here.
        SimulationError: the reference could not be simulated, nor on other draws.
        ValueError: the surrogate has no error bound.
    """
    recipe, system = case.recipe, case.reference
    stream = Stream(TEST, seed, (1.0, 1.0), recipe.validation.duration or recipe.data.duration)
    found = []
    progress(0, starts)
    for index in range(starts):
        target = _target(surrogate, recipe, system, stream, index)
        found.append(search(target, np.random.default_rng((seed, index))))
        progress(index + 1, starts)
    return found


def _target(
    surrogate: Surrogate, recipe: Recipe, system: System, stream: Stream, index: int
) -> Target:
    """Draw a start; another one where the reference fails on it."""

    def run(drawn: Draw) -> Target:
        target = Target(surrogate, system, drawn)
        target.run(drawn.inputs)
        return target

    return first_that_runs(recipe, system, stream, index, run)


def search(target: Target, rng: np.random.Generator) -> Attack:
    """Search from the trajectory of a target; the result is measured on the whole trajectory.

    Raises:
        SimulationError: the reference could not be simulated on the trajectory, or on the inputs
            that were found.
    """
    best = target.run(target.drawn.inputs)
    ratio, step = before, _ = target.worst(best)
    size = FIRST_STEP
    for _ in range(CHILDREN):
        inputs, changed = _changed(target, best.inputs, step, size, rng)
        child, found, at = _tried(target, best, inputs, changed)
        if child is not None and found > ratio:
            best, ratio, step = child, found, at
            size = min(size * GROWTH, 1.0)
        else:
            size = max(size * SHRINKAGE, LEAST_STEP)
    return _attack(target, best.inputs, before)


def _tried(
    target: Target, parent: AttackedRun, inputs: FloatArray, changed: slice
) -> tuple[AttackedRun | None, float, int]:
    """Run changed inputs; return the run, the largest error over its bound, and its sample.

    The run is None where the reference fails.
    """
    try:
        child = target.run_changed(parent, inputs, changed)
    except SimulationError:
        return None, 0.0, 0
    return child, *target.worst(child)


def _attack(target: Target, inputs: FloatArray, before: float) -> Attack:
    """Measure errors and bounds on the inputs that a search has found."""
    return Attack(before, target.measured(target.run(inputs)))


def _changed(
    target: Target, inputs: FloatArray, step: int, size: float, rng: np.random.Generator
) -> tuple[FloatArray, slice]:
    """Change the inputs before a step by noise that is held for a random number of samples.

    Returns:
        The new inputs, (N, n_inputs), and the samples that changed.
    """
    signals, n_in = target.surrogate.inputs, target.surrogate.window.n_in
    low, high = (np.array([getattr(s, end) for s in signals]) for end in ("low", "high"))
    first = max(0, step + 1 - n_in)
    count = step + 1 - first
    hold = int(np.exp(rng.uniform(0, np.log(max(2, count // 2)))))
    knots = np.arange(0, count + hold, hold)
    values = rng.normal(size=(len(knots), len(signals))) * size * 0.5 * (high - low)
    places = np.arange(count)
    if target.surrogate.hold == "zero_order":
        noise = values[places // hold]
    else:
        noise = np.stack(
            [np.interp(places, knots, values[:, i]) for i in range(len(signals))], axis=1
        )
    child, changed = inputs.copy(), slice(first, step + 1)
    child[changed] = on_circles(signals, np.clip(child[changed] + noise, low, high))
    return child, changed
