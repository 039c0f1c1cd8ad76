"""This module draws a trajectory from a recipe, a stream of seeds and an index alone.

So every trajectory can be made alone, on any machine and in any order, and is always the same.
Streams keep the splits independent of each other.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice
from typing import TypeVar

import numpy as np

from slide_fmu.core.signals import FloatArray, Trajectory, moves, within_ranges
from slide_fmu.data.closed_loop import ClosedLoop, straight
from slide_fmu.excitation.kinds import choose_kind, drawing_kind, names_of
from slide_fmu.excitation.loop import LoopRecipe, Partner
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.systems.base import Motion, RandomStates, State, Stepping, System
from slide_fmu.systems.errors import SimulationError
from slide_fmu.systems.simulation import motions_at_once, simulate_motion

STREAMS = {
    "train": 0,
    "validation": 1,
    "estimator": 2,
    "estimator_validation": 3,
    "beyond": 7,
    "companion": 9,
    "bound": 10,
    "calibration": 11,
    "further": 12,
}
"""Number of the stream of seeds of every split."""

TEST = 4
"""No split uses this stream: it draws the trajectories on which FMUs are measured."""

PROBE = 5
"""This stream draws the short motion by which a changed model is noticed."""

PROBE_SAMPLES = 50
"""The motion by which a changed model is noticed has this many samples."""

PROBE_ATTEMPTS = 5
"""A model that fails on this many such motions does not work."""

PROBE_DRAWS, MOVED = 20, 0.03
"""Number of draws for such motions. Draws in which an input has moved by at least this part of its
range by mid-motion come first, since a changed model may rest at the same outputs."""

BEYOND_ATTEMPTS = 2
"""Number of draws for a trajectory beyond the range; if the system fails on all of them, a draw
within the range takes its place."""

ATTEMPTS = 5
"""Number of draws for one trajectory; a system that fails on all of them cannot be a reference."""

IN_TURN = (STREAMS["bound"], STREAMS["calibration"], TEST)
"""In these streams all kinds of the mix take turns: what is promised and measured of a kind needs
as many trajectories of a rare one as of a frequent one. Others draw the kinds by their weights."""

STRAIGHT = tuple(STREAMS[name] for name in ("train", "validation", "beyond", "companion"))
"""In these streams, from which networks learn, moving inputs never jump. A network sees samples,
so that the time of a jump is noise to it: on average over all times, a jump acts like a straight
line over the step, which teaches the same without the noise."""

SAME_KIND = 2
"""Number of draws of the kind whose turn it is; if the system fails on all of them, any kind takes
its place."""

STABILITY = 6
"""This stream draws the inputs under which networks are tested for stability."""

TOGETHER = 0.5
"""Probability that in the motion of a loop all those act too that have other inputs."""

AT_SAMPLES = 0.5
"""Part of the motions whose jumps come when a sample is taken, as those of a controller with the
clock of the FMU; in the others they come at any time."""

MOST_SAMPLES = 100_000_000
"""A trajectory with this many samples is refused: once simulated it would not fit into memory."""


@dataclass(frozen=True, eq=False)
class Draw:
    """A Draw holds initial state and inputs of one trajectory.

    Attributes:
        kind: index of its excitation in the recipe's mix.
        factor: factor on the excitation's amplitude.
        initial: state of the system at the start of the burn-in; None where the system draws
            none, but begins at its own start.
        inputs: inputs in their units, burn-in first, shape (burn_in + N, n_inputs).
        between: the same inputs at finer times, (parts * (burn_in + N), n_inputs), where they bend
            between samples; every sample is the last of its parts.
        burn_in: number of leading samples in which the initial state decays; they are not used.
        attempt: number of draws before it, on which the system failed.
        jumps: where inputs jump between samples, the part of each step after which each of them
            does, to its value at the step's end, from 0 to 1; NaN where it moves straight. Shape
            (burn_in + N, n_inputs); None where no input jumps.
    """

    kind: int
    factor: float
    initial: State | None
    inputs: FloatArray
    burn_in: int
    attempt: int = 0
    between: FloatArray | None = None
    jumps: FloatArray | None = None

    @property
    def motion(self) -> Motion:
        """What a system is asked to simulate."""
        return Motion(self.inputs, self.initial, self.between, self.jumps)

    @property
    def straight(self) -> bool:
        """Whether the samples say what the inputs are between them."""
        return self.between is None and self.jumps is None


T = TypeVar("T")


@dataclass(frozen=True)
class Stream:
    """A Stream of trajectory seeds describes the common properties of its trajectories.

    Attributes:
        number: one of the values of ``STREAMS``, or ``TEST``, ``PROBE``, ``STABILITY``.
        seed: entropy that all streams of a recipe share.
        factors: range from which the amplitude factor is drawn uniformly.
        duration: length of the trajectories in s, without the burn-in.
    """

    number: int
    seed: int
    factors: tuple[float, float]
    duration: float

    @property
    def beyond(self) -> bool:
        """Whether inputs may leave their ranges, which a recipe must ask for."""
        return self.factors[1] > 1.0

    def kind_of(self, index: int, kinds: int, by_weight: int) -> int:
        """Return the place, of so many, of the kind of trajectory ``index``, from 0.

        It is the one that was drawn by its weight, unless kinds take turns. Then all come once in
        each round, in an order of its own: parameters of a sequence with low discrepancy would
        depend on the kind if the order were always the same.
        """
        if self.number not in IN_TURN:
            return by_weight
        number, place = divmod(index, kinds)
        seeds = np.random.SeedSequence(self.seed, spawn_key=(self.number, number, 0, kinds))
        return int(np.random.default_rng(seeds).permutation(kinds)[place])


def split_stream(recipe: Recipe, split: str, index: int) -> Stream:
    """Return the stream that trajectory ``index`` of a split belongs to.

    The number of trajectories plays no part: a recipe that asks for more keeps the first ones.
    """
    factors = (1.0, 1.0)
    if recipe.estimator is not None and split.startswith("estimator"):
        factors = recipe.estimator.factors(index)
    if split == "beyond":
        factors = recipe.data.beyond_factor
    return Stream(STREAMS[split], recipe.data.seed, factors, recipe.data.duration)


def attempted(stream: Stream, attempt: int) -> Stream:
    """Return the stream of a further attempt at a trajectory of the data.

    Inputs stay in their ranges where the system has failed ``BEYOND_ATTEMPTS`` times beyond.
    """
    left_out = stream.beyond and attempt >= BEYOND_ATTEMPTS
    return replace(stream, factors=(1.0, 1.0)) if left_out else stream


def draw(
    recipe: Recipe,
    system: System,
    stream: Stream,
    index: int,
    attempt: int = 0,
    kind: int | None = None,
) -> Draw:
    """Draw trajectory ``index``, from 0, of a stream; the result depends on the arguments alone.

    The kind of motion is drawn too, unless it has its turn (``IN_TURN``), or its place in the
    recipe's mix is given.

    A further ``attempt`` is another draw, for a trajectory that could not be simulated. Two
    systems of one recipe (a fast model and its reference) get the same inputs, but initial states
    of their own, whose effect decays in the burn-in.

    Raises:
        LoadError: a loop cannot step the system.
        SimulationError: the inputs of a loop leave their ranges, or the system failed in it.
        ValueError: the stream's trajectories hold no sample, or more than fit into memory.
    """
    drawn, rng = _drawn_inputs(recipe, system, stream, index, attempt, True, kind)
    if isinstance(system, RandomStates):
        first = drawn.inputs[0] if drawn.between is None else drawn.between[0]
        return replace(drawn, initial=system.random_state(rng, first))
    return drawn


def draw_inputs(
    recipe: Recipe, system: System, stream: Stream, index: int, attempt: int = 0
) -> Draw:
    """Draw only the inputs of a trajectory; the system is used for its signals, not for a state.

    Loops stay open: their motions have the inputs from outside. Arguments are those of ``draw``.
    """
    return _drawn_inputs(recipe, system, stream, index, attempt, False)[0]


def _drawn_inputs(
    recipe: Recipe,
    system: System,
    stream: Stream,
    index: int,
    attempt: int,
    closed: bool,
    kind: int | None = None,
) -> tuple[Draw, np.random.Generator]:
    step, duration = recipe.window.step, stream.duration
    if not 0.5 < duration / step < MOST_SAMPLES:
        raise ValueError(
            f"duration = {duration:g} s; expected 1 to {MOST_SAMPLES} samples, {step:g} s apart"
        )
    further = (attempt,) if attempt else ()
    seeds = np.random.SeedSequence(stream.seed, spawn_key=(stream.number, index, *further))
    rng = np.random.default_rng(seeds)
    burn_in, count = round(recipe.data.burn_in / step), round(duration / step)
    factor = float(rng.uniform(*stream.factors))
    kinds = recipe.mix()
    if kind is None:
        kind = choose_kind(kinds, rng)
        if attempt < SAME_KIND:
            kind = stream.kind_of(index, len(kinds), kind)
    chosen = kinds[kind]
    outer = drawing_kind(chosen, recipe.data.excitation, rng)
    finest = recipe.data.substeps if moves(system.inputs) else 1
    parts = finest if outer.bends else 1
    # sample k ends part k, and is at the time k * step
    time = step / parts * (np.arange(parts * (burn_in + count), dtype=np.float64) + 1 - parts)
    inputs = outer.inputs(system.inputs, time, factor, rng)
    looped = isinstance(chosen, LoopRecipe) and closed
    jumps = None
    may_jump = recipe.data.jumps and moves(system.inputs) and not looped
    if may_jump and outer.jumps and stream.number not in STRAIGHT:
        at = rng.random(inputs.shape)
        if rng.random() < AT_SAMPLES:
            at = np.ones(inputs.shape)
        jumps = np.where(outer.jumping(inputs), at, np.nan)
    if looped:
        assert isinstance(chosen, LoopRecipe)
        assert isinstance(system, Stepping)  # a case with loops has no other system
        inputs, parts = straight(inputs, finest // parts), finest
        again = partial(outer.inputs, system.inputs, time, factor, rng)
        loops = ClosedLoop(_closed_together(recipe.loop, chosen, len(system.inputs), rng), system)
        inputs = loops.inputs(inputs, parts, max(factor, 1.0), again)
    if factor <= 1.0:  # rounding may put the last digit out of a range, which is a hard limit
        inputs = within_ranges(system.inputs, inputs)
    between = inputs if parts > 1 else None
    samples = inputs[parts - 1 :: parts]
    return Draw(kind, factor, None, samples, burn_in, attempt, between, jumps), rng


def _closed_together(
    loops: Sequence[LoopRecipe], chosen: LoopRecipe, n_inputs: int, rng: np.random.Generator
) -> list[tuple[LoopRecipe, Partner]]:
    """Return the loop of a motion with a partner, and perhaps all those with other inputs too."""
    closed = {chosen.input: chosen}
    others = [loop for loop in loops if loop.input != chosen.input]
    if others and rng.random() < TOGETHER:
        for loop in others:
            closed.setdefault(loop.input, loop)
    alone = len(closed) == n_inputs
    return [(loop, loop.drawn_partner(rng, alone)) for loop in closed.values()]


def first_that_runs(
    recipe: Recipe, system: System, stream: Stream, index: int, run: Callable[[Draw], T]
) -> T:
    """Return the result of ``run`` for trajectory ``index``; if it fails, for another draw.

    Raises:
        SimulationError: it fails on ``ATTEMPTS`` draws; the message names their kinds.
    """
    names, kinds = names_of(recipe.mix()), set()
    for attempt in range(ATTEMPTS):
        try:
            drawn = draw(recipe, system, stream, index, attempt)
            kinds.add(names[drawn.kind])
            return run(drawn)
        except SimulationError as error:
            last = error
    of_kinds = f", of the kinds {sorted(kinds)}," if kinds else ""
    raise SimulationError(
        f"{ATTEMPTS} motions in a row{of_kinds} could not be simulated, the last one: {last}",
        last.time,
    ) from last


def probe(recipe: Recipe, system: System) -> FloatArray:
    """Simulate a short motion of the recipe, whose outputs change when the model changes.

    The outputs are in their units, of the shape (PROBE_SAMPLES + 1, n_outputs). If the system
    fails on a motion, the next one is taken.

    Raises:
        SimulationError: the system could not be simulated on any of them.
    """
    failure = SimulationError("no motion was drawn")
    for drawn in probe_draws(recipe, system):
        try:
            return drawn_outputs(system, drawn)
        except SimulationError as error:
            failure = error
    raise failure


def probe_draws(recipe: Recipe, system: System) -> Iterator[Draw]:
    """Draw ``PROBE_ATTEMPTS`` short motions, first those in which the inputs move.

    Their inputs have the shape (PROBE_SAMPLES, n_inputs); there is no burn-in, and no loop.
    """
    recipe = recipe.without_loops()
    stream = Stream(PROBE, recipe.data.seed, (1.0, 1.0), PROBE_SAMPLES * recipe.window.step)
    return islice(_moving_first(recipe, system, stream), PROBE_ATTEMPTS)


def _moving_first(recipe: Recipe, system: System, stream: Stream) -> Iterator[Draw]:
    others: list[tuple[float, Draw]] = []
    for attempt in range(PROBE_DRAWS):
        drawn = draw(recipe, system, stream, 0, attempt)
        drawn = replace(shortened(drawn, PROBE_SAMPLES), burn_in=0)
        moved = _moved(system, drawn.inputs)
        if moved >= MOVED:
            yield drawn
        else:
            others.append((moved, drawn))
    for _, drawn in sorted(others, key=lambda other: -other[0]):
        yield drawn


def _moved(system: System, inputs: FloatArray) -> float:
    """Return how far an input has moved by mid-motion, relative to its range."""
    ranges = np.array([signal.high - signal.low for signal in system.inputs])
    return float(np.max(np.abs(inputs[len(inputs) // 2] - inputs[0]) / ranges))


def simulate_draw(system: System, drawn: Draw) -> Trajectory:
    """Simulate a drawn trajectory and return its N inputs and N + 1 outputs after the burn-in.

    Raises:
        SimulationError: the system could not be simulated.
    """
    return drawn_trajectory(system, drawn, drawn_outputs(system, drawn))


def drawn_trajectory(system: System, drawn: Draw, outputs: FloatArray) -> Trajectory:
    """Return the trajectory after the burn-in of all outputs, (burn_in + N + 1, n_outputs)."""
    first = drawn.burn_in
    return Trajectory(system.step, drawn.inputs[first:], outputs[first:])


def drawn_outputs(system: System, drawn: Draw) -> FloatArray:
    """Simulate a drawn trajectory; the outputs at its samples, (burn_in + N + 1, n_outputs).

    Where inputs bend or jump between samples, a system may go on by finer steps.

    Raises:
        LoadError: the system cannot be made with a finer step.
        SimulationError: it could not be simulated.
    """
    return simulate_motion(system, drawn.motion)


def drawn_at_once(recipe: Recipe, system: System, duration: float) -> int:
    """Give the number of trajectories of a recipe that its system simulates at once.

    They last a duration in s, without the burn-in. The number is 1 for most systems.
    """
    samples = round((recipe.data.burn_in + duration) / recipe.window.step)
    parts = recipe.data.substeps if moves(system.inputs) else 1
    return motions_at_once(system, samples, parts, recipe.parameters)


def shortened(drawn: Draw, count: int | None) -> Draw:
    """Return a draw of the first ``count`` samples, with straight inputs between samples."""
    return replace(drawn, inputs=drawn.inputs[:count], between=None, jumps=None)
