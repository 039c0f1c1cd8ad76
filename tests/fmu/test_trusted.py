"""The flag ``trusted`` joins error bounds, domain and ranges; tolerances may be set any time."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.description.surrogate_variables import fmu_variables
from slide_fmu.fmu.libraries.platforms import FmiVersion
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.derivatives import derivatives
from tests.fmu.native import DISCARD, OK, Load, Native
from tests.fmu.native3 import Native3, instance_of
from tests.fmu.samples import STEP
from tests.fmu.test_error_bounds import places, read, surrogate_of

COUNT = 200
RNG = np.random.default_rng(8)
INPUTS = RNG.uniform(-0.2, 1.2, (COUNT, 2))


def tolerant(name: str, ranges: bool = True) -> Surrogate:
    """A surrogate whose bounds, domain and output ranges flag some samples each, and not all.

    Args:
        name: one of ``tests.fmu.test_error_bounds.NAMES``.
        ranges: whether the ranges of the outputs are known.
    """
    surrogate = surrogate_of(name)
    bound = surrogate.bound
    assert bound is not None
    inputs = inputs_of(surrogate)
    widened = bound.limits * np.quantile(surrogate.trust(inputs).novelty, 0.8) ** 2
    bounds = surrogate.trust(inputs).bounds() / surrogate.output_scaling.scale
    bound = dataclasses.replace(bound, limits=widened, tolerances=np.quantile(bounds, 0.7, axis=0))
    found = dataclasses.replace(surrogate, bound=bound)
    if not ranges:
        return found
    lowest, highest = np.quantile(found.predict_newest(inputs), [0.05, 0.95], axis=0)
    return dataclasses.replace(found, output_ranges=np.stack([lowest, highest], axis=1))


def inputs_of(surrogate: Surrogate) -> FloatArray:
    """Inputs within the ranges, (COUNT, 2); some samples lie outside of them."""
    scaled = 0.9 * np.clip(2 * INPUTS - 1, -1, 1)
    scaled[60] = 1.3, 0.0
    return surrogate.input_scaling.invert(scaled)


def filled(surrogate: Surrogate) -> NDArray[np.bool_]:
    """At which samples the bound has seen as much as it needs, (COUNT,)."""
    assert surrogate.bound is not None
    return np.arange(1, COUNT + 1) >= surrogate.bound.filling_length


def flags(native: Native | Native3, surrogate: Surrogate, inputs: FloatArray) -> FloatArray:
    """The flag after every step, (N,)."""
    place = places(surrogate, "TRUSTED", 3 if isinstance(native, Native3) else 2)
    found = []
    for k, row in enumerate(inputs):
        assert native.set(*row) == OK
        assert native.do_step(k * STEP) == OK
        found += native.get(*place)
    return np.array(found)


@pytest.mark.parametrize("ranges", [False, True])
@pytest.mark.parametrize("name", ["plain", "gated", "estimated", "span"])
def test_flag_is_that_of_numpy(load: Load, name: str, ranges: bool) -> None:
    surrogate = tolerant(name, ranges)
    inputs = inputs_of(surrogate)
    trust = surrogate.trust(inputs)
    expected = trust.trusted()
    assert 0.1 < expected.mean() < 0.9
    bounds, inside = trust.bounds(), trust.in_domain
    joined = inside & (bounds <= surrogate.error_tolerances).all(axis=1) & filled(surrogate)
    within_ranges = np.ones(COUNT, dtype=bool)
    if ranges:
        within_ranges = surrogate.outputs_in_range(surrogate.predict_newest(inputs))
    assert np.array_equal(expected, joined & within_ranges)
    assert (joined & ~within_ranges).any() == ranges
    assert (inside & ~joined).any()
    loaded = load(surrogate)
    for native in (loaded.instance().start(), instance_of(loaded).start()):
        assert np.array_equal(flags(native, surrogate, inputs), expected)


@pytest.mark.parametrize("name", ["plain", "gated", "estimated", "span"])
def test_bounds_with_floors_are_those_of_numpy_for_every_confidence(load: Load, name: str) -> None:
    """In the domain, too, the disagreement is at times the larger one."""
    surrogate = tolerant(name)
    bound, inputs = surrogate.bound, inputs_of(surrogate)
    assert bound is not None
    assert bound.floors is not None
    factors, floors = 0.2 * bound.factors, 0.1 * bound.floors
    smaller = dataclasses.replace(bound, factors=factors, floors=floors)
    surrogate = dataclasses.replace(surrogate, bound=smaller)
    trust = surrogate.trust(inputs)
    inside = trust.in_domain
    assert bound.shares is not None
    apart = bound.shares * trust.local.disagreement * surrogate.output_scaling.scale
    expected = {c: trust.bounds(c) for c in (0.9, 0.95, 0.99)}
    assert 0 < (expected[0.95] == apart)[inside].mean() < 1
    native = load(surrogate).instance().start()
    (first, count), confidence = (places(surrogate, k) for k in ("ERROR_BOUND", "CONFIDENCE"))
    for k, row in enumerate(inputs):
        native.set(*row)
        assert native.do_step(k * STEP) == OK
        for c, bounds in expected.items():
            native.set(c, first=confidence[0])
            np.testing.assert_allclose(native.get(first, count), bounds[k], rtol=1e-4)


@pytest.mark.parametrize("name", ["plain", "gated", "span"])
def test_flag_waits_until_the_past_is_known(load: Load, name: str) -> None:
    surrogate = tolerant(name, ranges=False)
    bound = surrogate.bound
    assert bound is not None
    assert bound.filling_length > 5
    free = dataclasses.replace(bound, limits=1e9 * bound.limits, tolerances=np.full(2, 1e9))
    surrogate = dataclasses.replace(surrogate, bound=free)
    inputs = np.repeat(surrogate.input_scaling.invert(np.zeros((1, 2))), COUNT, axis=0)
    loaded = load(surrogate)
    first = flags(loaded.instance().start(), surrogate, inputs)
    assert np.array_equal(first, filled(surrogate))
    known = loaded.instance()
    assert known.set(*inputs[0], first=places(surrogate, "INITIAL_INPUT")[0]) == OK
    assert known.set(1.0, first=places(surrogate, "PREHISTORY_KNOWN")[0]) == OK
    assert flags(known.start(), surrogate, inputs).all()


@pytest.mark.parametrize("name", ["plain", "moving", "span"])
def test_reading_the_flag_leaves_what_else_is_read(load: Load, name: str) -> None:
    surrogate = tolerant(name)
    loaded = load(surrogate)
    one, other = loaded.instance().start(), loaded.instance().start()
    flags(one, surrogate, INPUTS[:50])
    for k, row in enumerate(INPUTS[:50]):
        other.set(*row)
        assert other.do_step(k * STEP) == OK
    assert read(one, surrogate) == read(other, surrogate)
    place = places(surrogate, "TRUSTED")
    assert one.get(*place) == other.get(*place)


def test_flag_follows_tolerances_that_are_set_between_steps_and_no_confidence(load: Load) -> None:
    surrogate = tolerant("plain", ranges=False)
    loaded = load(surrogate)
    native, first = loaded.instance().start(), places(surrogate, "ERROR_TOLERANCE")[0]
    trusted, confidence = (places(surrogate, key)[0] for key in ("TRUSTED", "CONFIDENCE"))
    assert native.get(first, 2) == surrogate.error_tolerances.tolist()
    assert surrogate.bound is not None
    inputs, begin = inputs_of(surrogate), surrogate.bound.filling_length - 1
    for k, row in enumerate(inputs[: begin + 50]):
        native.step(*row)
        if k < begin:  # the past is not known
            assert native.get(trusted) == [False]
            continue
        trust = surrogate.trust(inputs[: k + 1])
        bounds, inside = trust.bounds()[-1], trust.in_domain[-1]
        for tolerances in (1.01 * bounds, 0.99 * bounds, bounds * [1.01, 0.99]):
            assert native.set(*tolerances, first=first) == OK
            assert native.get(first, 2) == tolerances.tolist()
            expected = inside and (bounds <= tolerances).all()
            assert native.get(trusted) == [expected]
            assert trust.trusted(tolerances)[-1] == expected
            assert native.set(0.9 + 0.09 * (k % 2), first=confidence) == OK
            assert native.get(trusted) == [expected]


@pytest.mark.parametrize("value", [-1e-9, float("nan"), float("inf")])
def test_tolerance_that_is_no_size_of_an_error_is_refused(load: Load, value: float) -> None:
    surrogate = tolerant("plain")
    two, three = (places(surrogate, "ERROR_TOLERANCE", fmi)[0] for fmi in (2, 3))
    loaded = load(surrogate)
    for native, place in ((loaded.instance(), two), (instance_of(loaded), three)):
        native.start()
        before = native.get(place, 2)
        assert native.set(value, first=place + 1) == DISCARD
        assert "error tolerance (value reference 21000001)" in native.messages[-1]
        assert "expected a finite number that is not negative" in native.messages[-1]
        assert native.get(place, 2) == before
        assert native.set(0.0, first=place + 1) == OK


def test_saved_state_has_the_tolerances_and_a_reset_gives_back_the_first(load: Load) -> None:
    surrogate = tolerant("plain")
    loaded = load(surrogate)
    native, first = loaded.instance().start(), places(surrogate, "ERROR_TOLERANCE")[0]
    trusted, inputs = places(surrogate, "TRUSTED")[0], inputs_of(surrogate)
    native.set(1e9, 1e9, first=first)
    flags(native, surrogate, inputs[:40])
    saved, found = native.save(), native.get(trusted)
    native.set(0.0, 0.0, first=first)
    assert native.get(trusted) == [False]
    assert native.restore(saved) == OK
    assert native.get(first, 2) == [1e9, 1e9]
    assert native.get(trusted) == found
    assert native.call("fmi2Reset") == OK
    native.start()
    assert native.get(first, 2) == surrogate.error_tolerances.tolist()


@pytest.mark.parametrize("fmi", [2, 3])
def test_tolerances_are_parameters_in_the_units_of_the_outputs(fmi: FmiVersion) -> None:
    surrogate = tolerant("plain")
    found = {v.name: v for v in fmu_variables(surrogate, fmi)}
    for signal, tolerance in zip(surrogate.outputs, surrogate.error_tolerances, strict=True):
        variable = found[f"{signal.name}_error_tolerance"]
        assert (variable.unit, variable.low, variable.high) == (signal.unit, 0.0, None)
        assert variable.start == tolerance


@pytest.mark.parametrize("name", ["plain", "moving"])
def test_past_fills_with_the_time_whatever_the_steps_are(load: Load, name: str) -> None:
    surrogate = surrogate_of(name)
    assert surrogate.bound is not None
    count = surrogate.bound.filling_length
    native, found = load(surrogate).instance().start(), []
    lengths = [1.0, 0.5, 0.25, 0.25, 0.1, 0.6, 3.0, 0.37, *[1.0] * count]
    for length in lengths:
        assert native.set(0.5, 0.5) == OK
        assert native.do_step(native.time(), length * STEP) == OK
        found += native.get(*places(surrogate, "BOUND_FILLED"))
    assert found == pytest.approx(np.minimum(np.cumsum(lengths) / count, 1.0))


@pytest.mark.parametrize(("name", "held"), [("plain", True), ("plain", False), ("moving", False)])
def test_inputs_that_change_over_a_longer_step_are_out_of_the_domain(
    load: Load, name: str, held: bool
) -> None:
    """Nobody knows what they did in it, unless they are held; until it has left the window."""
    surrogate = tolerant(name)
    bound, memory = surrogate.bound, surrogate.network.memory_length
    assert bound is not None
    surrogate = dataclasses.replace(
        surrogate, bound=dataclasses.replace(bound, limits=1e9 * bound.limits)
    )
    native = load(surrogate).instance(held=held).start()
    middle = surrogate.input_scaling.offset
    place, count = places(surrogate, "IN_DOMAIN"), bound.filling_length
    inside = []
    lengths = [1.0] * count + [2.0] + [1.0] * (memory + 2)
    for k, length in enumerate(lengths):
        native.set(*(middle + 0.01 * (k > count)))
        assert native.do_step(native.time(), length * STEP) == OK
        inside += native.get(*place)
    doubtful = not held
    expected = [1.0] * len(lengths)
    if doubtful:  # from the step on after which it is known that they changed
        expected[count + 1 : count + 1 + memory] = [0.0] * memory
    assert inside == expected


def test_derivative_after_a_longer_step_leaves_the_domain(load: Load) -> None:
    """It moves the inputs a little, which would count as a change over the step."""
    surrogate = tolerant("moving", ranges=False)
    bound = surrogate.bound
    assert bound is not None
    free = dataclasses.replace(bound, limits=1e9 * bound.limits)
    surrogate = dataclasses.replace(surrogate, bound=free)
    native, place = load(surrogate).instance(held=False).start(), places(surrogate, "IN_DOMAIN")
    middle = surrogate.input_scaling.offset
    for length in (1.0, 2.0, 2.0):
        assert native.set(*middle) == OK
        assert native.do_step(native.time(), length * STEP) == OK
    assert native.get(*place) == [1.0]
    derivatives(native, 2, 2)
    assert native.get(*place) == [1.0]


@pytest.mark.parametrize("jumps", [False, True])
@pytest.mark.parametrize("parts", [1, 4])
@pytest.mark.parametrize("change", [0.07, 0.2, 0.38, 0.6])
def test_moving_input_that_jumps_further_than_in_the_training_is_out_of_the_domain(
    load: Load, jumps: bool, parts: int, change: float
) -> None:
    """A quarter of a step is time for a quarter of the change, unless the training had jumps."""
    surrogate = tolerant("moving", ranges=False)
    bound, forecast = surrogate.bound, surrogate.forecast
    assert bound is not None
    assert forecast is not None
    largest = forecast.largest_change[0]
    surrogate = dataclasses.replace(
        surrogate,
        bound=dataclasses.replace(bound, limits=1e9 * bound.limits),
        forecast=dataclasses.replace(forecast, jumps=jumps),
    )
    native = load(surrogate).instance(held=False).start()
    place, before = places(surrogate, "IN_DOMAIN"), 4 * parts
    after = surrogate.network.memory_length * parts
    inside = []
    for k in range(before + after + 2):
        assert native.set(0.2 + change * (k >= before), 0.5) == OK
        assert native.do_step(native.time(), STEP / parts) == OK
        inside += native.get(*place)
    limit = 1.3 * largest * (1 if jumps else 1 / parts)
    expected = np.ones(len(inside))
    if change > limit:
        expected[before : before + after] = 0
    assert inside == pytest.approx(expected)


def course(kind: str, count: int) -> FloatArray:
    """Values of an input from 0.1 to 0.9, at every step."""
    rng, times = np.random.default_rng(6), np.arange(count)
    smooth = 0.3 * np.sin(0.02 * times)
    jumps = rng.uniform(-0.4, 0.4, count)
    table = 0.0023 * 2 * np.pi * (times[::20] + 1100)
    rising = np.minimum(0.0025 * times, 0.0025 * (count - 40))
    kinds = {
        "sine": smooth,
        "sine with noise": smooth + rng.normal(0, 0.003, count),
        "sine with hum": smooth + 0.006 * np.sin(0.5 * np.pi * times + 0.3),
        "sine with jumps": 0.5 * smooth + 0.2 * (times // 30 % 2),
        "levels": jumps,
        "levels held for three steps": np.repeat(jumps, 3)[:count],
        "level with rounding": 0.3 + rng.normal(0, 1e-15, count),
        "triangle": 0.3 * np.arcsin(np.sin(0.03 * times)),
        "ramp that ends": rising - 0.2,
        "rest with noise": rng.normal(0, 0.003, count),
        "walk": np.clip(np.cumsum(rng.uniform(-0.05, 0.05, count)), -0.4, 0.4),
        "table of a sine": np.interp(times, times[::7], 0.4 * np.sin(0.1 * times[::7])),
        "table of a slow sine": np.interp(times, times[::20], 0.3 * np.sin(table)),
        "sine that repeats each third value": smooth[times - (times % 3 == 2)],
    }
    return 0.5 + kinds[kind]


@pytest.mark.parametrize("parts", [1, 4])
@pytest.mark.parametrize(
    ("kind", "clear"),
    [
        ("sine", True),
        ("sine with noise", False),
        ("sine with hum", False),
        ("sine with jumps", False),
        ("levels", True),
        ("levels held for three steps", True),
        ("level with rounding", True),
        ("triangle", True),
        ("ramp that ends", True),
        ("rest with noise", True),
        ("walk", False),
        ("table of a sine", True),
        ("table of a slow sine", True),
        ("sine that repeats each third value", False),
    ],
)
def test_held_input_that_may_be_smooth_or_not_is_out_of_the_domain(
    load: Load, kind: str, clear: bool, parts: int
) -> None:
    """Unless the importer says that it is held."""
    surrogate = tolerant("plain", ranges=False)
    bound = surrogate.bound
    assert bound is not None
    free = dataclasses.replace(bound, limits=1e9 * bound.limits)
    loaded, place = (
        load(dataclasses.replace(surrogate, bound=free)),
        places(surrogate, "IN_DOMAIN"),
    )
    for held in (False, True):
        native, inside = loaded.instance(held=held).start(), []
        for value in course(kind, 600 if kind in ("walk", "table of a slow sine") else 240):
            assert native.set(value, 0.5) == OK
            assert native.do_step(native.time(), STEP / parts) == OK
            inside += native.get(*place)
        assert all(inside[4:]) == (clear or held)  # before, it has only begun to change


@pytest.mark.parametrize("parts", [1, 4])
def test_held_input_that_begins_to_change_is_in_doubt_until_it_is_known_to_move(
    load: Load, parts: int
) -> None:
    """A first change may be a jump, which is right at once; a fourth one in a row shows a ramp."""
    surrogate = tolerant("plain", ranges=False)
    assert surrogate.bound is not None
    free = dataclasses.replace(surrogate.bound, limits=1e9 * surrogate.bound.limits)
    native = load(dataclasses.replace(surrogate, bound=free)).instance(held=False).start()
    inside, place = [], places(surrogate, "IN_DOMAIN")
    for change in (0, 0, 0, 0, 1, 1, 1, 2, 3, 4, 5, 6, 7, 8, 9):
        assert native.set(0.3 + 0.01 * change, 0.5) == OK
        assert native.do_step(native.time(), STEP / parts) == OK
        inside += native.get(*place)
    assert inside == [1.0] * 8 + [0.0] * 2 + [1.0] * 5
