"""This module simulates whole motions, and checks errors and outputs of the system."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager

import numpy as np

from slide_fmu.core.signals import FloatArray, Trajectory, outside_of_range
from slide_fmu.systems.base import (
    Batching,
    Beginning,
    Bending,
    Jumping,
    Motion,
    Restorable,
    State,
    Stepping,
    System,
    go_on,
    raised,
    read_only,
    real_numbers,
)
from slide_fmu.systems.errors import LoadError, SimulationError

MEMORY = 400_000_000
"""Motions that are simulated at once have inputs and outputs of at most this number of bytes."""


def simulate(
    system: System,
    inputs: FloatArray,
    initial: State | None = None,
    states: list[State] | None = None,
) -> Trajectory:
    """Simulate a system over a whole sequence of inputs.

    Args:
        inputs: shape (N, n_inputs), in the units of ``system.inputs``.
        initial: the state at sample 0, of a system whose states can be set; its own start if None.
        states: gets the N + 1 states, from each of which it can go on, if it begins at one.

    Returns:
        The trajectory: N inputs and N + 1 outputs.

    Raises:
        SimulationError: the solver did not converge, the model raised an error, or gave outputs
            of another shape, or such that are not finite; the message says where.
        ValueError: the inputs have the wrong number of channels, or are not finite.
    """
    _check_inputs(system, inputs)
    with _range_named(system, inputs):
        if initial is None:
            return Trajectory(system.step, inputs, _whole(system, inputs))
        assert isinstance(system, Restorable)
        system.set_state(initial)
        keep = None if states is None else lambda: states.append(system.get_state())
        outputs = go_on(system, read_only(inputs), keep)
        return Trajectory(system.step, inputs, _checked(system, inputs, outputs))


def simulate_between(
    system: System, between: FloatArray, parts: int, initial: State | None = None
) -> FloatArray:
    """Simulate a system under inputs that bend between samples.

    One that does not follow them itself goes on by finer steps.

    Args:
        between: inputs at the ends of the parts of all sample steps, (parts * N, n_inputs).
        parts: number of parts of a sample step.
        initial: the state at sample 0; its own start under the first input if None.

    Returns:
        The outputs at the samples, shape (N + 1, n_outputs).

    Raises:
        LoadError: the system cannot be made with a finer step.
        SimulationError, ValueError: as in ``simulate``.
    """
    if not isinstance(system, Bending):
        if system.finer is None or system.finer.parts != parts:
            raise ValueError(
                f"inputs in {parts} parts of a sample step for a system that is not made for "
                "them; expected that of the recipe by which they were drawn"
            )
        return simulate(system.finer.system, between, initial).outputs[::parts]
    _check_inputs(system, between)
    inputs = between[parts - 1 :: parts]
    with _range_named(system, inputs):
        system.set_state(system.rest_state(between[0]) if initial is None else initial)
        points = read_only(between).reshape(len(inputs), parts, -1)
        outputs = go_on(system, points, advance=system.advance_bending)
        return _checked(system, inputs, outputs)


def simulate_jumping(
    system: System, inputs: FloatArray, jumps: FloatArray, initial: State | None = None
) -> FloatArray:
    """Simulate a system under inputs that jump between samples.

    One that does not follow them itself goes on by finer steps: its inputs jump at the beginning
    of the nearest one. One that simulates whole motions gets a straight line over that step.

    Args:
        inputs: inputs at the ends of the sample steps, (N, n_inputs).
        jumps: part of each sample step after which each input jumps to its value at the step's
            end, from 0 to 1; NaN where it moves linearly. Shape (N, n_inputs).
        initial: the state at sample 0; its own start under the first input if None.

    Returns:
        The outputs at the samples, shape (N + 1, n_outputs).

    Raises:
        LoadError: the system cannot be made with a finer step.
        SimulationError, ValueError: as in ``simulate``.
    """
    _check_inputs(system, inputs)
    if isinstance(system, Bending):
        with _range_named(system, inputs):
            system.set_state(system.rest_state(inputs[0]) if initial is None else initial)
            pairs = read_only(np.stack([inputs, jumps], axis=1))
            outputs = go_on(system, pairs, advance=lambda pair: system.advance_jumping(*pair))
            return _checked(system, inputs, outputs)
    if system.finer is None:
        raise ValueError(
            "inputs that jump within a sample step for a system that is not made for them; "
            "expected that of the recipe by which they were drawn"
        )
    finer, parts = system.finer.system, system.finer.parts
    between, jumped = _in_parts(inputs, jumps, parts)
    if not isinstance(finer, Jumping):
        return simulate(finer, between, initial).outputs[::parts]
    with _range_named(finer, between):
        if initial is None:
            finer.begin(inputs[0])
        else:
            assert isinstance(finer, Restorable)
            finer.set_state(initial)
        places = itertools.count()

        def reached() -> None:
            row = jumped.get(next(places))
            if row is not None:
                finer.jump(row)

        outputs = go_on(finer, read_only(between), reached)
        return _checked(finer, between, outputs)[::parts]


Answer = FloatArray | SimulationError
"""The outputs of a motion at its samples, (N + 1, n_outputs), or why it could not be simulated."""


def simulate_motion(system: System, motion: Motion) -> FloatArray:
    """Simulate one motion; the outputs at its samples, shape (N + 1, n_outputs).

    Raises:
        LoadError: inputs bend or jump, and the system cannot be made with a finer step.
        SimulationError, ValueError: as in ``simulate``.
    """
    if motion.jumps is not None:
        return simulate_jumping(system, motion.inputs, motion.jumps, motion.initial)
    if motion.between is None:
        return simulate(system, motion.inputs, motion.initial).outputs
    parts = len(motion.between) // len(motion.inputs)
    return simulate_between(system, motion.between, parts, motion.initial)


def simulate_motions(
    system: System,
    motions: Sequence[Motion],
    systems: Sequence[System] | None = None,
    varied: Collection[str] = (),
) -> Iterator[Answer]:
    """Simulate motions, many at once where the system offers that; give answers in their order.

    A motion that fails has its error for an answer, and the others lose nothing. Where the system
    does not offer it, a motion is simulated when its answer is asked for.

    Args:
        system: the system.
        motions: perhaps more of them than are simulated at once.
        systems: the system of each motion: the same one with parameters of its own; the system
            itself if None.
        varied: names of the parameters whose values differ from motion to motion.

    Raises:
        LoadError, ValueError: as in ``simulate_motion``.
    """
    systems = [system] * len(motions) if systems is None else systems
    begun = _begun(system, motions, systems, varied)
    for own, motion, beginning in zip(systems, motions, begun, strict=True):
        yield _answer(own, motion, beginning)


def states_along(
    system: Restorable, motions: Sequence[Motion], every: int
) -> Iterator[Sequence[State]]:
    """Simulate motions with inputs that are straight between samples; give states along each.

    They are those at the samples with a multiple of the number ``every``, without the start. Many
    motions are simulated at once where the system offers that, and else when they are asked for.

    Raises:
        SimulationError, ValueError: as in ``simulate``.
    """
    begun = _begun(system, motions, [system] * len(motions), every=every)
    for motion, beginning in zip(motions, begun, strict=True):
        if beginning is not None and len(beginning.outputs) == len(motion.inputs) + 1:
            yield beginning.states
            continue
        states: list[State] = []
        initial = motion.initial or system.rest_state(motion.first_input)
        simulate(system, motion.inputs, initial, states)
        yield states[every::every]


def _begun(
    system: System,
    motions: Sequence[Motion],
    systems: Sequence[System],
    varied: Collection[str] = (),
    every: int | None = None,
) -> Iterator[Beginning | None]:
    """Begin motions together, as many as the system takes at once; None where it takes one."""
    if not motions:
        return
    longest = max(motions, key=lambda motion: len(motion.inputs))
    parts = 1 if longest.between is None else len(longest.between) // len(longest.inputs)
    first = 0
    while first < len(motions):
        count = motions_at_once(system, len(longest.inputs), parts, varied)
        part = slice(first, first + count)
        if count == 1:
            yield None
        else:
            assert isinstance(system, Batching)
            for own, motion in zip(systems[part], motions[part], strict=True):
                _check_inputs(own, motion.inputs)
            yield from system.begin_together(systems[part], motions[part], varied, every)
        first += count


def outputs_of(answer: Answer) -> FloatArray:
    """Return the outputs that are an answer, or raise the error that it is."""
    if isinstance(answer, SimulationError):
        raise answer
    return answer


def motions_at_once(
    system: System, samples: int, parts: int = 1, varied: Collection[str] = ()
) -> int:
    """Give the number of motions that a system simulates at once; 1 for most systems.

    All their inputs, at the samples and at the ends of a number of parts of each sample step, and
    their outputs have room in ``MEMORY``.
    """
    most = system.most_at_once(varied) if isinstance(system, Batching) else 1
    numbers = samples * (len(system.inputs) * (1 + parts) + len(system.outputs))
    return max(1, min(most, MEMORY // (8 * max(1, numbers))))


def _answer(system: System, motion: Motion, beginning: Beginning | None) -> Answer:
    """Simulate a motion, or go on with one to its end."""
    try:
        if beginning is None or beginning.state is None:
            return simulate_motion(system, motion)
        if len(beginning.outputs) == len(motion.inputs) + 1:
            return beginning.outputs
        return _finished(system, motion, beginning.outputs, beginning.state)
    except LoadError:
        raise
    except SimulationError as error:
        return error


def _finished(system: System, motion: Motion, outputs: FloatArray, state: State) -> FloatArray:
    """Go on with a motion from the last sample whose outputs, (k + 1, n_outputs), are known."""
    assert isinstance(system, Bending)
    first, rows = len(outputs) - 1, read_only(motion.inputs)
    advance: Callable[[FloatArray], FloatArray] = system.advance
    if motion.jumps is not None:
        rows = read_only(np.stack([motion.inputs, motion.jumps], axis=1))

        def advance(pair: FloatArray) -> FloatArray:
            return system.advance_jumping(*pair)
    elif motion.between is not None:
        rows = read_only(motion.between).reshape(len(motion.inputs), -1, len(system.inputs))
        advance = system.advance_bending
    with _range_named(system, motion.inputs):
        system.set_state(state)
        further = go_on(system, rows[first:], advance=advance, first=first)
        return _checked(system, motion.inputs, np.concatenate([outputs, further[1:]]))


def _in_parts(
    inputs: FloatArray, jumps: FloatArray, parts: int
) -> tuple[FloatArray, dict[int, FloatArray]]:
    """Return inputs at the ends of the parts of all sample steps, (parts * N, n_inputs).

    With them come the inputs just after each jump, (n_inputs,), by the number of the part that
    begins there.
    """
    last = np.concatenate([inputs[:1], inputs[:-1]])
    part = np.minimum(np.rint(jumps * parts), parts - 1)[:, None]  # NaN stays
    number = np.arange(parts, dtype=np.float64)[None, :, None]
    straight = last[:, None] + (number + 1.0) / parts * (inputs - last)[:, None]
    straight[:, -1] = inputs  # without rounding
    stairs = np.where(number >= part, inputs[:, None], last[:, None])
    ends = np.where(np.isnan(part), straight, stairs)
    between = ends.reshape(-1, inputs.shape[1])
    begins = np.concatenate([inputs[:1], between[:-1]])
    at = np.equal(number, part).reshape(between.shape)
    after = np.where(at, between, begins)
    return between, {int(k): after[k] for k in np.flatnonzero(at.any(axis=1))}


@contextmanager
def _range_named(system: System, inputs: FloatArray) -> Iterator[None]:
    """Name an input outside of its range, if there is one, where the block fails."""
    try:
        yield
    except SimulationError as error:
        k = len(inputs) if error.time is None else round(error.time / system.step) + 1
        at_failure, before = inputs[max(0, k - 2) : k], inputs[:k]
        outside = [outside_of_range(system.inputs, part) for part in (at_failure, before)]
        named = next((text for text in outside if text is not None), None)
        if named is None:
            raise
        raise SimulationError(f"{named}, where the model may fail: {error}", error.time) from error


def _check_inputs(system: System, inputs: FloatArray) -> None:
    """Refuse inputs of the wrong number of channels, or such that are not finite."""
    if inputs.ndim != 2 or inputs.shape[1] != len(system.inputs):
        names = [signal.name for signal in system.inputs]
        raise ValueError(
            f"inputs of shape {inputs.shape}; expected (samples, {len(names)}) for {names}"
        )
    if not np.isfinite(inputs).all():
        k = int(np.argmin(np.isfinite(inputs).all(axis=1)))
        raise ValueError(f"inputs in sample {k}: {inputs[k].tolist()}; expected finite numbers")


def _whole(system: System, inputs: FloatArray) -> FloatArray:
    """Simulate from the system's own start; errors name the sample."""
    try:
        outputs = system.simulate(read_only(inputs))
    except (SimulationError, LoadError):
        raise
    except (Exception, SystemExit) as error:  # a user's method may raise anything, and end
        raise SimulationError(raised(system, "simulate", error)) from error
    return _checked(system, inputs, outputs)


def _checked(system: System, inputs: FloatArray, outputs: object) -> FloatArray:
    """Return outputs as numbers; refuse other shapes, and the first that are not finite."""
    shape, name = (len(inputs) + 1, len(system.outputs)), type(system).__qualname__
    expected = f"expected an array of numbers of shape {shape}: correct the model"
    try:
        values = real_numbers(outputs)
    except (TypeError, ValueError) as error:
        what = f"{name}.simulate gave {type(outputs).__name__} ({error})"
        raise SimulationError(f"{what}; {expected}") from error
    if values.shape != shape:
        raise SimulationError(
            f"{name}.simulate gave an array of shape {values.shape}; expected {shape}: a row for "
            f"the start and one for each of the {len(inputs)} inputs, a column for each output"
        )
    finite = np.isfinite(values).all(axis=1)
    if not finite.all():
        k = int(np.argmin(finite))
        i = int(np.argmin(np.isfinite(values[k])))
        under, signal = inputs[max(0, k - 1)].tolist(), system.outputs[i]
        raise SimulationError(
            f"{name}.{_method(system, k)} gave output {signal.name!r} = {values[k, i]} "
            f"{signal.unit} in sample {k} (t = {k * system.step:.6g} s) under the input {under}; "
            "expected finite numbers: excite it less, choose a smaller step, or "
            "correct the model",
            k * system.step,
        )
    return values


def _method(system: System, sample: int) -> str:
    """Return the method that gave a sample: that of a step where the system defines no other."""
    if isinstance(system, Stepping) and type(system).simulate is Stepping.simulate:
        return "advance" if sample else "output"
    return "simulate"
