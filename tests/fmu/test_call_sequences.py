"""Random sequences of legal and illegal calls in both standards, against a plain FMU in Python."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    Bundle,
    RuleBasedStateMachine,
    initialize,
    rule,
    run_state_machine_as_test,
)

from slide_fmu.fmu.check import OUTPUT_TOLERANCE
from slide_fmu.fmu.model_description import fmu_variables
from slide_fmu.fmu.model_description3 import fmu_variables3
from slide_fmu.fmu.variable_names import IN_RANGE, PREHISTORY_KNOWN
from slide_fmu.surrogate import Surrogate

from .callers import Caller, Fmi2, Fmi3
from .native import ERROR, OK, Loaded
from .plain_fmu import INITIALIZATION, STEPPING, TERMINATED, PlainFmu
from .samples import STEP, Shape, random_surrogate
from .test_any_step import ESTIMATE_TOLERANCE, FORGETFUL

SHAPES = {
    "layers": Shape(n_inputs=2, n_outputs=2, activation="elu", positions=3),
    "ramp": Shape(n_inputs=2, block=False, differences=1, positions=2, means=True, hold="ramp"),
    "cell": Shape(n_inputs=2, n_outputs=2, cell=FORGETFUL, positions=3),
}
LENGTHS = [1.0, 1.0, 1.0, 2.0, 0.6, 3.7, 15.0]
"""Of communication steps, in sample steps."""

lengths = st.sampled_from(LENGTHS)
numbers = st.floats(-2, 3)
pairs = st.tuples(numbers, numbers)
unusable = st.tuples(numbers, st.sampled_from([math.nan, math.inf, -math.inf]))
standards = st.sampled_from([2, 3])
seldom = st.integers(0, 7).map(lambda drawn: drawn == 7)


@dataclass
class Pair:
    """An FMU of the library and the one in Python that it is compared with."""

    caller: Caller
    plain: PlainFmu


class Sequences(RuleBasedStateMachine):
    """Calls to one instance of each standard; states go from one to the other."""

    serialised = Bundle("serialised")
    pointers = Bundle("pointers")

    def __init__(self, loaded: Loaded) -> None:
        super().__init__()
        surrogate = loaded.surrogate
        self.n_inputs, self.n_outputs = len(surrogate.inputs), len(surrogate.outputs)
        names = [variable.name for variable in fmu_variables(surrogate)]
        self.parameters, self.in_range = names.index(PREHISTORY_KNOWN), names.index(IN_RANGE)
        self.filled = names.index("window_filled")
        self.n_names, self.surrogate = len(fmu_variables3(surrogate)), surrogate
        time = [variable.name for variable in fmu_variables3(surrogate)].index("time")
        callers: list[Caller] = [Fmi2(loaded), Fmi3(loaded, time)]
        self.pairs = {
            standard: Pair(caller, PlainFmu(surrogate))
            for standard, caller in zip((2, 3), callers, strict=True)
        }
        self.states: list[ctypes.c_void_p] = []

    def compare(self, standard: int, call: Callable[[Caller], int], expected: int) -> None:
        """A call has the plain FMU's status; what is refused has a message, and no effect."""
        caller = self.pairs[standard].caller
        before, said = caller.save(), len(caller.messages)
        status = call(caller)
        assert status == expected, caller.messages[said:]
        if status != OK:
            assert len(caller.messages) > said
            assert caller.save() == before

    @rule(standard=standards, time=st.sampled_from([0.0, 0.0, 7.5, -3.0, math.nan]))
    def enter_initialization(self, standard: int, time: float) -> None:
        status = self.pairs[standard].plain.initialize(time)
        self.compare(standard, lambda caller: caller.initialize(time), status)

    @rule(standard=standards)
    def exit_initialization(self, standard: int) -> None:
        status = self.pairs[standard].plain.change_mode(INITIALIZATION, STEPPING)
        self.compare(standard, lambda caller: caller.call("ExitInitializationMode"), status)

    @initialize(time=st.sampled_from([0.0, 2.0]), started=st.booleans())
    def start(self, time: float, started: bool) -> None:
        """So that most sequences are about steps."""
        for standard in self.pairs:
            if started:
                self.enter_initialization(standard, time)
                self.exit_initialization(standard)

    @rule(standard=standards, now=seldom)
    def terminate(self, standard: int, now: bool) -> None:
        if now:
            status = self.pairs[standard].plain.change_mode(STEPPING, TERMINATED)
            self.compare(standard, lambda caller: caller.call("Terminate"), status)

    @rule(standard=standards, now=seldom)
    def reset(self, standard: int, now: bool) -> None:
        if now:
            status = self.pairs[standard].plain.reset()
            self.compare(standard, lambda caller: caller.call("Reset"), status)

    @rule(standard=standards, values=pairs | pairs | unusable)
    def set_inputs(self, standard: int, values: tuple[float, float]) -> None:
        status = self.pairs[standard].plain.set_inputs(values)
        self.compare(standard, lambda caller: caller.set(0, values), status)

    @rule(standard=standards, known=st.sampled_from([0.0, 1.0, 1.0, 0.5]), values=pairs)
    def set_prehistory(self, standard: int, known: float, values: tuple[float, float]) -> None:
        status = self.pairs[standard].plain.set_prehistory(known, values)
        row = (known, *values)
        self.compare(standard, lambda caller: caller.set(self.parameters, row), status)

    @rule(standard=standards, reference=st.sampled_from([2, 3, 1000, 2**32 - 1]))
    def set_what_is_no_input(self, standard: int, reference: int) -> None:
        self.compare(standard, lambda caller: caller.set(reference, (1.0,)), ERROR)

    @rule(standard=standards)
    def get_what_is_not_there(self, standard: int) -> None:
        self.compare(standard, lambda caller: caller.get(self.n_names, 2)[0], ERROR)

    @rule(standard=standards)
    def wrong_calls(self, standard: int) -> None:
        caller = self.pairs[standard].caller
        before, said = caller.save(), len(caller.messages)
        found = caller.wrong_calls()
        assert found == [ERROR] * len(found)
        assert len(caller.messages) == said + len(found)
        assert caller.save() == before

    @rule(standard=standards, steps=st.lists(st.tuples(pairs, lengths), min_size=1, max_size=9))
    def step(self, standard: int, steps: list[tuple[tuple[float, float], float]]) -> None:
        for values, length in steps:
            self.set_inputs(standard, values)
            self.do_step(standard, 0.0, length)
        self.results(standard)

    @rule(
        standard=standards,
        late=st.sampled_from([0.0, 0.0, 0.0, 1e-8, 0.5, -1.0, math.nan]),
        length=st.sampled_from([*LENGTHS, 0.0, -1.0, math.nan, math.inf]),
    )
    def do_step(self, standard: int, late: float, length: float) -> None:
        plain = self.pairs[standard].plain
        time = plain.time + late * STEP
        status = plain.do_step(time, length * STEP)
        self.compare(standard, lambda caller: caller.do_step(time, length * STEP), status)

    @rule(standard=standards)
    def results(self, standard: int) -> None:
        """Inputs, outputs, estimates, parts filled and the time."""
        pair = self.pairs[standard]
        status, found = pair.caller.get(0, self.parameters + 1 + self.n_inputs)
        assert status == pair.plain.results_status()
        if status != OK:
            return
        outputs, estimates = pair.plain.results()
        last = self.n_inputs + self.n_outputs
        assert tuple(found[: self.n_inputs]) == pair.plain.inputs
        spans = [signal.high - signal.low for signal in self.surrogate.outputs]
        deviation = np.abs(found[self.n_inputs : last] - outputs)
        assert np.all(deviation <= OUTPUT_TOLERANCE * np.array(spans))
        if estimates is not None:
            np.testing.assert_allclose(found[last : self.filled], estimates, ESTIMATE_TOLERANCE)
        filled = pair.plain.filled()
        np.testing.assert_allclose(found[self.filled :][: len(filled)], filled, 1e-9)
        assert found[self.in_range] in (0.0, 1.0)
        parameters = (float(pair.plain.prehistory_known), *pair.plain.initial)
        assert tuple(found[self.parameters :]) == parameters
        time = pair.caller.time()
        assert time is None or math.isclose(time, pair.plain.time, abs_tol=1e-6 * STEP)

    @rule(target=serialised, standard=standards)
    def serialise(self, standard: int) -> tuple[bytes, PlainFmu]:
        pair = self.pairs[standard]
        return pair.caller.save(), pair.plain.kept()

    @rule(standard=standards, state=serialised)
    def deserialise(self, standard: int, state: tuple[bytes, PlainFmu]) -> None:
        pair = self.pairs[standard]
        assert pair.caller.restore(state[0]) == OK
        assert pair.caller.save() == state[0]
        pair.plain.go_back(state[1])

    @rule(standard=standards, state=serialised, place=st.floats(0, 1, exclude_max=True))
    def deserialise_damaged(
        self, standard: int, state: tuple[bytes, PlainFmu], place: float
    ) -> None:
        damaged = bytearray(state[0])
        damaged[int(place * len(damaged))] ^= 4
        self.compare(standard, lambda caller: caller.restore(bytes(damaged)), ERROR)
        self.compare(standard, lambda caller: caller.restore(state[0][:-1]), ERROR)

    @rule(target=pointers, standard=standards)
    def save(self, standard: int) -> tuple[ctypes.c_void_p, PlainFmu]:
        pair, state = self.pairs[standard], ctypes.c_void_p()
        assert pair.caller.take_state(state) == OK
        self.states.append(state)
        return state, pair.plain.kept()

    @rule(standard=standards, state=pointers)
    def save_again(self, standard: int, state: tuple[ctypes.c_void_p, PlainFmu]) -> None:
        pair = self.pairs[standard]
        assert pair.caller.take_state(state[0]) == OK
        state[1].go_back(pair.plain)

    @rule(standard=standards, state=pointers)
    def go_back(self, standard: int, state: tuple[ctypes.c_void_p, PlainFmu]) -> None:
        pair = self.pairs[standard]
        assert pair.caller.put_state(state[0]) == OK
        pair.plain.go_back(state[1])

    @rule(standard=standards, length=lengths, values=pairs)
    def step_back_and_again(
        self, standard: int, length: float, values: tuple[float, float]
    ) -> None:
        """The same bits, whatever came between."""
        pair = self.pairs[standard]
        before, kept = pair.caller.save(), pair.plain.kept()
        after = []
        for others in ((0.1, -0.3), None):
            self.step(standard, [(values, length)])
            after.append((pair.caller.get(0, self.parameters), pair.caller.save()))
            if others is not None:
                self.step(standard, [(others, 0.6)])
                assert pair.caller.restore(before) == OK
                pair.plain.go_back(kept)
        assert after[0] == after[1]

    def teardown(self) -> None:
        for state in self.states:
            assert self.pairs[2].caller.free_state(state) == OK
            assert state.value is None
        for pair in self.pairs.values():
            pair.caller.free()


@pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)
def test_any_sequence_of_calls(load: Callable[[Surrogate], Loaded], shape: Shape) -> None:
    loaded = load(random_surrogate(shape))
    run_state_machine_as_test(
        lambda: Sequences(loaded), settings=settings(max_examples=100, stateful_step_count=50)
    )
