"""Steps follow each other up to the end; where they are controlled, some are halved."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from slide_fmu.apps.couple.component import DiscardedError
from slide_fmu.apps.couple.divergence import EVERY, DivergedError, Limits
from slide_fmu.apps.couple.loop import SMALL, Loop
from slide_fmu.apps.couple.methods import Explicit, Method, Solution
from slide_fmu.apps.couple.rows import RowKeeper, Rows
from slide_fmu.core.progress import Progress
from slide_fmu.core.signals import FloatArray
from slide_fmu.importer.errors import CoSimulationError, LostError

MOST_HALVINGS = 10
"""A step is halved at most this number of times, where no FMU sets a lower limit."""

EASY = 0.1
"""A step is doubled where its error is smaller than this part of the allowed one."""

USUAL, ROUNDED = 0.95, 1000.0
"""Steps are usually wrong by less than this quantile; a motion has at least this number of
roundings."""

TURNS = 8
"""Linked inputs that turned back in each of this number of steps, and grew, zigzag."""


class AcceptedSteps(NamedTuple):
    """AcceptedSteps are the result of all steps of a run.

    Attributes:
        rows: values at the communication points.
        iterations: of each step.
        rejected: number of rejected steps.
        zigzag: words on inputs that zigzag at the end; empty if none do.
        missed: by which part of its motion each linked input was wrong in a step, (n_links,).
    """

    rows: Rows
    iterations: list[int]
    rejected: int
    zigzag: str
    missed: FloatArray


@dataclass(frozen=True)
class Control:
    """A Control says how long steps are.

    Attributes:
        kind: ``"predictor"``, ``"halving"``, or None for steps of one length.
        error: largest allowed error of a step, as a part of the size of a linked input.
        step, stop: longest step and end time in s.
        most: a step is halved at most this number of times.
        limit: name of the component whose steps of one length set this number; empty if none does.
    """

    kind: str | None
    error: float
    step: float
    stop: float
    most: int = MOST_HALVINGS
    limit: str = ""


def run_steps(
    loop: Loop,
    method: Method,
    control: Control,
    progress: Progress,
    keeper: RowKeeper,
    limits: Limits,
) -> AcceptedSteps:
    """Take all steps; the keeper gets a row for each.

    Raises:
        DivergedError: a value left all ranges.
        CoSimulationError: a component cannot go back, which control needs, a step would be too
            short, or iterations of the shortest step do not end.
    """
    if control.kind is not None:
        _require_states(loop)
    count = round(control.stop / control.step)
    keeper.add(0.0, loop.outputs, loop.inputs, loop.watch())
    iterations, rejected, halvings = [], 0, 0
    missed: list[FloatArray] = []
    progress(0, count)
    place, one = 0, 1 << MOST_HALVINGS  # time in parts of the shortest step
    while place < count * one:
        width = one >> halvings
        time, length = place / one * control.step, width / one * control.step
        try:
            solution, error = _controlled(loop, method, control, (time, length))
        except CoSimulationError as failed:
            _require_near(limits, keeper, loop, method)
            words = zigzag(loop, method, keeper.inputs)
            if not words or isinstance(failed, DiscardedError):
                raise
            raise CoSimulationError(f"{failed}; {words}") from failed
        if solution is None:
            rejected, halvings = rejected + 1, halvings + 1
            if halvings > control.most:
                raise _too_short(control, error, time, length)
            continue
        place += width
        iterations += [s.iterations for s in solution]
        missed.append(np.max([np.abs(s.inputs - s.given) for s in solution], axis=0))
        keeper.add(place / one * control.step, loop.outputs, loop.inputs, loop.watch())
        if len(keeper.times) % EVERY == 0:
            _require_near(limits, keeper, loop, method)
        if halvings and error < EASY * control.error and place % (2 * width) == 0:
            halvings -= 1
        if place % one == 0:
            progress(place // one, count)
    _require_near(limits, keeper, loop, method)
    rows, words = keeper.rows(), zigzag(loop, method, keeper.inputs)
    return AcceptedSteps(
        rows, iterations, rejected, words, _parts(loop, rows.inputs, np.array(missed))
    )


def _require_near(limits: Limits, keeper: RowKeeper, loop: Loop, method: Method) -> None:
    """Refuse values that left all ranges, and say whether they went to and fro."""
    try:
        limits.require(keeper)
    except DivergedError as diverged:
        words = zigzag(loop, method, keeper.inputs)
        if not words:
            raise
        raise DivergedError(f"{diverged}; {words}") from diverged


def _too_short(control: Control, error: float, time: float, length: float) -> CoSimulationError:
    """Return the error of a step, time and length in s, that cannot be halved any more."""
    remedy = "choose a shorter step"
    if control.limit:
        remedy = (
            f"make the FMU of {control.limit!r} with a shorter step, since a controlled step is "
            "at least two of its own"
        )
    return CoSimulationError(
        f"step from {time:.9g} s: its error is {error:.3g} with {length:g} s; expected at most "
        f"{control.error:g}: allow more, or {remedy}"
    )


def _parts(loop: Loop, inputs: FloatArray, missed: FloatArray) -> FloatArray:
    """Return what linked inputs were wrong in a step, as parts of their motion so far, (n_links,).

    Nineteen steps in twenty are wrong by less: a jump cannot be foreseen, but is soon over.
    Rounding is no motion.

    Args:
        inputs: linked inputs at the communication points, (N, n_links).
        missed: what they were wrong in each step, (N - 1, n_links).
    """
    moved = np.maximum.accumulate(np.abs(inputs - inputs[0]))[1:]
    least = np.maximum(SMALL * np.abs(inputs[1:]), ROUNDED * loop.rounding)
    motion = np.maximum(moved, least)
    parts = np.divide(missed, motion, out=np.zeros_like(motion), where=motion > 0)
    return np.asarray(np.quantile(parts, USUAL, axis=0))


def zigzag(loop: Loop, method: Method, inputs: Sequence[FloatArray]) -> str:
    """Say which linked inputs went to and fro from step to step in the last steps, and grew.

    Args:
        inputs: linked inputs at the communication points so far, (n_links,) each.
    """
    if len(inputs) <= TURNS + 1 or not len(inputs[0]):
        return ""
    changes = np.diff(np.array(inputs[-TURNS - 2 :]), axis=0)
    signs = np.sign(changes)
    turned = np.all(signs[1:] * signs[:-1] < 0, axis=0)
    sizes = np.abs(changes)
    grew = turned & (sizes[-2:].max(axis=0) > sizes[:2].max(axis=0))
    names = [f"{one.name}.{name}" for one in loop.components for name in one.linked]
    zigzags = [name for name, one in zip(names, grew, strict=True) if one]
    if not zigzags:
        return ""
    description = f"a zigzag: {' and '.join(zigzags)} went to and fro from step to step, and grew"
    if isinstance(method, Explicit):
        return f"{description}; expected a smooth course: take shorter steps or an implicit method"
    return (
        f"{description}, as where the force of a damper moves on a light mass within a step; "
        'expected a smooth course: hold that force (hold = "zero_order" of the input in the model '
        "that takes it), or take shorter steps"
    )


def _controlled(
    loop: Loop, method: Method, control: Control, when: tuple[float, float]
) -> tuple[list[Solution] | None, float]:
    """Take a step, or go back and return None where its error is too large.

    The error is infinite where iterations do not come to an end, which a shorter step may mend.
    """
    time, length = when
    if control.kind is None:
        return [_accept(loop, method, method.step(loop, time, length), when)], 0.0
    begin, states = loop.mark(), loop.save(range(len(loop.components)))
    try:
        try:
            solutions, error = _with_error(loop, method, control, when, states)
        except LostError:
            raise
        except CoSimulationError:  # without an end, or an FMU refuses it
            if length <= control.step / (1 << control.most):
                raise
            solutions, error = [], math.inf
        if error <= control.error:
            return solutions, error
        loop.restore(states)
        loop.go_back(begin)
        return None, error
    finally:
        loop.free(states)


def _with_error(
    loop: Loop,
    method: Method,
    control: Control,
    when: tuple[float, float],
    states: dict[int, object],
) -> tuple[list[Solution], float]:
    """Take a step from saved states, and return its error too."""
    time, length = when
    first = method.step(loop, time, length)
    if control.kind == "predictor" and loop.solved:
        first = _accept(loop, method, first, when)  # inputs at rest so far get their sizes here
        # the shorter the step, the less does it count for states
        error = loop.difference_of(first.inputs, first.guess) * length / control.step
        return [first], error
    loop.restore(states)
    solutions, half = [], 0.5 * length
    for begin in (time, time + half):
        solutions.append(_accept(loop, method, method.step(loop, begin, half), (begin, half)))
    return solutions, loop.difference_of(*_both_ways(loop, first, solutions))


def _accept(loop: Loop, method: Method, solution: Solution, when: tuple[float, float]) -> Solution:
    """Go on to the end of a solved step, and return it; its time and length are in s."""
    time, length = when
    end, before = time + length if method.settles else None, loop.values(loop.outputs)
    loop.accept(solution.stepped, solution.inputs, solution.given, length, end)
    if isinstance(method, Explicit):
        return solution._replace(given=loop.carried(before, solution.stepped))
    return solution


def _both_ways(
    loop: Loop, first: Solution, halves: Sequence[Solution]
) -> tuple[FloatArray, FloatArray]:
    """Return what links carry by a whole step and by two halves, (n_links,) each.

    Where links carry means over a step, these are compared: an output that follows held inputs
    belongs to the middle of each step.
    """
    one, two = halves
    means = [loop.values(solution.stepped.mean) for solution in (first, one, two)]
    ends = [loop.values(solution.stepped.end) for solution in (first, two)]
    of_means = loop.mix.mean == 1.0
    halved = 0.5 * (means[1] + means[2])
    return np.where(of_means, means[0], ends[0]), np.where(of_means, halved, ends[1])


def _require_states(loop: Loop) -> None:
    """Refuse control of steps with a component that cannot go back."""
    for one in loop.components:
        if not one.rolls_back:
            raise CoSimulationError(
                f"component {one.name!r}: its FMU cannot go back to a former state "
                "(canGetAndSetFMUstate); expected that for the control of steps: leave control out"
            )
