"""Smooth inputs are sums of sines: an FMU and its finest model are measured under them.

The error is measured at several communication steps, for the picture "error against communication
step". Its other line is the finest model itself in the same call: an FMU of it would know its
inputs at communication points alone, and hold them over the step.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import final

import numpy as np

from slide_fmu.core.signals import FloatArray, Signal, within_ranges
from slide_fmu.excitation.kinds import moving_by_themselves
from slide_fmu.recipe.case import Case
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import Motion, System
from slide_fmu.systems.errors import LoadError, SimulationError
from slide_fmu.systems.simulation import simulate_motions
from slide_fmu.validation.calls import (
    CallAnswers,
    ErrorLevels,
    InputsLabel,
    MeasuredMotion,
    row_of,
)
from slide_fmu.validation.input_courses import InputCourse
from slide_fmu.validation.row import SMOOTH, Row
from slide_fmu.validation.task import Task, entropy_of

STEPS = (0.5, 1.0, 2.0, 4.0, 8.0)
"""Numbers of communication steps in the own step, at which the error is drawn."""
SAMPLES = 16
"""A smooth input has at least this many samples in a period."""
DECADES = 1.5
"""Its slowest sine is this many decades below the fastest one."""
TRAJECTORIES, PERIODS, SINES = 4, 4, 3
"""Least number of smooth trajectories, periods of the slowest sine in each, and sines in an input.
The finest model in the place of the FMU is measured on the least number."""
MOST_SAMPLES = 1000
"""The error of holding inputs is measured on so many samples, or a window if that is longer."""
FILLED = 0.9
"""A smooth input fills this part of its declared range at most."""
SEED = 0x5A007
"""Entropy of the sines; no training uses it."""


@final
@dataclass(frozen=True, eq=False)
class Sines:
    """Sines are sums of sines within the declared ranges, as a function of time.

    Attributes:
        signals: the inputs.
        hz: the band of their frequencies.
        index: number of the draw.
        seed: seed of the validation; the same index and seed give the same function.
    """

    signals: tuple[Signal, ...]
    hz: tuple[float, float]
    index: int
    seed: int

    def __call__(self, times: FloatArray) -> FloatArray:
        rng = np.random.default_rng([SEED, self.index, entropy_of(self.seed)])
        low, high = self.hz
        columns = []
        for signal in self.signals:
            places = (np.arange(SINES) + rng.uniform(size=SINES)) / SINES  # slow, middle, fast
            frequency = 2 * np.pi * low * (high / low) ** places
            phase = rng.uniform(-np.pi, np.pi, SINES)
            sines = np.sin(times[:, None] * frequency + phase).mean(axis=1)
            middle, half = (signal.high + signal.low) / 2, (signal.high - signal.low) / 2
            columns.append(middle + FILLED * half * sines)
        return np.stack(columns, axis=1)


@dataclass(frozen=True, eq=False)
class SmoothMotions:
    """SmoothMotions are motions of the reference under smooth inputs, and the system itself.

    Attributes:
        motions: their truth has the fine step of the system.
        system: the reference with this step.
        hz: the band of the inputs.
    """

    motions: tuple[MeasuredMotion, ...]
    system: System
    hz: tuple[float, float]

    @property
    def label(self) -> InputsLabel:
        """Their group and name."""
        return InputsLabel(SMOOTH, f"sums of sines of {self.hz[0]:.2g} to {self.hz[1]:.2g} Hz")


def smooth_motions(surrogate: Surrogate, case: Case, task: Task, each: int) -> SmoothMotions:
    """Simulate the reference at its own fine step under smooth inputs.

    Inputs that each move by themselves are asked for: no angles, and no planned motions. ``each``
    is the number of motions, of which there are some at least.

    Raises:
        LoadError: the reference has no finer step.
        SimulationError: it could not be simulated.
    """
    recipe, times = case.recipe, case.finer_steps
    hz, step, system = band_of(recipe), recipe.window.step, case.reference_as_it_runs()
    burn_in = round(recipe.data.burn_in / step)
    first = max(burn_in + 1, surrogate.network.memory_length)
    count = first + round(min(PERIODS / hz[0], task.duration_of(recipe)) / step)
    motions = []
    every = [Sines(system.inputs, hz, n, task.seed) for n in range(max(TRAJECTORIES, each))]
    truths = fine_truths(system, every, [count * times] * len(every))
    for sines, truth in zip(every, truths, strict=True):
        if isinstance(truth, SimulationError):
            raise truth
        motions.append(MeasuredMotion(sines, truth, step / times, first * step))
    return SmoothMotions(tuple(motions), system, hz)


def model_rows(
    smooth: SmoothMotions, case: Case, outputs: Sequence[Signal], levels: ErrorLevels, own: float
) -> list[Row]:
    """Measure the finest model in the place of the FMU, in the plain call.

    It is simulated at its own fine step, under inputs that it knows at communication points alone
    and holds over each step. Steps shorter than its own are left out.

    Args:
        smooth: the smooth motions.
        case: the case with the model.
        outputs: signals of the outputs.
        levels: which errors are usual.
        own: the surrogate's own step in s.

    Returns:
        The rows; none of a model whose inputs cannot be held over a step.

    Raises:
        SimulationError: the model could not be simulated.
    """
    rows = []
    fine = smooth.motions[0].grid
    least = max(MOST_SAMPLES, case.recipe.window.n_in) * own
    for steps in STEPS:
        held = round(own / steps / fine)
        if not np.isclose(held * fine, own / steps, rtol=1e-6) or held < 1:
            continue
        try:
            system = _holding(smooth.system, case, max(1, round(steps)))
        except (LoadError, ValueError):
            return []
        of_truth, every = round(system.step / fine), []
        chosen = [_beginning(motion, least) for motion in smooth.motions[:TRAJECTORIES]]
        counts = [math.ceil((len(motion.truth) - 1) / of_truth) for motion in chosen]
        starts = [own / steps * np.floor(np.arange(n) * of_truth / held) for n in counts]
        motions = [Motion(m.course(at)) for m, at in zip(chosen, starts, strict=True)]
        answers_of = simulate_motions(system, motions)
        for motion, outputs_of in zip(chosen, answers_of, strict=True):
            if isinstance(outputs_of, SimulationError):
                raise outputs_of
            _, places = motion.points(own / steps)
            outputs_there, counted = outputs_of[places // of_truth], np.full(len(places), True)
            every.append(CallAnswers(outputs_there, motion.truth[places], None, None, counted))
        row = row_of(every, outputs, smooth.label, "model", (own / steps, own), levels)
        rows += [] if row is None else [row]
    return rows


def _beginning(motion: MeasuredMotion, lasts: float) -> MeasuredMotion:
    """Return the beginning of a motion, which lasts for a time in s.

    All of it counts: model and truth begin at the same state of rest.
    """
    return replace(motion, truth=motion.truth[: 1 + round(lasts / motion.grid)], first=0.0)


def _holding(system: System, case: Case, parts: int) -> System:
    """Return a system whose inputs are held over its step, a part of a sample step.

    One that names its own step keeps that.
    """
    if case.reference.own_step is not None:
        return system
    held = all(signal.hold == "zero_order" for signal in system.inputs)
    return case.reference_as_it_runs(None if held else "zero_order", parts)


def fine_truths(
    system: System, courses: Sequence[InputCourse], counts: Sequence[int]
) -> Iterator[FloatArray | SimulationError]:
    """Yield the outputs of a model at its own fine steps, (count + 1, n_outputs) of each course.

    Moving inputs are set to their values at the end of a fine step, held ones to their values in
    its middle; a model that names its own step gets their values at its begin. A course on which
    the model fails has its error instead. Some models simulate all of them at once.
    """
    moving = system.inputs[0].hold == "first_order"
    within = 1.0 if moving else 0.0 if system.own_step is not None else 0.5
    motions = [
        Motion(
            within_ranges(
                system.inputs, course(system.step * (np.arange(count, dtype=np.float64) + within))
            )
        )
        for course, count in zip(courses, counts, strict=True)
    ]
    return simulate_motions(system, motions)


def band_of(recipe: Recipe) -> tuple[float, float]:
    """Return the lowest and the highest frequency of smooth inputs in Hz.

    They have at least ``SAMPLES`` samples in a period and lie in the band in which the excitation
    is as wide as they are.
    """
    high = 1.0 / (SAMPLES * recipe.window.step)
    kinds = moving_by_themselves(recipe.data.excitation)
    wide = [kind for kind in kinds if getattr(kind, "amplitude", (1, 1))[1] >= FILLED / SINES]
    tops = [getattr(kind, "angular_frequency", (0, 0))[1] for kind in wide or kinds]
    if max(tops) > 0:
        high = min(high, max(tops) / (2 * np.pi))
    return high / 10**DECADES, high
