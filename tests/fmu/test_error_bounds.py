"""Error bounds and novelty are found when they are read: the same whenever and however often."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.description.surrogate_variables import fmu_variables
from slide_fmu.fmu.export import read_fmu
from slide_fmu.fmu.libraries.platforms import FmiVersion
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.surrogate.bound_statistics import statistics_of
from slide_fmu.surrogate.surrogate import Surrogate
from tests.bounded import bounded_surrogate, with_span
from tests.fmu.any_step import outputs_and_some
from tests.fmu.moving_inputs import MovingOracle
from tests.fmu.native import DISCARD, ERROR, OK, Load, Native
from tests.fmu.native3 import instance_of
from tests.fmu.plain import UNSETTLED, doubted, spread
from tests.fmu.samples import STEP, CellShape, Shape, sum_surrogate
from tests.fmu.test_estimates import PATTERNS
from tests.marks import essential

PLAIN = Shape(
    n_in=9, n_out=4, n_inputs=2, n_outputs=2, differences=1, cell=CellShape(contraction=0.9)
)
SHAPES = {
    "plain": PLAIN,
    "estimated": dataclasses.replace(PLAIN, positions=3, hold="first_order"),
    "forecast": dataclasses.replace(PLAIN, differences=0, hold="first_order", forecasts=True),
    "moving": dataclasses.replace(PLAIN, hold="first_order", forecasts=True),
    "gated": dataclasses.replace(
        PLAIN, features="chain", cell=CellShape(5, 9, "gated", turned=2, factors=1)
    ),
    "roles": dataclasses.replace(
        PLAIN, differences=2, n_out=1, cell=CellShape(9, 4, "cubic", roles=True, factors=1)
    ),
    "substeps": dataclasses.replace(PLAIN, cell=CellShape(2, 3, "mixed", substeps=3)),
}
OF_NETWORKS = {
    "seen_forecast": "forecast",
    "span": "plain",
    "span_forecast": "forecast",
    "span_moving": "moving",
    "span_gated": "gated",
}
"""Shapes of surrogates that get an error estimator, and of others whose bound gives the error
estimate."""

NAMES = (*SHAPES, *OF_NETWORKS)
CRANK = Path(__file__).parents[2] / "fmus" / "slider_crank" / "slider_crank.fmu"
DUFFING = Path(__file__).parents[2] / "fmus" / "duffing" / "duffing.fmu"
BLOCKS = (2, 5)
TOLERANCE = 1e-4

"""Of bounds and novelty, relative to themselves: logarithms magnify rounding where surrogate and
companion nearly agree."""

KINDS = ("ERROR_BOUND", "NOVELTY", "IN_DOMAIN", "BOUND_FILLED")


def surrogate_of(
    name: str, blocks: tuple[int, int] = BLOCKS, cell: CellShape | None = None
) -> Surrogate:
    """A random surrogate with an error bound, by one of the ``NAMES``; or with another cell."""
    shape = SHAPES[OF_NETWORKS.get(name, name)]
    shape = shape if cell is None else dataclasses.replace(shape, cell=cell)
    if name.startswith("seen"):
        return bounded_surrogate(dataclasses.replace(shape, positions=3), blocks)
    surrogate = bounded_surrogate(shape, blocks)
    return with_span(surrogate) if name.startswith("span") else surrogate


def places(surrogate: Surrogate, key: str, fmi: FmiVersion = 2) -> tuple[int, int]:
    """The first place of a kind of variables, and how many there are."""
    found = [i for i, v in enumerate(fmu_variables(surrogate, fmi)) if v.kind.key == key]
    return found[0], len(found)


def read(native: Native, surrogate: Surrogate) -> list[float]:
    """Bounds of all outputs, novelty, whether it is in the domain, and error estimates, if any."""
    estimates = ["ERROR_ESTIMATE"] if surrogate.estimates_errors else []
    keys = [*KINDS[:3], *estimates]
    return [value for key in keys for value in native.get(*places(surrogate, key))]


def go(
    native: Native, surrogate: Surrogate, lengths: Iterable[float], reads: Callable[[int], bool]
) -> tuple[FloatArray, dict[int, list[float]]]:
    """Steps under made-up inputs: all outputs, and what is read where it is read."""
    return outputs_and_some(native, lengths, reads, lambda: read(native, surrogate))


def within(found: object, expected: object) -> None:
    np.testing.assert_allclose(found, expected, rtol=TOLERANCE)


@pytest.mark.parametrize("pattern", essential(PATTERNS, "odd"))
@pytest.mark.parametrize("name", NAMES)
def test_bounds_are_the_same_whenever_they_are_read(load: Load, name: str, pattern: str) -> None:
    surrogate, lengths = surrogate_of(name), PATTERNS[pattern]
    loaded, last = load(surrogate), len(lengths) - 1
    expected, eager = go(loaded.instance().start(), surrogate, lengths, lambda k: True)
    assert len({tuple(row) for row in eager.values()}) > 1
    for reads in (
        lambda k: k == last,
        lambda k: k % 7 == 0,
        lambda k: k % 45 == 3,
        lambda k: 40 <= k < 70,
        lambda k: False,
    ):
        outputs, found = go(loaded.instance().start(), surrogate, lengths, reads)
        assert np.array_equal(outputs, expected)
        assert found == {k: eager[k] for k in found}


@pytest.mark.parametrize("name", ["seen_forecast", "forecast", "span_moving", "moving"])
def test_steps_that_fail_change_no_bound(load: Load, name: str) -> None:
    """Cubes of one fail by what was set, of the next by where its derivatives say it goes."""
    surrogate = surrogate_of(name, cell=CellShape(activation="cubic", contraction=0.9))
    loaded, inputs = load(surrogate), np.random.default_rng(9).uniform(-2, 3, (40, 2))

    def seen(fails: bool) -> list[list[float]]:
        native, found = loaded.instance().start(), []
        for k, row in enumerate(inputs):
            tried = ((np.full(2, 3e38), 0.1), (row, 3e38)) if fails and k > 0 else ()
            for values, rate in tried:
                assert native.set(*values) == native.set_rates(rate, rate) == OK
                assert native.do_step(native.time(), (1 + k % 2) * STEP) == ERROR
            found += [read(native, surrogate)] if k % 3 == 1 else []
            assert native.set(*row) == native.set_rates(0.1, -0.1) == OK
            assert native.do_step(native.time(), (1 + k % 3) * STEP) == OK, native.messages
            found += [native.get(2, 2), read(native, surrogate)] if k % 5 == 0 else []
        return found

    assert seen(fails=True) == seen(fails=False)


@pytest.mark.parametrize(
    "blocks",
    [(3, 7), (1, 1), *(pytest.param(b, marks=pytest.mark.extended) for b in [(1, 4), (4, 5)])],
)
@pytest.mark.parametrize(
    "name",
    ["plain", "estimated", "gated", "roles", "substeps", "span", "span_gated"],
)
def test_bounds_are_those_of_numpy(load: Load, name: str, blocks: tuple[int, int]) -> None:
    surrogate = surrogate_of(name, blocks)
    native = load(surrogate).instance().start()
    inputs = np.random.default_rng(5).uniform(-1, 2, (150, 2))
    found = []
    for row in inputs:
        native.step(*row)
        results = read(native, surrogate)
        filled = native.get(*places(surrogate, "BOUND_FILLED"))
        found.append([*results[:4], *filled, *results[4:]])
    bounds, novelty, inside, filled, estimates = np.split(np.array(found), [2, 3, 4, 5], axis=1)
    trust = surrogate.trust(inputs)
    within(bounds, trust.bounds())
    within(novelty[:, 0], trust.novelty)
    assert np.array_equal(inside[:, 0], trust.in_domain)
    assert surrogate.bound is not None
    share = np.minimum(1, np.arange(1, 151) / surrogate.bound.filling_length)
    np.testing.assert_allclose(filled[:, 0], share, rtol=1e-12)
    if surrogate.estimates_errors:
        within(estimates, surrogate.estimate_error(inputs))


@pytest.mark.parametrize("blocks", [(1, 1), (3, 7)])
def test_bound_of_forecast_inputs_adds_what_forecasts_changed(
    load: Load, blocks: tuple[int, int]
) -> None:
    """To the bound of a record that ends with the forecast, in squares."""
    surrogate = surrogate_of("moving", blocks)
    native, oracle = load(surrogate).instance().start(), MovingOracle(surrogate)
    records = surrogate.input_scaling.invert(smooth_record(90))
    scale, lately, given = surrogate.output_scaling.scale, np.zeros(2), np.zeros(2)
    found, expected, without = [], [], []
    for k, row in enumerate(records):
        native.step(*row)
        found.append(native.get(*places(surrogate, "ERROR_BOUND")))
        if k > 0:
            known = surrogate.predict_newest(records[: k + 1])[-1]
            lately += (((known - given) / scale) ** 2 - lately) / 16
        goal = oracle.step(STEP, row).goal
        ends = np.vstack([records[: k + 1], goal])
        given = surrogate.predict_newest(ends)[-1]
        without.append(surrogate.trust(ends).bounds()[-1])
        expected.append(np.hypot(without[-1], 2.0 * np.sqrt(lately) * scale))
    np.testing.assert_allclose(found, expected, rtol=10 * TOLERANCE)
    assert not np.allclose(found, without, rtol=0.01)


def test_bound_knows_of_a_kink_at_the_next_call(load: Load) -> None:
    """Not a sample later, when the phase in which the forecast was wrong comes again."""
    surrogate, parts = read_fmu(CRANK)[0], 4
    native, found = load(surrogate).instance().start(), []
    times = surrogate.window.step / parts * np.arange(2000)
    turned = np.sin(0.3 * times) + 1.5 * np.maximum(times - times[1900], 0)
    for angle in turned[:1903]:
        assert native.set(np.cos(angle), np.sin(angle)) == OK
        assert native.do_step(native.time(), surrogate.window.step / parts) == OK
        found += native.get(*places(surrogate, "ERROR_BOUND"))
    assert found[1901] > 4 * found[1900]


def test_bound_grows_where_held_inputs_change_within_a_sample(load: Load) -> None:
    """Their mean counts, which comes at another time: steps of h / 2, and a force for each h."""
    surrogate = read_fmu(DUFFING)[0]
    step, forces = surrogate.window.step, np.random.default_rng(5).uniform(-900, 900, 500)
    native, found = load(surrogate).instance().start(), []
    for force in forces.repeat(2):
        assert native.set(force) == native.do_step(native.time(), step / 2) == OK
        found += native.get(*places(surrogate, "ERROR_BOUND"))
    bounds = np.array(found)[800:]
    whole, changed = bounds[1::2], bounds[::2]
    assert np.median(changed) > 20 * np.median(whole)


def smooth_record(count: int) -> FloatArray:
    """Scaled inputs that are forecast well at first, and hardly at all afterwards, (count, 2)."""
    time, rng = np.arange(count)[:, None], np.random.default_rng(2)
    rough = np.where(time > count // 2, rng.uniform(-0.4, 0.4, (count, 2)), 0.0)
    return np.asarray(0.4 * np.sin(time * np.array([0.2, 0.33])) + rough)


def test_estimate_of_a_bound_counts_once_it_knows_its_inputs(load: Load) -> None:
    surrogate = surrogate_of("span")
    native, found = load(surrogate).instance().start(), []
    for _ in range(150):
        native.step(0.5, 0.5)
        found += native.get(*places(surrogate, "ESTIMATE_FILLED"))
    assert surrogate.bound is not None
    share = np.minimum(1, np.arange(1, 151) / surrogate.bound.estimate_length)
    np.testing.assert_allclose(found, share, rtol=1e-12)
    assert share[0] < share[-1] == 1


def test_in_domain_needs_known_inputs_in_their_ranges(load: Load) -> None:
    surrogate = bounded_surrogate(PLAIN, BLOCKS)
    assert surrogate.bound is not None
    bound = dataclasses.replace(surrogate.bound, limits=4 * surrogate.bound.limits)
    surrogate = dataclasses.replace(surrogate, bound=bound)
    native = load(surrogate).instance().start()
    scaling, found = surrogate.input_scaling, []
    inputs = scaling.invert(np.random.default_rng(1).uniform(-0.9, 0.9, (150, 2)))
    inputs[40] = scaling.invert(np.array([1.1, 0.0]))
    for row in inputs:
        native.step(*row)
        found += native.get(*places(surrogate, "IN_DOMAIN"))
    trust = surrogate.trust(inputs)
    expected = trust.in_domain
    assert found == expected.tolist()
    strayed = ~surrogate.inputs_in_range(inputs)
    assert strayed.any()
    assert (trust.novelty[strayed] <= 1).any()
    assert expected.any()


def test_bound_is_at_least_a_share_of_the_disagreement(load: Load) -> None:
    surrogate = bounded_surrogate(PLAIN, BLOCKS)
    bound = surrogate.bound
    assert bound is not None
    tight = dataclasses.replace(
        bound,
        factors=1e-6 * bound.factors,
        floors=1e-6 * bound.floors,
        limits=2 * bound.limits,  # some of the samples are in the domain
    )
    surrogate = dataclasses.replace(surrogate, bound=tight)
    native, found = load(surrogate).instance().start(), []
    inputs = np.random.default_rng(1).uniform(-1, 2, (60, 2))
    for row in inputs:
        native.step(*row)
        found.append(native.get(*places(surrogate, "ERROR_BOUND")))
    trust = surrogate.trust(inputs)
    far = np.clip(trust.novelty, 1, 6)[:, None]  # outside of the domain, the share is larger
    assert far.min() == 1
    assert far.max() > 1
    within(found, far * bound.shares * trust.local.disagreement * surrogate.output_scaling.scale)


def test_disagreements_that_the_predictor_cannot_have_are_left_out(load: Load) -> None:
    """After a step that is no multiple of h, all samples are others; the predictor sees n_in."""
    surrogate = bounded_surrogate(PLAIN, BLOCKS)
    bound, window = surrogate.bound, surrogate.window
    assert bound is not None
    native = load(surrogate).instance().start()
    rows = np.random.default_rng(3).uniform(-1, 2, (90, 2))
    for row in rows:
        native.step(*row)
    native.set(*rows[-1])  # the half step goes on with the last input
    assert native.do_step(native.time(), STEP / 2) == OK
    count = surrogate.memory_length + UNSETTLED
    ages = np.clip(np.arange(count, -1, -1), 1, 90)
    means = (rows[-ages[:-1]] + rows[-ages[1:]]) / 2  # each begins half a step later
    late = (rows[-ages[1:]] - rows[-ages[:-1]]) / 8
    moments = np.stack([late, 0 * late, late / 8], axis=1)
    moments = np.concatenate([0 * moments[:1], moments])
    taken = spread(means, moments)
    scaled, others = (
        surrogate.input_scaling.apply(np.concatenate([some[:1], some]))[None]
        for some in (taken, taken + bound.doubt * doubted(means, moments))
    )
    network = surrogate.network
    assert isinstance(network, StateSpace)
    features = network.features.along(scaled)[:, -window.n_in :]
    of_surrogate = network.run(features)[0][0, -window.n_out :].astype(float)
    of_companion = bound.companion.stream(others)[0, -window.n_out :].astype(float)
    squares = (of_surrogate - of_companion) ** 2
    _, watched, _ = statistics_of(
        (bound.companion, None), bound.blocks, others, np.zeros((1, count + 1, 2))
    )
    means = np.concatenate([squares.mean(axis=0), squares.mean(axis=0), watched[0, -1, 4:]])
    within(native.get(*places(surrogate, "NOVELTY")), [np.sqrt((means / bound.limits).max())])


def test_expected_errors_of_samples_without_a_prediction_are_left_out(load: Load) -> None:
    """Where an input rests, an estimate is the same over the output window as over its span."""
    shape = dataclasses.replace(PLAIN, cell=CellShape(contraction=0.1))
    surrogate = with_span(bounded_surrogate(shape, BLOCKS), 40)
    assert surrogate.estimated_samples > surrogate.window.n_out
    native, found = load(surrogate).instance().start(), []
    for _ in range(500):
        native.step(0.7, 1.5)
    for length in (1.0, 0.5):  # of a half step, the predictor sees its own part alone
        assert native.do_step(native.time(), length * STEP) == OK
        found.append(native.get(*places(surrogate, "ERROR_ESTIMATE")))
    np.testing.assert_allclose(found[1], found[0], rtol=1e-3)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("read_before", [False, True])
def test_bounds_due_when_a_state_is_saved_are_due_after_it_is_restored(
    load: Load, name: str, read_before: bool
) -> None:
    surrogate = surrogate_of(name)
    loaded = load(surrogate)
    one, other = loaded.instance().start(), loaded.instance().start()
    go(other, surrogate, [1, 0.3, 7, 1], lambda k: k == 2)  # what it remembers must not matter
    for lengths in ([1.0] * 9, [0.6] * 3, [1.0] * 80, [2, 1.5, 1], [100.0]):
        go(one, surrogate, lengths, lambda k: read_before and k == 0)
        saved = one.save()
        found = read(one, surrogate)
        assert other.restore(saved) == OK
        assert read(other, surrogate) == found
        assert one.restore(saved) == OK
        assert read(one, surrogate) == found
        assert other.restore(saved) == OK
        ahead = [
            go(native, surrogate, [1, 1, 0.7, 1], lambda k: k == 3) for native in (one, other)
        ]
        assert np.array_equal(ahead[0][0], ahead[1][0])
        assert ahead[0][1] == ahead[1][1]


@pytest.mark.parametrize("name", ["plain", "estimated", "span"])
def test_reset_forgets_bounds_and_the_confidence(load: Load, name: str) -> None:
    surrogate = surrogate_of(name)
    loaded = load(surrogate)
    native, fresh = loaded.instance().start(), loaded.instance().start()
    native.set(0.99, first=places(surrogate, "CONFIDENCE")[0])
    go(native, surrogate, [1.0] * 20, lambda k: k == 10)
    assert native.call("fmi2Reset") == OK
    native.start()
    assert read(native, surrogate) == read(fresh, surrogate)
    found = [go(each, surrogate, [1.0] * 90, lambda k: k == 89)[1] for each in (native, fresh)]
    assert found[0] == found[1]


@pytest.mark.parametrize("name", ["plain", "forecast", "estimated", "span"])
def test_bounds_before_the_first_step_are_those_of_held_inputs(load: Load, name: str) -> None:
    surrogate = surrogate_of(name)
    native = load(surrogate).instance().start()
    for inputs in ([0.5, 1.0], [-1.0, 2.0]):
        native.set(*inputs)
        row = np.array([inputs])
        trust = surrogate.trust(row)
        expected = [*trust.bounds()[0], trust.novelty[0]]
        within(read(native, surrogate)[:3], expected)


@pytest.mark.parametrize("length", [1.0, 2.0, 1.5])
@pytest.mark.parametrize("hold", ["zero_order", "first_order"])
def test_failed_step_keeps_bounds_that_are_due(load: Load, length: float, hold: str) -> None:
    """Features overflow where the inputs do not."""
    shape = dataclasses.replace(SHAPES["gated"], hold=hold, forecasts=hold == "first_order")
    surrogate = bounded_surrogate(shape, BLOCKS)
    loaded = load(surrogate)
    native, other = loaded.instance().start(), loaded.instance().start()
    for each in (native, other):
        go(each, surrogate, [1.0] * 50, lambda k: k == 12)
    native.set(3e38, 0.2)
    assert native.do_step(native.time(), length * STEP) == ERROR
    assert read(native, surrogate) == read(other, surrogate)
    found = [go(each, surrogate, [1.0] * 3, lambda k: True)[1] for each in (native, other)]
    assert found[0] == found[1]


def test_what_only_the_companion_cannot_bear_gives_the_largest_novelty_and_bound(
    load: Load,
) -> None:
    shape = dataclasses.replace(PLAIN, features="chain")
    base, other = bounded_surrogate(PLAIN, BLOCKS), bounded_surrogate(shape, BLOCKS)
    surrogate = dataclasses.replace(base, bound=other.bound)
    assert other.bound is not None
    native = load(surrogate).instance().start()
    for value in (1.0, 3e38, -3e38):
        native.step(value, value)
    factor = other.bound.factors_at(0.95) * surrogate.output_scaling.scale
    found = read(native, surrogate)
    assert found[2:] == [1e9, 0.0]
    of_share = 6 * other.bound.shares * base.output_scaling.scale
    np.testing.assert_allclose(found[:2], 2.0**60 * np.maximum(factor, of_share))


def test_confidence_takes_the_next_calibrated_factors(load: Load) -> None:
    surrogate = bounded_surrogate(PLAIN, BLOCKS)
    bound = surrogate.bound
    assert bound is not None
    alone = dataclasses.replace(bound, floors=np.zeros(2), shares=np.full(2, 1e-9))
    surrogate = dataclasses.replace(surrogate, bound=alone)  # so that only factors count
    native, place = load(surrogate).instance().start(), places(surrogate, "CONFIDENCE")[0]
    assert native.get(place) == [0.95]
    native.step(0.5, 0.5)
    usual = np.array(read(native, surrogate)[:2]) / bound.factors[1]
    for confidence, row in ((0.9, 0), (0.91, 1), (0.95, 1), (0.951, 2), (0.99, 2)):
        assert native.set(confidence, first=place) == OK
        assert native.get(place) == [confidence]
        found = np.array(read(native, surrogate)[:2]) / bound.factors[row]
        np.testing.assert_allclose(found, usual, rtol=1e-14)


@pytest.mark.parametrize("confidence", [0.0, 0.8999, 0.9901, 1.0, float("nan")])
def test_confidence_that_is_not_calibrated_is_refused(load: Load, confidence: float) -> None:
    surrogate = bounded_surrogate(PLAIN, BLOCKS)
    two, three = (places(surrogate, "CONFIDENCE", fmi)[0] for fmi in (2, 3))
    loaded = load(surrogate)
    for native, place in ((loaded.instance(), two), (instance_of(loaded), three)):
        native.start()
        assert native.set(confidence, first=place) == DISCARD
        assert "expected 0.9 to 0.99, for which error bounds are" in native.messages[-1]
        assert native.set(0.99, first=place) == OK


def test_bounds_of_both_standards_are_the_same(load: Load) -> None:
    surrogate = bounded_surrogate(PLAIN, BLOCKS)
    loaded = load(surrogate)
    two, three = loaded.instance().start(), instance_of(loaded).start()
    rows = np.random.default_rng(2).uniform(-1, 2, (30, 2))
    for k, row in enumerate(rows):
        two.step(*row)
        three.set(*row)
        assert three.do_step(k * STEP) == OK
        found = [x for key in KINDS[:3] for x in three.get(*places(surrogate, key, 3))]
        assert found == read(two, surrogate)


def test_derivative_of_an_error_bound_is_refused(load: Load) -> None:
    surrogate = surrogate_of("span")
    loaded = load(surrogate)
    three = instance_of(loaded).start()
    for key in ("ERROR_BOUND", "NOVELTY", "ERROR_ESTIMATE"):
        first = places(surrogate, key, 3)[0]
        unknowns = range(first, first + 1)
        message = "an error bound, the novelty or an error estimate of the bound; expected"
        with pytest.raises(AssertionError, match=message):
            three.derivative("fmi3GetDirectionalDerivative", unknowns, range(1), np.ones(1))


def test_a_surrogate_without_a_bound_has_none_of_its_variables() -> None:
    keys = {v.kind.key for v in fmu_variables(sum_surrogate(), 3)}
    assert not keys & {*KINDS, "CONFIDENCE"}
