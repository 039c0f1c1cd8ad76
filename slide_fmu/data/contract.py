"""This module checks a system on a short motion before data are made of it.

The duties of every system are checked first, then each of its offers.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.base import (
    Linearizable,
    Linearization,
    RandomStates,
    Restorable,
    State,
    StateMatrix,
    Stepping,
    System,
    go_on,
)
from slide_fmu.systems.contract import (
    ContractError,
    check_signals,
    check_step,
    class_name,
    contract_error,
)
from slide_fmu.systems.errors import SimulationError
from slide_fmu.systems.simulation import simulate
from slide_fmu.systems.user_code import error_text

SAME = 1e-6
"""Outputs under the same inputs differ by no more than this part of their size."""
ITERATED = 1e-3
"""The same limit for motions from a restored state: an iterative solver ends elsewhere within its
tolerance when it starts from another guess."""
CAUSAL = 1e-3
"""Later inputs change earlier outputs by no more than this part of their size: a solver that
chooses its own steps across samples changes them a little."""

Result = TypeVar("Result")


def check_system(
    system: System, step: float, inputs: FloatArray, model: str | None = None
) -> None:
    """Refuse a system that does not fulfil the contract of systems.

    Args:
        system: the system, made from a recipe.
        step: sample step in s that it was made with.
        inputs: inputs of a short motion, shape (N, n_inputs), of at least four samples.
        model: name of the model in the recipe, at the beginning of messages.

    Raises:
        ContractError: the step or the signals are wrong, outputs are not repeatable or not causal,
            or an offer does not fulfil its contract.
        SimulationError: the system could not be simulated.
    """
    try:
        _check(system, step, inputs)
    except ContractError as error:
        if model is None:
            raise
        raise ContractError(f"system {model!r}: {error}") from error


def _check(system: System, step: float, inputs: FloatArray) -> None:
    check_step(system, step)
    check_signals(system)
    outputs = simulate(system, inputs).outputs
    again = simulate(system, inputs).outputs
    _check_same(system, "simulate", "twice the same inputs", outputs, again)
    _check_causal(system, inputs, outputs)
    if isinstance(system, Stepping):
        _check_steps(system, inputs, outputs)
    if isinstance(system, Restorable):
        _check_states(system, inputs)
    if isinstance(system, RandomStates):
        _check_random(system, inputs)
    if isinstance(system, Linearizable):
        _check_linearization(system, inputs)


def _check_same(
    system: System,
    method: str,
    reason: str,
    one: FloatArray,
    other: FloatArray,
    part: float = SAME,
) -> None:
    """Refuse outputs that should be equal, but differ by more than a part of their size."""
    ranges = np.array([signal.high - signal.low for signal in system.outputs])
    slack = part * np.maximum(np.max(np.abs(one), axis=0, initial=0.0), ranges)
    apart = np.abs(one - other) > slack
    if apart.any():
        k, i = (int(index[0]) for index in np.nonzero(apart))
        raise contract_error(
            system, method, f"gives {one[k, i]:.9g} and {other[k, i]:.9g} for {reason}, of output "
            f"{system.outputs[i].name!r} in sample {k}", "the same", _REMEDIES[method],
        )  # fmt: skip


_START = "start anew in every call, from a state of its own that nothing else changes"
_REMEDIES = {
    "simulate": f"{_START}, and without random numbers",
    "begin": f"{_START}, the one that simulate starts from",
    "set_state": "save and restore everything that the future depends on, the last input too",
    "linearize": "put the state back that was there before",
}


def _check_causal(system: System, inputs: FloatArray, outputs: FloatArray) -> None:
    """Refuse outputs that depend on later inputs."""
    half = len(inputs) // 2
    later = inputs.copy()
    later[half:] = inputs[:1]  # at rest from there on
    changed = simulate(system, later).outputs
    slack = CAUSAL * np.max(np.abs(outputs), axis=0, initial=0.0)
    apart = np.any(np.abs(changed - outputs)[: half + 1] > slack, axis=1)
    if apart.any():
        k = int(np.argmax(apart))
        raise contract_error(
            system, "simulate", f"gives another output in sample {k} where the inputs change from "
            f"inputs[{half}] on", "outputs that follow from earlier inputs alone: outputs[k + 1] "
            "from inputs[: k + 1]", "shift the outputs, and do not filter forwards and backwards",
        )  # fmt: skip


def _check_steps(system: Stepping, inputs: FloatArray, outputs: FloatArray) -> None:
    _call(system, "begin", lambda: system.begin(inputs[0]))
    stepped = go_on(system, inputs)
    reason = "the same inputs, by simulate and step by step"
    _check_same(system, "begin", reason, outputs, stepped)


def _check_states(system: Restorable, inputs: FloatArray) -> None:
    half = len(inputs) // 2
    rest = _call(system, "rest_state", lambda: system.rest_state(inputs[0]))
    _check_state(system, "rest_state", rest)
    system.begin(inputs[0])
    go_on(system, inputs[:half])
    state = _call(system, "get_state", system.get_state)
    _check_state(system, "get_state", state)
    first = go_on(system, inputs[half:])
    _call(system, "set_state", lambda: system.set_state(state))
    again = go_on(system, inputs[half:])
    reason = "what follows a state that was saved and restored"
    _check_same(system, "set_state", reason, first, again, ITERATED)


def _check_random(system: RandomStates, inputs: FloatArray) -> None:
    usual = _shapes(system.get_state())
    rng = np.random.default_rng(0)
    state = _call(system, "random_state", lambda: system.random_state(rng, inputs[0]))
    _check_state(system, "random_state", state)
    if _shapes(state) != usual:
        raise contract_error(
            system, "random_state", f"gives arrays of the shapes {_shapes(state)}",
            f"{usual}, as get_state", "draw every coordinate and velocity",
        )  # fmt: skip
    _call(system, "set_state", lambda: system.set_state(state))
    go_on(system, inputs)


def _check_linearization(system: Linearizable, inputs: FloatArray) -> None:
    system.begin(inputs[0])
    go_on(system, inputs[: len(inputs) // 2])
    state = system.get_state()
    linearized = _call(system, "linearize", lambda: system.linearize(state))
    for name, matrix, shape in _matrices(system, linearized):
        if np.shape(matrix) != shape or not np.isfinite(matrix).all():
            raise contract_error(
                system,
                "linearize",
                f"gives a {name} matrix of shape {np.shape(matrix)}",
                f"finite numbers of shape {shape}",
                "give a row and a column for each coordinate, in the same order everywhere",
            )
    before, now = _parts(state), _parts(system.get_state())
    if not all(np.array_equal(one, other) for one, other in zip(before, now, strict=True)):
        raise contract_error(
            system, "linearize", "changes the current state", "the state as it was",
            _REMEDIES["linearize"],
        )  # fmt: skip


def _matrices(system: System, linearized: object) -> list[tuple[str, FloatArray, tuple[int, ...]]]:
    """Return the matrices of a linearization, with matching shapes."""
    if isinstance(linearized, StateMatrix):
        n = len(linearized.matrix)
        return [("state", linearized.matrix, (n, n))]
    if not isinstance(linearized, Linearization):
        raise contract_error(
            system,
            "linearize",
            f"gives a {type(linearized).__name__}",
            "a Linearization or a StateMatrix",
            "return one of them, from slide_fmu",
        )
    n, rows = len(linearized.mass), len(linearized.constraints)
    named = {name: getattr(linearized, name) for name in ("mass", "damping", "stiffness")}
    square = [(name, matrix, (n, n)) for name, matrix in named.items()]
    return [*square, ("constraints", linearized.constraints, (rows, n))]


def _check_state(system: System, method: str, state: object) -> None:
    if not isinstance(state, State):
        raise contract_error(
            system, method, f"gives a {type(state).__name__}", "a slide_fmu.State", "return one"
        )
    parts = _parts(state)
    right = np.shape(state.last_input) == (len(system.inputs),)
    if not (right and all(np.isfinite(part).all() and np.ndim(part) == 1 for part in parts)):
        raise contract_error(
            system, method, f"gives {state}",
            f"arrays of finite numbers: coordinates, velocities, and a last input of "
            f"{len(system.inputs)}", "give all three as arrays with one axis",
        )  # fmt: skip


def _shapes(state: State) -> list[tuple[int, ...]]:
    return [np.shape(part) for part in _parts(state)]


def _parts(state: State) -> list[FloatArray]:
    return [state.coordinates, state.velocities, state.last_input]


def _call(system: System, method: str, call: Callable[[], Result]) -> Result:
    """Call a method of the user; whatever it raises is named with file and line."""
    try:
        return call()
    except (SimulationError, ContractError):
        raise
    except (Exception, SystemExit) as error:
        raise ContractError(
            f"{class_name(system)}.{method} raised {error_text(error)}; correct it"
        ) from error
