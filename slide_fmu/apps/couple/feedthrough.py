"""Outputs may follow inputs at the same time: descriptions say it, or short trials show it."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import NDArray

from slide_fmu.apps.couple.component import Component, instance_of, open_component, range_of
from slide_fmu.apps.couple.structure import CoupledSystem, Pin
from slide_fmu.core.signals import FloatArray
from slide_fmu.importer.errors import CoSimulationError, LostError

PART = 1e-3
"""Change of an input, as a part of its range, that shows whether outputs follow it."""

APART, FAR_APART = 16.0, 256.0
"""A step is divided by these numbers to see whether outputs follow inputs at once."""

UNLIKE, CLOSE = 0.01, 1e-9
"""Two steps from one state differ where their ends are apart by more than this part of the motion,
and of the values: solvers may choose their own steps anew."""

AT_ONCE = 0.7
"""Outputs follow inputs at once where this part of their change is left in the shorter step: a
state changes half as much in half the time, or even less."""


def ask_whether_it_follows(system: CoupledSystem, one: Component, values: FloatArray) -> None:
    """Note whether outputs follow inputs at once, as the description or the first values say."""
    linked, courses = set(one.linked), _names_of_courses(system, one)
    by_linked = _declared(one, linked) if linked else False
    by_any = _declared(one, linked | courses) if linked | courses else False
    if by_any is None:
        follows = _at_start(one, 0.0, values, _changes(system, one, values))
        by_linked, by_any = bool(follows[: len(linked)].any()), bool(follows.any())
    one.feeds_through, one.follows = bool(by_linked), bool(by_any)


def try_whether_it_follows(
    system: CoupledSystem, one: Component, values: FloatArray, step: float
) -> None:
    """Note the same by short steps, where the description does not say it.

    An FMU that cannot go back takes them in further instances.
    """
    linked, courses = set(one.linked), _names_of_courses(system, one)
    undeclared = _declared(one, linked | courses) is None
    if not one.outputs or not linked | courses or not undeclared:
        return
    changes = _changes(system, one, values)
    if one.rolls_back:
        follows = _in_steps(one, 0.0, values, changes, step)
    else:
        follows = _in_copies(system, one, values, changes, step)
    one.feeds_through = one.feeds_through or bool(follows[: len(linked)].any())
    one.follows = one.follows or bool(follows.any())


def require_true_states(
    system: CoupledSystem, one: Component, values: FloatArray, step: float
) -> None:
    """Refuse an FMU that does not go back to a former state, although it says that it can.

    A step is taken twice from one state, under moved inputs. FMUs of slide-fmu are not tried.

    Raises:
        CoSimulationError: an output differs at the ends of both steps.
    """
    names = system.names(one.name, "output")  # links or not: the result has them
    if not one.rolls_back or one.ours or not names:
        return
    outputs = one.instance.variables(names)
    changes, length = _changes(system, one, values), one.own_step or step
    inputs = [*one.linked, *_names_of_courses(system, one)]
    state = one.instance.save()
    begin, ends = np.array(outputs.get()), []
    try:
        for _ in range(2):
            one.set_all(values, 0.0, 0 if inputs else None, changes)
            one.step(0.0, length)
            ends.append(np.array(outputs.get()))
            one.instance.restore(state)
    except LostError:
        raise
    except CoSimulationError:  # such a step is refused here, which says nothing about states
        one.instance.restore(state)
        return
    finally:
        one.instance.free_state(state)
    first, second = ends
    moved = np.maximum(np.abs(first - begin), np.abs(second - begin))
    apart = np.abs(first - second)
    wrong = apart > np.maximum(UNLIKE * moved, CLOSE * np.maximum(np.abs(first), np.abs(second)))
    if wrong.any():
        k = int(np.argmax(wrong))
        raise CoSimulationError(
            f"component {one.name!r}: {names[k]} is {first[k]:.6g} after a step, and "
            f"{second[k]:.6g} when its FMU goes back and takes the same step again; expected "
            "equal values: its states leave something out, although canGetAndSetFMUstate is true. "
            "Let its tool save all of its state (PythonFMU: overwrite _get_fmu_state and "
            "_set_fmu_state), or couple explicitly without control"
        )


def _names_of_courses(system: CoupledSystem, one: Component) -> set[str]:
    return {pin.variable for pin in system.courses if pin.component == one.name}


def _changes(system: CoupledSystem, one: Component, values: FloatArray) -> list[float]:
    """Return how much each input is moved to see whether outputs follow it."""
    courses = [pin for pin in system.courses if pin.component == one.name]
    present = [*values.tolist(), *(system.courses[pin](0.0) for pin in courses)]
    pins = [*(Pin(one.name, name) for name in one.linked), *courses]
    sizes = (
        range_of(system.variable(pin)) or abs(value)
        for pin, value in zip(pins, present, strict=True)
    )
    return [PART * size or PART for size in sizes]


def _declared(component: Component, names: Collection[str]) -> bool | None:
    """Return whether a description says that outputs depend on inputs of the same time.

    None if it does not say.
    """
    if component.inputs != "held":
        return True  # an output follows the slope that its inputs had in the step
    known = {
        u.variable.name: u.dependencies
        for u in component.description.outputs
        if u.variable.name in component.outputs
    }
    if len(known) != len(component.outputs) or None in known.values():
        return None
    return any(v.name in names for of_output in known.values() for v in of_output)


def _at_start(
    component: Component, start: float, values: FloatArray, changes: Sequence[float]
) -> NDArray[np.bool_]:
    """Return whether outputs follow each input in initialization mode, (n_linked + n_courses,).

    Args:
        start: time in s.
        values: linked inputs, (n_linked,).
        changes: how much each input is moved.
    """

    def read(index: int | None) -> FloatArray:
        component.set_all(values, start, index, changes)
        return component.read()

    first = read(None)
    follows = [not np.array_equal(read(index), first) for index in range(len(changes))]
    read(None)
    return np.array(follows, dtype=np.bool_)


def _in_steps(
    component: Component, start: float, values: FloatArray, changes: Sequence[float], step: float
) -> NDArray[np.bool_]:
    """Test feedthrough by steps of an FMU that goes back: some compute outputs only there.

    Of two lengths, the shorter one shows nearly the same change where outputs follow at once. An
    FMU that refuses such steps counts as one whose outputs do not.
    """
    own = component.own_step
    lengths = (step / APART, step / FAR_APART) if own is None else (2 * own, own)
    state = component.instance.save()

    def read(length: float, index: int | None) -> FloatArray:
        component.instance.restore(state)
        component.set_all(values, start, index, changes)
        component.step(start, length)
        return component.read()

    follows = []
    try:
        first = [read(length, None) for length in lengths]
        for index in range(len(changes)):
            pairs = zip(lengths, first, strict=True)
            late, soon = (np.abs(read(length, index) - base) for length, base in pairs)
            follows.append(bool(np.any((late > 0) & (soon > AT_ONCE * late))))
    except LostError:
        raise
    except CoSimulationError:
        follows = [False] * len(changes)
    finally:
        component.instance.restore(state)
        component.instance.free_state(state)
    return np.array(follows, dtype=np.bool_)


def _in_copies(
    system: CoupledSystem,
    one: Component,
    values: FloatArray,
    changes: Sequence[float],
    step: float,
) -> NDArray[np.bool_]:
    """Test feedthrough with further instances: one for each input, and one more."""
    none = np.zeros(len(changes), dtype=np.bool_)
    if one.description.coSimulation.canBeInstantiatedOnlyOncePerProcess:
        return none
    try:
        still, *moved = (
            _soon_and_late(system, one, values, (index, changes), step)
            for index in (None, *range(len(changes)))
        )
    except CoSimulationError:  # such steps are refused, or there cannot be more instances
        return none
    pairs = (np.abs(other - still) for other in moved)
    return np.array([bool(np.any((late > 0) & (soon > AT_ONCE * late))) for soon, late in pairs])


def _soon_and_late(
    system: CoupledSystem,
    one: Component,
    values: FloatArray,
    moved: tuple[int | None, Sequence[float]],
    step: float,
) -> FloatArray:
    """Return outputs of a new instance after a short and a longer time, (2, n_outputs).

    An input, by its index, is moved once the instance has begun; ``moved`` has the changes too.
    """
    far, near = step / FAR_APART, step / APART - step / FAR_APART
    lengths = (far, near) if one.own_step is None else (one.own_step,) * 2
    time, outputs = 0.0, []
    with instance_of(system, one.name) as instance:
        copy = open_component(system, one.name, instance, one.inputs, (one.outputs, ()))
        copy.set_linked(values, 0.0)
        copy.begin()
        for length in lengths:
            copy.set_all(values, 0.0, *moved)
            copy.step(time, length)
            outputs.append(copy.read())
            time += length
        instance.terminate()
    return np.array(outputs)
