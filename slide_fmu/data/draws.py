"""Drawing one trajectory from a recipe: reproducible alone, by stream and index of its seed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slide_fmu.core.signals import FloatArray, Trajectory
from slide_fmu.excitation.mix import choose_kind, draw_inputs
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.systems.base import State, System, simulate

STREAMS = {
    "train": 0,
    "validation": 1,
    "estimator": 2,
    "estimator_validation": 3,
    "beyond": 7,
}
"""Stream of seeds of every split."""

TEST = 4
"""Stream of seeds that no split uses: trajectories that FMUs are measured on."""

PROBE = 5
"""Stream of seeds of the motion by which a changed model is noticed."""
PROBE_SAMPLES = 50

STABILITY = 6
"""Stream of seeds of the inputs under which networks are tested for stability."""


MOST_SAMPLES = 100_000_000
"""Of one trajectory: more than a memory holds, once they are simulated."""


@dataclass(frozen=True, eq=False)
class Draw:
    """What one trajectory starts from and is driven by.

    Attributes:
        kind: index of its excitation in the recipe.
        factor: factor on the excitation's amplitude.
        initial: state at the start of the burn-in.
        inputs: shape (burn_in + N, n_inputs), in the inputs' units.
        burn_in: number of leading samples that are not to be used.
    """

    kind: int
    factor: float
    initial: State
    inputs: FloatArray
    burn_in: int


@dataclass(frozen=True)
class Stream:
    """A stream of trajectory seeds and what its trajectories have in common.

    Attributes:
        number: index of the split in ``SPLITS``, or ``TEST``.
        seed: entropy.
        factors: the amplitude factor is drawn uniformly from this range.
        duration: length of the trajectories in s, without the burn-in.
    """

    number: int
    seed: int
    factors: tuple[float, float]
    duration: float


def split_stream(recipe: Recipe, split: str, index: int) -> Stream:
    """The stream that trajectory ``index`` of a split belongs to.

    More trajectories leave the first ones as they are.
    """
    factors = (1.0, 1.0)
    if recipe.estimator is not None and split.startswith("estimator"):
        beyond = recipe.estimator.draws_beyond(index)
        factors = recipe.estimator.amplitude_factor if beyond else factors
    if split == "beyond":
        factors = recipe.data.beyond_factor
    return Stream(STREAMS[split], recipe.data.seed, factors, recipe.data.duration)


def draw(recipe: Recipe, system: System, stream: Stream, index: int) -> Draw:
    """Draw trajectory ``index`` of a stream; depends on nothing but the arguments.

    Two systems of one recipe get the same inputs, but initial states of their own, which the
    burn-in lets decay.

    Raises:
        ValueError: the stream's trajectories hold no sample, or more than fit into a memory.
    """
    step, duration = recipe.window.step, stream.duration
    if not 0.5 < duration / step < MOST_SAMPLES:
        raise ValueError(
            f"duration = {duration:g} s; expected 1 to {MOST_SAMPLES} samples, {step:g} s apart"
        )
    seeds = np.random.SeedSequence(stream.seed, spawn_key=(stream.number, index))
    rng = np.random.default_rng(seeds)
    burn_in, count = round(recipe.data.burn_in / step), round(duration / step)
    factor = float(rng.uniform(*stream.factors))
    kind = choose_kind(recipe.data.excitation, rng)
    time = step * np.arange(burn_in + count, dtype=np.float64)
    excitation = recipe.data.excitation[kind]
    inputs = draw_inputs(excitation, system.inputs, time, factor, rng)
    return Draw(kind, factor, system.random_state(rng, inputs[0]), inputs, burn_in)


def probe(recipe: Recipe, system: System) -> FloatArray:
    """Outputs of a short motion, (PROBE_SAMPLES + 1, n_outputs): they change with the model.

    Raises:
        SimulationError: the system could not be simulated.
    """
    duration = PROBE_SAMPLES * recipe.window.step
    drawn = draw(recipe, system, Stream(PROBE, recipe.data.seed, (1.0, 1.0), duration), 0)
    return simulate(system, drawn.inputs[:PROBE_SAMPLES], drawn.initial).outputs


def simulate_draw(system: System, drawn: Draw) -> Trajectory:
    """Simulate a drawn trajectory; its burn-in is left out.

    Raises:
        SimulationError: the system could not be simulated.
    """
    trajectory = simulate(system, drawn.inputs, drawn.initial)
    first = drawn.burn_in
    return Trajectory(system.step, trajectory.inputs[first:], trajectory.outputs[first:])
