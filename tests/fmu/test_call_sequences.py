"""Random sequences of legal and illegal calls in both standards, against a plain FMU in Python."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable
from dataclasses import dataclass, replace

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

from slide_fmu.core.signals import FloatArray
from slide_fmu.cosim.check import OUTPUT_TOLERANCE
from slide_fmu.fmu.description.surrogate_variables import fmu_variables
from slide_fmu.fmu.description.variables import IN_RANGE, PREHISTORY_KNOWN
from tests.fmu.any_step import ESTIMATE_TOLERANCE, FORGETFUL
from tests.fmu.callers import Caller, Fmi2, Fmi3
from tests.fmu.native import ERROR, OK, ExportedFmu, Load
from tests.fmu.plain_fmu import INITIALIZATION, STEPPING, TERMINATED, PlainFmu, Plan
from tests.fmu.samples import STEP, Shape, random_surrogate
from tests.marks import every

CUBIC = replace(FORGETFUL, activation="cubic")
SHAPES = {
    "layers": Shape(n_inputs=2, n_outputs=2, activation="cubic", positions=3),
    "ramp": Shape(
        n_inputs=2,
        block=False,
        differences=1,
        activation="cubic",
        positions=2,
        means=True,
        hold="first_order",
    ),
    "cell": Shape(n_inputs=2, n_outputs=2, cell=CUBIC, positions=3),
    "cell, ramp": Shape(n_inputs=2, n_outputs=2, cell=CUBIC, hold="first_order"),
}
"""With cubic units, so that steps can fail: of inputs that are huge, outputs are not finite."""

LENGTHS = [1.0, 1.0, 1.0, 2.0, 0.6, 3.7, 5.0, 15.0]
"""Of communication steps, in sample steps."""

LINEAR = 1e-4
"""Relative, of a sum of derivatives: they are sums in single precision."""

SMALLEST = 1e-30
"""Estimates below it are 0 in one precision and not in another."""

FMI2, FMI3, WATCHED = "FMI 2.0", "FMI 3.0", "FMI 3.0, watched"

lengths = st.sampled_from(LENGTHS)
numbers = st.floats(-2, 3)
pairs = st.tuples(numbers, numbers)
huge = st.tuples(numbers, st.sampled_from([1e30, -1e30]))
unusable = st.tuples(numbers, st.sampled_from([math.nan, math.inf, -math.inf]))
instances = st.sampled_from([FMI2, FMI3, WATCHED])
seldom = st.integers(0, 7).map(lambda drawn: drawn == 7)
seeds = st.integers(0, 1000)
plans = st.builds(
    Plan,
    st.dictionaries(st.integers(1, 5), pairs | pairs | huge, max_size=2),
    st.integers(0, 2),
    st.sampled_from([-1.0, 0.5, 2.5, 3.5, 3.5, 50.0, math.nan]),
)


@dataclass
class Pair:
    """An FMU of the library and the one in Python that it is compared with."""

    caller: Caller
    plain: PlainFmu


class Sequences(RuleBasedStateMachine):
    """Calls to an instance of FMI 2.0 and two of FMI 3.0, of which one has its steps watched;
    states go from one to the other."""

    serialised = Bundle("serialised")
    pointers = Bundle("pointers")

    def __init__(self, loaded: ExportedFmu) -> None:
        super().__init__()
        surrogate = loaded.surrogate
        self.n_inputs, self.n_outputs = len(surrogate.inputs), len(surrogate.outputs)
        names = [variable.name for variable in fmu_variables(surrogate)]
        self.parameters, self.in_range = names.index(PREHISTORY_KNOWN), names.index(IN_RANGE)
        self.filled = names.index("window_filled")
        self.n_names, self.surrogate = len(fmu_variables(surrogate, 3)), surrogate
        self.knowns = range(self.n_inputs)
        self.unknowns = range(self.n_inputs, self.n_inputs + self.n_outputs)
        callers = {FMI2: Fmi2(loaded), FMI3: Fmi3(loaded), WATCHED: Fmi3(loaded, watches=True)}
        self.pairs = {who: Pair(caller, PlainFmu(surrogate)) for who, caller in callers.items()}
        self.states: list[ctypes.c_void_p] = []

    def compare(self, who: str, call: Callable[[Caller], int], expected: int) -> None:
        """A call has the plain FMU's status; what is refused has a message, and no effect."""
        caller = self.pairs[who].caller
        before, said = caller.save(), len(caller.messages)
        status = call(caller)
        assert status == expected, caller.messages[said:]
        if status != OK:
            assert len(caller.messages) > said
            # a step that was begun may leave other bytes in places that no result depends on
            begun = "are not finite; set inputs" in caller.messages[-1]
            assert begun or caller.save() == before

    @rule(
        who=instances,
        time=st.sampled_from([0.0, 0.0, 7.5, -3.0, math.nan]),
        until=st.sampled_from([None, None, 8.0, 40.3, 0.0, -1.0, math.nan]),
    )
    def enter_initialization(self, who: str, time: float, until: float | None) -> None:
        stop = None if until is None else time + until * STEP
        status = self.pairs[who].plain.initialize(time, stop)
        self.compare(who, lambda caller: caller.initialize(time, stop), status)

    @rule(who=instances)
    def exit_initialization(self, who: str) -> None:
        status = self.pairs[who].plain.change_mode(INITIALIZATION, STEPPING)
        self.compare(who, lambda caller: caller.call("ExitInitializationMode"), status)

    @initialize(
        time=st.sampled_from([0.0, 2.0]),
        until=st.sampled_from([None, None, 9.0, 40.3]),
        started=st.booleans(),
        known=st.sampled_from([None, None, 1.0, 2.0]),
        seed=seeds,
    )
    def start(
        self, time: float, until: float | None, started: bool, known: float | None, seed: int
    ) -> None:
        """So that most sequences are about steps."""
        for who, pair in self.pairs.items():
            if known is not None:
                largest = pair.caller.largest_prehistory
                self.set_prehistory(who, min(known, largest), (0.3, -0.2))
                self.set_window(who, seed, "right")
            if started:
                self.enter_initialization(who, time, until)
                self.exit_initialization(who)

    @rule(who=instances, now=seldom)
    def terminate(self, who: str, now: bool) -> None:
        if now:
            status = self.pairs[who].plain.change_mode(STEPPING, TERMINATED)
            self.compare(who, lambda caller: caller.call("Terminate"), status)

    @rule(who=instances, now=seldom)
    def reset(self, who: str, now: bool) -> None:
        if now:
            status = self.pairs[who].plain.reset()
            self.compare(who, lambda caller: caller.call("Reset"), status)

    @rule(who=instances, values=pairs | pairs | huge | unusable)
    def set_inputs(self, who: str, values: tuple[float, float]) -> None:
        status = self.pairs[who].plain.set_inputs(values)
        self.compare(who, lambda caller: caller.set(0, values), status)

    @rule(rates=pairs | pairs | huge | unusable, order=st.sampled_from([1, 1, 1, 2, 0]))
    def set_rates(self, rates: tuple[float, float], order: int) -> None:
        """Of FMI 2.0 only; states with them go to FMI 3.0."""
        pair, in_seconds = self.pairs[FMI2], (rates[0] / (9 * STEP), rates[1] / (9 * STEP))
        assert isinstance(pair.caller, Fmi2)
        setter, status = pair.caller.set_rates, pair.plain.set_rates(in_seconds, order)
        self.compare(FMI2, lambda _: setter(in_seconds, order), status)

    @rule(who=instances, known=st.sampled_from([0.0, 1.0, 1.0, 2.0, 3.0, 0.5]), values=pairs)
    def set_prehistory(self, who: str, known: float, values: tuple[float, float]) -> None:
        pair = self.pairs[who]
        if known == 3.0 and isinstance(pair.caller, Fmi3):
            known = 4.0  # there 3 is the start from outputs, which test_known_start.py has
        row = (known, *values)
        status = pair.plain.set_prehistory(known, values, pair.caller.largest_prehistory)
        self.compare(who, lambda caller: caller.set(self.parameters, row), status)

    @rule(who=instances, seed=seeds, kind=st.sampled_from(["right", "right", "short", "infinite"]))
    def set_window(self, who: str, seed: int, kind: str) -> None:
        pair, size = self.pairs[who], self.surrogate.memory_length
        if not isinstance(pair.caller, Fmi3):
            return
        rows = np.random.default_rng(seed).uniform(-2, 3, (size - (kind == "short"), 2))
        rows[seed % len(rows), 1] *= math.inf if kind == "infinite" else 1.0
        setter, status = pair.caller.set_initial_windows, pair.plain.set_window(rows)
        self.compare(who, lambda _: setter(rows), status)

    @rule(who=instances, reference=st.sampled_from([2, 3, 1000, 2**32 - 1]))
    def set_what_is_no_input(self, who: str, reference: int) -> None:
        self.compare(who, lambda caller: caller.set(reference, (1.0,)), ERROR)

    @rule(who=instances)
    def get_what_is_not_there(self, who: str) -> None:
        self.compare(who, lambda caller: caller.get(self.n_names, 2)[0], ERROR)

    @rule(who=instances)
    def wrong_calls(self, who: str) -> None:
        caller = self.pairs[who].caller
        before, said = caller.save(), len(caller.messages)
        found = caller.wrong_calls()
        assert found == [ERROR] * len(found)
        assert len(caller.messages) == said + len(found)
        assert caller.save() == before

    @rule(
        who=instances,
        steps=st.lists(st.tuples(pairs, lengths), min_size=1, max_size=9),
        move=st.booleans(),
    )
    def step(
        self, who: str, steps: list[tuple[tuple[float, float], float]], move: bool = False
    ) -> None:
        for values, length in steps:
            self.set_inputs(who, values)
            if move and who == FMI2:
                self.set_rates((0.9 / length, -0.9 * values[0] / length), 1)
            self.do_step(who, 0.0, length)
        self.results(who)

    @rule(
        length=st.sampled_from([5.0, 5.0, 3.0, 15.0, 1.0, 0.6]),
        plan=plans,
        values=pairs,
        rates=st.none() | st.none() | pairs,
    )
    def watched_step(
        self,
        length: float,
        plan: Plan,
        values: tuple[float, float],
        rates: tuple[float, float] | None,
    ) -> None:
        """Inputs that are set on the way, and an early end."""
        pair = self.pairs[WATCHED]
        assert isinstance(pair.caller, Fmi3)
        if rates is not None:
            self.hand_over(FMI2, WATCHED, rates)
        self.set_inputs(WATCHED, values)
        time, pair.caller.plan = pair.plain.time, plan
        status = pair.plain.watched_step(time, length * STEP, plan)
        self.compare(WATCHED, lambda caller: caller.do_step(time, length * STEP), status)
        pair.caller.plan = Plan()
        if status == OK:
            assert pair.caller.ended_early == pair.plain.ended_early
        self.results(WATCHED)

    @rule(who=instances, length=lengths, values=huge)
    def step_that_fails(self, who: str, length: float, values: tuple[float, float]) -> None:
        """What was found before stays, to the bit; the step is fine with other inputs."""
        pair = self.pairs[who]
        if not pair.plain.steps:
            return
        before, inputs = self.seen(who), pair.plain.inputs
        self.set_inputs(who, values)
        kept = pair.plain.kept()
        self.do_step(who, 0.0, length)
        if pair.plain == kept:
            assert self.seen(who) == before
        self.set_inputs(who, inputs)

    def seen(self, who: str) -> list[object]:
        """Outputs, estimates, arrays and derivatives."""
        caller = self.pairs[who].caller
        found: list[object] = [caller.get(self.n_inputs, self.filled - self.n_inputs)]
        found += [caller.directional(self.unknowns, self.knowns, e) for e in np.eye(2)]
        if isinstance(caller, Fmi3):
            found.append(caller.output_windows()[1].tolist())
        return found

    @rule(who=instances, values=pairs, weights=st.tuples(st.floats(-1, 1), st.floats(-1, 1)))
    def derivatives(
        self, who: str, values: tuple[float, float], weights: tuple[float, float]
    ) -> None:
        """Linear, and the same of the same state in both standards, to the bit."""
        pair, n_outputs = self.pairs[who], self.n_outputs
        status, seed = pair.plain.results_status(), np.array(values)
        found = pair.caller.directional(self.unknowns, self.knowns, seed)
        assert found[0] == status
        if status != OK:
            return
        columns = [pair.caller.directional(self.unknowns, self.knowns, e) for e in np.eye(2)]
        matrix = np.array([column for _, column in columns]).T
        assert np.all(np.isfinite(matrix))
        allowed = LINEAR * (1 + np.abs(matrix).max())
        np.testing.assert_allclose(found[1], matrix @ seed, LINEAR, allowed)
        state, weight = pair.caller.save(), np.array(weights[:n_outputs])
        for other in self.pairs.values():
            kept = other.caller.save()
            assert other.caller.restore(state) == OK
            assert other.caller.directional(self.unknowns, self.knowns, seed) == found
            if isinstance(other.caller, Fmi3):
                status, row = other.caller.adjoint(self.unknowns, self.knowns, weight)
                assert status == OK
                np.testing.assert_allclose(row, weight @ matrix, LINEAR, allowed)
            assert other.caller.save() == state
            assert other.caller.restore(kept) == OK

    @rule(who=instances, wrong=st.sampled_from(["unknown", "known", "seed"]))
    def derivatives_that_are_refused(self, who: str, wrong: str) -> None:
        unknowns = self.knowns if wrong == "unknown" else self.unknowns
        knowns = self.unknowns if wrong == "known" else self.knowns
        seed = np.full(len(knowns), math.nan if wrong == "seed" else 1.0)
        self.compare(who, lambda caller: caller.directional(unknowns, knowns, seed)[0], ERROR)

    @rule(
        who=instances,
        late=st.sampled_from([0.0, 0.0, 0.0, 1e-8, 0.5, -1.0, math.nan]),
        length=st.sampled_from([*LENGTHS, 0.0, -1.0, math.nan, math.inf]),
    )
    def do_step(self, who: str, late: float, length: float) -> None:
        plain = self.pairs[who].plain
        time = plain.time + late * STEP
        status = plain.do_step(time, length * STEP)
        self.compare(who, lambda caller: caller.do_step(time, length * STEP), status)

    @rule(who=instances)
    def results(self, who: str) -> None:
        """Inputs, outputs, estimates, parts filled and the time."""
        pair = self.pairs[who]
        status, found = pair.caller.get(0, self.parameters + 1 + self.n_inputs)
        assert status == pair.plain.results_status()
        if status != OK:
            return
        outputs, estimates = pair.plain.results()
        last = self.n_inputs + self.n_outputs
        assert tuple(found[: self.n_inputs]) == pair.plain.inputs
        self.close(np.array(found[self.n_inputs : last]), outputs)
        told = any(any(rates) for _, _, rates in pair.plain.steps)
        if estimates is not None and told:  # what became of outputs adds to them
            lowest = (1 - ESTIMATE_TOLERANCE) * estimates - SMALLEST
            assert np.all(np.array(found[last : self.filled]) >= lowest)
        elif estimates is not None:
            np.testing.assert_allclose(
                found[last : self.filled], estimates, ESTIMATE_TOLERANCE, atol=SMALLEST
            )
        filled = pair.plain.filled()
        np.testing.assert_allclose(found[self.filled :][: len(filled)], filled, 1e-9)
        assert found[self.in_range] in (0.0, 1.0)
        parameters = (float(pair.plain.prehistory), *pair.plain.initial)
        assert tuple(found[self.parameters :]) == parameters
        time = pair.caller.time()
        assert time is None or math.isclose(time, pair.plain.time, abs_tol=1e-6 * STEP)
        if isinstance(pair.caller, Fmi3):
            self.arrays(pair.caller, pair.plain)

    def arrays(self, caller: Fmi3, plain: PlainFmu) -> None:
        status, windows = caller.output_windows()
        assert status == OK
        self.close(windows, plain.block())
        status, values = caller.initial_windows(len(plain.window))
        assert (status, values) == (OK, np.array(plain.window).T.ravel().tolist())

    def close(self, found: FloatArray, expected: FloatArray) -> None:
        """Outputs, up to rounding of both, which cubes magnify a little."""
        spans = [signal.high - signal.low for signal in self.surrogate.outputs]
        allowed = OUTPUT_TOLERANCE * np.maximum(spans, np.abs(expected).max())
        assert np.all(np.abs(found - expected) <= 3 * allowed)

    @rule(target=serialised, who=instances)
    def serialise(self, who: str) -> tuple[bytes, PlainFmu]:
        pair = self.pairs[who]
        return pair.caller.save(), pair.plain.kept()

    @rule(who=instances, state=serialised)
    def deserialise(self, who: str, state: tuple[bytes, PlainFmu]) -> None:
        pair = self.pairs[who]
        assert pair.caller.restore(state[0]) == OK
        assert pair.caller.save() == state[0]
        pair.plain.go_back(state[1])

    @rule(giver=instances, taker=instances, rates=st.none() | pairs)
    def hand_over(self, giver: str, taker: str, rates: tuple[float, float] | None) -> None:
        """The state of one instance to another, with derivatives of inputs where it has some."""
        if giver == FMI2 and rates is not None:
            self.set_rates(rates, 1)
        self.deserialise(taker, self.serialise(giver))

    @rule(who=instances, state=serialised, place=st.floats(0, 1, exclude_max=True))
    def deserialise_damaged(self, who: str, state: tuple[bytes, PlainFmu], place: float) -> None:
        damaged = bytearray(state[0])
        damaged[int(place * len(damaged))] ^= 4
        self.compare(who, lambda caller: caller.restore(bytes(damaged)), ERROR)
        self.compare(who, lambda caller: caller.restore(state[0][:-1]), ERROR)

    @rule(target=pointers, who=instances)
    def save(self, who: str) -> tuple[ctypes.c_void_p, PlainFmu]:
        pair, state = self.pairs[who], ctypes.c_void_p()
        assert pair.caller.take_state(state) == OK
        self.states.append(state)
        return state, pair.plain.kept()

    @rule(who=instances, state=pointers)
    def save_again(self, who: str, state: tuple[ctypes.c_void_p, PlainFmu]) -> None:
        pair = self.pairs[who]
        assert pair.caller.take_state(state[0]) == OK
        state[1].go_back(pair.plain)

    @rule(who=instances, state=pointers)
    def go_back(self, who: str, state: tuple[ctypes.c_void_p, PlainFmu]) -> None:
        pair = self.pairs[who]
        assert pair.caller.put_state(state[0]) == OK
        pair.plain.go_back(state[1])

    @rule(who=instances, length=lengths, values=pairs)
    def step_back_and_again(self, who: str, length: float, values: tuple[float, float]) -> None:
        """The same bits, whatever came between."""
        pair = self.pairs[who]
        before, kept = pair.caller.save(), pair.plain.kept()
        after = []
        for others in ((0.1, -0.3), None):
            self.step(who, [(values, length)])
            after.append((pair.caller.get(0, self.parameters), pair.caller.save()))
            if others is not None:
                self.step(who, [(others, 0.6)])
                assert pair.caller.restore(before) == OK
                pair.plain.go_back(kept)
        assert after[0] == after[1]

    def teardown(self) -> None:
        for state in self.states:
            assert self.pairs[FMI2].caller.free_state(state) == OK
            assert state.value is None
        for pair in self.pairs.values():
            pair.caller.free()


@pytest.mark.extended
@pytest.mark.parametrize("shape", every(2, SHAPES.values()), ids=list(SHAPES))
def test_any_sequence_of_calls_gives_what_the_plain_fmu_gives(load: Load, shape: Shape) -> None:
    loaded = load(random_surrogate(shape))
    run_state_machine_as_test(lambda: Sequences(loaded), settings=settings(stateful_step_count=50))
