"""A search finds inputs within their ranges whose error is large relative to its bound.

An error bound holds for inputs like those of its calibration. An optimiser that uses the surrogate
looks for others, and profits from errors that the bound does not cover. This search does the same.
From an unseen trajectory it changes the inputs of one window before the step with the largest
ratio of error to bound, keeps the changes that make it worse, and goes on. It is an evolution
strategy with one parent, one child and the one-fifth success rule (Rechenberg, 1973): the
reference system needs no gradients. Samples that are not trusted do not count, since the FMU says
so there.

Most of a changed trajectory stays as it was. A reference whose states can be set goes on from the
change, and ends when the change is forgotten. Moving inputs go straight from sample to sample
here, whatever the recipe's kinds of excitation do. A surrogate of ``data.substeps`` has learnt
from inputs that bend, so what the straight lines change is part of its errors here. Without
``data.substeps`` the data have straight lines too.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.progress import Progress
from slide_fmu.core.signals import FloatArray, on_circles
from slide_fmu.data.draws import TEST, Draw, Stream, first_that_runs
from slide_fmu.recipe.case import Case
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import Restorable, State, System
from slide_fmu.systems.errors import SimulationError
from slide_fmu.systems.simulation import simulate


@dataclass(frozen=True, eq=False)
class MeasuredInputs:
    """MeasuredInputs are N samples of inputs, with errors and bounds of a surrogate on them.

    Attributes:
        inputs: in their units, shape (N, n_inputs).
        reference: true outputs after each input, in their units, shape (N, n_outputs).
        errors: absolute errors, in the outputs' units, shape (N, n_outputs).
        bounds: their bounds at the usual confidence, likewise.
        trusted: where nothing says that outputs may be wrong, (N,).
        first: the first sample that counts.
    """

    inputs: FloatArray
    reference: FloatArray
    errors: FloatArray
    bounds: FloatArray
    trusted: NDArray[np.bool_]
    first: int

    @property
    def drawn(self) -> Draw:
        """The inputs as a trajectory without a burn-in."""
        return Draw(0, 1.0, None, self.inputs, 0)

    @property
    def ratios(self) -> FloatArray:
        """Errors over their bounds, (N, n_outputs); 0 where they do not count or are flagged."""
        ratios_of_trusted = self.errors / self.bounds
        ratios_of_trusted[~self.trusted] = 0.0
        ratios_of_trusted[: self.first] = 0.0
        return ratios_of_trusted

    @property
    def step(self) -> int:
        """The sample with the largest of these ratios."""
        return int(np.argmax(self.ratios.max(axis=1)))

    @property
    def ratio(self) -> float:
        """The largest of these ratios."""
        return float(self.ratios.max())


def measured_inputs(
    surrogate: Surrogate, inputs: FloatArray, reference: FloatArray, first: int
) -> MeasuredInputs:
    """Measure a surrogate with a bound on inputs, (N, n_inputs), and true outputs after each."""
    errors = np.abs(surrogate.predict_newest(inputs) - reference)
    trust = surrogate.trust(inputs)
    return MeasuredInputs(inputs, reference, errors, trust.bounds(), trust.trusted(), first)


def first_measured(surrogate: Surrogate, burn_in: int) -> int:
    """Return the first sample that counts, behind the burn-in, where the bound is filled."""
    assert surrogate.bound is not None
    return max(burn_in, surrogate.bound.filling_length)


@dataclass(frozen=True, eq=False)
class ReferenceRun:
    """A ReferenceRun has the outputs of the reference on inputs, as far as it was simulated.

    Attributes:
        inputs: in their units, shape (N, n_inputs).
        outputs: outputs at the start and after the first M <= N inputs, in their units, shape
            (M + 1, n_outputs).
        states: the states at these samples; empty if the system cannot start from a state.
    """

    inputs: FloatArray
    outputs: FloatArray
    states: tuple[State, ...]


@dataclass(frozen=True, eq=False)
class Target:
    """A Target is a surrogate with a bound, its reference, and a trajectory to start from.

    Attributes:
        surrogate: the one with the bound.
        system: its reference.
        drawn: where the search starts.
        goes_on: whether a run starts where its inputs were changed, and ends when the change is
            forgotten, if the drawn trajectory has an initial state; if not, every trajectory is
            simulated whole.
    """

    surrogate: Surrogate
    system: System
    drawn: Draw
    goes_on: bool = True

    def run(self, inputs: FloatArray) -> ReferenceRun:
        """Run the reference on a whole trajectory, or raise a SimulationError."""
        initial = self.drawn.initial
        if not self.goes_on or initial is None or not isinstance(self.system, Restorable):
            return ReferenceRun(inputs, simulate(self.system, inputs, initial).outputs, ())
        states: list[State] = []
        outputs = simulate(self.system, inputs, initial, states).outputs
        return ReferenceRun(inputs, outputs, tuple(states))

    def run_changed(
        self, parent: ReferenceRun, inputs: FloatArray, changed: slice
    ) -> ReferenceRun:
        """Run the reference on inputs that differ from another run in a range of samples alone.

        Samples later than the window, or than the memory of the bound, have forgotten the change.
        """
        if not parent.states:
            return self.run(inputs)
        assert isinstance(self.system, Restorable)
        first, end = changed.start, changed.stop + self.forgotten_after
        states: list[State] = []
        part = inputs[first:end]
        outputs = simulate(self.system, part, parent.states[first], states).outputs
        return ReferenceRun(
            inputs,
            np.concatenate([parent.outputs[:first], outputs]),
            (*parent.states[:first], *states),
        )

    def worst(self, run: ReferenceRun) -> tuple[float, int]:
        """Return the largest error over its bound where it is trusted, and its sample."""
        inputs = self.measured(run)
        return inputs.ratio, inputs.step

    def measured(self, run: ReferenceRun) -> MeasuredInputs:
        """Measure the surrogate as far as the reference was run."""
        truth = run.outputs[1:]
        return measured_inputs(self.surrogate, run.inputs[: len(truth)], truth, self.first)

    @property
    def first(self) -> int:
        """The first sample that counts."""
        return first_measured(self.surrogate, self.drawn.burn_in)

    @property
    def forgotten_after(self) -> int:
        """The number of samples after which neither outputs nor bounds know a change."""
        assert self.surrogate.bound is not None
        return max(self.surrogate.window.n_in, self.surrogate.bound.filling_length)


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
        measured: the inputs at the end, measured.
    """

    before: float
    measured: MeasuredInputs

    @property
    def after(self) -> float:
        """Largest error over its bound where it is trusted, at the end."""
        return self.measured.ratio


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
    stream = Stream(TEST, seed, (1.0, 1.0), recipe.measured_duration())
    attacks = []
    progress(0, starts)
    for index in range(starts):
        target = _target(surrogate, recipe, system, stream, index)
        attacks.append(search(target, np.random.default_rng((seed, index))))
        progress(index + 1, starts)
    return attacks


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
        child, worse, at = _tried(target, best, inputs, changed)
        if child is not None and worse > ratio:
            best, ratio, step = child, worse, at
            size = min(size * GROWTH, 1.0)
        else:
            size = max(size * SHRINKAGE, LEAST_STEP)
    return _attack(target, best.inputs, before)


def _tried(
    target: Target, parent: ReferenceRun, inputs: FloatArray, changed: slice
) -> tuple[ReferenceRun | None, float, int]:
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
