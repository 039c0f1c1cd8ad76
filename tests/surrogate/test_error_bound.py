"""The error bound along records, beside plain loops over its definition."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest

from slide_fmu.core.block_means import N_BLOCKS, block_lengths, block_means
from slide_fmu.core.signals import FloatArray
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.surrogate.bound_statistics import logarithms
from slide_fmu.surrogate.error_bound import (
    CONFIDENCES,
    MOST_EXPONENT,
    ErrorBound,
    Trust,
    calibrated,
    least_trajectories,
    local_scales,
)
from slide_fmu.surrogate.payload import PayloadError
from slide_fmu.surrogate.span_estimate import SpanEstimate
from slide_fmu.surrogate.surrogate import Surrogate
from tests.bounded import bounded_surrogate, with_span, with_tolerances
from tests.fmu.samples import CellShape, Shape, random_surrogate
from tests.refusals import refused

SHAPE = Shape(
    n_in=9, n_out=4, n_inputs=2, n_outputs=2, differences=1, cell=CellShape(contraction=0.9)
)


def record(surrogate: Surrogate, count: int = 60, seed: int = 0) -> FloatArray:
    rng = np.random.default_rng(seed)
    return rng.uniform(-2, 3, (count, len(surrogate.inputs)))


SEEING = replace(SHAPE, positions=3)
"""Of a surrogate with an error estimator."""


def plain_mean(values: list[float], k: int, block: int) -> float:
    """Over the last whole blocks and the begun one; before the record, its first value."""
    first = (k // block - N_BLOCKS) * block
    taken = [values[max(i, 0)] for i in range(first, k + 1)]
    return math.fsum(taken) / len(taken)


def plain_trust(surrogate: Surrogate, inputs: FloatArray) -> Trust:
    """Sample by sample, from states that are found by runs from zero."""
    bound = surrogate.bound
    assert bound is not None
    companion, n = bound.companion, bound.companion.n_samples
    scaled = surrogate.input_scaling.apply(inputs)
    held = np.concatenate([np.repeat(scaled[:1], 3 * n, axis=0), scaled])
    features = companion.features.along(held[None])[0]
    of_companion = companion.stream(scaled[None])[0].astype(float)
    predicted = surrogate.network.stream(scaled[None])[0].astype(float)
    squares = (predicted - of_companion) ** 2
    seen = []
    for k in range(len(scaled)):
        age = (k - 1) % n  # of the younger state, which began at sample k - age
        begin = 3 * n + k - age - n
        x = companion.run(features[None, begin : 3 * n + k + 1])[1][0]
        drive = features[3 * n + k, list(companion.roles.drive)]
        seen.append([*x.astype(float), *drive.astype(float)])
    found, disagreement, novelty = [], [], []
    for k in range(len(scaled)):
        short, long = (
            [plain_mean(squares[:, i].tolist(), k, block) for i in range(squares.shape[1])]
            for block in bound.blocks
        )
        columns = [[row[i] ** 2 for row in seen] for i in range(len(seen[0]))]
        levels = [plain_mean(column, k, bound.blocks[1]) for column in columns]
        watched = [*short, *long, *levels]
        expected = [] if bound.estimator is None else bound.estimator.along(scaled[: k + 1], 2)[k]
        logs = [float(logarithms(np.array(v))) for v in (*squares[k], *watched, *expected)]
        values = bound.head.evaluate(np.array([*seen[k], *logs])[None, None])[0]
        found.append([2.0 ** float(v) for v in values])
        disagreement.append([math.sqrt(max(*p)) for p in zip(squares[k], short, strict=True)])
        pairs = zip(watched, bound.limits, strict=True)
        novelty.append(math.sqrt(max(mean / limit for mean, limit in pairs)))
    scales, rms = np.split(np.array(found), [squares.shape[1]], axis=1)
    return Trust(scales, np.array(disagreement), np.array(novelty), rms if bound.span else None)


@pytest.mark.parametrize("sees_estimates", [False, True])
@pytest.mark.parametrize("blocks", [(1, 1), (1, 4), (3, 7)])
def test_trust_is_that_of_plain_loops(blocks: tuple[int, int], sees_estimates: bool) -> None:
    shape = SEEING if sees_estimates else SHAPE
    surrogate = bounded_surrogate(shape, blocks, sees_estimates)
    inputs = record(surrogate)
    found, expected = surrogate.trust(inputs), plain_trust(surrogate, inputs)
    np.testing.assert_allclose(found.scales, expected.scales, rtol=2e-4)
    np.testing.assert_allclose(found.disagreement, expected.disagreement, rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(found.novelty, expected.novelty, rtol=1e-4)
    assert found.novelty.min() < found.novelty.max()


def test_bounds_are_factors_times_scales_and_outside_at_least_the_disagreement() -> None:
    bound = bounded_surrogate(SHAPE).bound
    assert bound is not None
    trust = Trust(np.full((2, 2), 0.5), np.array([[9.0, 0.0], [9.0, 0.0]]), np.array([1.0, 1.0]))
    found = bound.bounds(trust, 0.95, np.array([True, False]))
    expected = 0.5 * bound.factors[1]
    np.testing.assert_allclose(found, [expected, [9.0, expected[1]]])


def test_bounds_with_floors_add_them_and_are_at_least_the_disagreement_everywhere() -> None:
    bound = with_tolerances(bounded_surrogate(SHAPE)).bound
    assert bound is not None
    assert bound.floors is not None
    apart = np.array([[9.0, 0.0], [0.0, 9.0], [np.inf, 0.0]])
    trust = Trust(np.full((3, 2), 0.5), apart, np.ones(3))
    one, other = np.hypot(0.5 * bound.factors[1], bound.floors)
    for inside in (True, False):
        found = bound.bounds(trust, 0.95, np.full(3, inside))
        expected = [[9.0, other], [one, 0.5 * 9.0], [2.0**MOST_EXPONENT, other]]
        np.testing.assert_allclose(found, expected, rtol=1e-14)


@pytest.mark.parametrize(("confidence", "least"), [(0.9, 10), (0.95, 20), (0.99, 100)])
def test_confidence_is_calibrated_from_its_least_number_of_trajectories_on(
    confidence: float, least: int
) -> None:
    assert least_trajectories(confidence) == least
    assert confidence in calibrated(least)
    assert confidence not in calibrated(least - 1)


def test_memory_is_that_of_the_means_or_of_a_longer_estimator() -> None:
    bound = bounded_surrogate(SEEING, (2, 5), sees_estimates=True).bound
    assert bound is not None
    assert bound.estimator is not None
    own = 2 * bound.companion.n_samples + (N_BLOCKS + 1) * 5
    assert bound.memory_length == max(own, bound.estimator.memory_length)
    alone = replace(bound, blocks=(2, 50))
    assert alone.memory_length == 2 * bound.companion.n_samples + (N_BLOCKS + 1) * 50
    assert alone.memory_length > bound.estimator.memory_length
    shortest = replace(bound, blocks=(1, 1))
    object.__setattr__(shortest, "estimator", _Longer(1000))
    assert shortest.memory_length == 1000


@dataclass(frozen=True)
class _Longer:
    """It stands for an estimator with a longer memory than the means have."""

    memory_length: int


@pytest.mark.parametrize(("confidence", "row"), [(0.9, 0), (0.93, 1), (0.95, 1), (0.99, 2)])
def test_confidence_takes_the_next_calibrated_one(confidence: float, row: int) -> None:
    bound = bounded_surrogate(SHAPE).bound
    assert bound is not None
    assert np.array_equal(bound.factors_at(confidence), bound.factors[row])


@pytest.mark.parametrize("confidence", [0.5, 0.995, math.nan])
def test_confidence_that_is_not_calibrated_is_refused(confidence: float) -> None:
    surrogate = bounded_surrogate(SHAPE)
    with refused(ValueError, "confidence", "expected 0.9 to 0.99"):
        surrogate.error_bounds(record(surrogate), confidence)


def test_domain_needs_inputs_in_their_ranges_too() -> None:
    surrogate = bounded_surrogate(SHAPE)
    bound = surrogate.bound
    assert bound is not None
    wide = replace(bound, limits=np.full(bound.limits.shape, 1e9))
    surrogate = replace(surrogate, bound=wide)
    inputs = record(surrogate)
    scaled = (
        0.9
        * surrogate.input_scaling.apply(inputs)
        / np.abs(surrogate.input_scaling.apply(inputs)).max()
    )
    inside = surrogate.input_scaling.invert(scaled)
    assert surrogate.in_domain(inside).all()
    inside[30] = surrogate.input_scaling.invert(np.array([1.5, 0.0]))
    assert not surrogate.in_domain(inside)[30]


def test_what_is_not_finite_is_as_bad_as_can_be() -> None:
    surrogate = bounded_surrogate(SHAPE)
    bound = surrogate.bound
    assert bound is not None
    scaled = np.full((5, 2), 1e30)
    (trust,) = bound.along(scaled[None], np.full((1, 5, 2), np.inf))
    assert np.all(trust.novelty == 1e9)
    assert np.all(bound.bounds(trust, 0.95, trust.novelty <= 1) >= 2.0**MOST_EXPONENT)


@pytest.mark.parametrize("block", [1, 4])
def test_estimate_of_the_bound_is_that_of_plain_loops(block: int) -> None:
    surrogate = with_span(bounded_surrogate(SHAPE), block)
    bound, inputs = surrogate.bound, record(surrogate)
    assert bound is not None
    assert bound.span is not None
    trust = plain_trust(surrogate, inputs)
    assert trust.rms is not None
    squares = trust.rms**2
    expected = [
        [math.sqrt(plain_mean(squares[:, i].tolist(), k, block)) for i in range(2)]
        for k in range(len(inputs))
    ]
    factors = bound.span.factors * surrogate.output_scaling.scale
    np.testing.assert_allclose(
        surrogate.estimate_error(inputs), factors * np.array(expected), rtol=1e-4
    )
    assert surrogate.estimated_samples == {1: 9, 4: 34}[block]


def test_expected_errors_are_told_where_an_estimate_is_made_of_them() -> None:
    surrogate = bounded_surrogate(SHAPE)
    inputs = record(surrogate)
    plain, found = surrogate.trust(inputs), with_span(surrogate).trust(inputs)
    assert plain.rms is None
    np.testing.assert_array_equal(found.scales, plain.scales)
    assert found.rms is not None
    assert found.rms.shape == found.scales.shape
    assert not np.allclose(found.rms, found.scales)


def test_estimate_needs_an_estimator_or_a_bound() -> None:
    surrogate = bounded_surrogate(SHAPE)
    assert not surrogate.estimates_errors
    with refused(ValueError, "no error estimator", "or by bound.estimate_span"):
        surrogate.estimate_error(record(surrogate))


def test_estimator_of_another_surrogate_is_refused() -> None:
    surrogate = bounded_surrogate(SEEING, sees_estimates=True)
    other = random_surrogate(replace(SEEING, seed=5)).estimator
    with refused(ValueError, "expected its own", "error estimator"):
        replace(surrogate, estimator=other)


def test_estimates_of_bound_and_estimator_at_once_are_refused() -> None:
    surrogate = with_span(bounded_surrogate(SHAPE))
    with refused(ValueError, "error estimator"):
        replace(surrogate, estimator=random_surrogate(SEEING).estimator)
    bound = bounded_surrogate(SEEING, sees_estimates=True).bound
    assert bound is not None
    assert surrogate.bound is not None
    with refused(ValueError, "expected one", "error estimator"):
        replace(bound, span=surrogate.bound.span)


@pytest.mark.parametrize(
    ("block", "factors", "message"),
    [
        (0, [1.0, 1.0], "blocks of 0 samples; expected 1 to"),
        (3, [1.0, 0.0], "expected them finite and positive"),
        (3, [1.0, math.nan], "expected them finite and positive"),
    ],
)
def test_bad_estimate_of_a_bound_is_refused(
    block: int, factors: list[float], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        SpanEstimate(block, np.array(factors))


def test_estimate_of_a_head_without_expected_errors_is_refused() -> None:
    bound = bounded_surrogate(SHAPE).bound
    assert bound is not None
    with refused(ValueError, "values (", "2); expected (", "4)"):
        replace(bound, span=SpanEstimate(3, np.ones(2)))


def test_estimate_for_other_outputs_is_refused() -> None:
    bound = with_span(bounded_surrogate(SHAPE)).bound
    assert bound is not None
    with refused(ValueError, "factors of the estimate", "of shape (3,)"):
        replace(bound, span=SpanEstimate(3, np.ones(3)))


@pytest.mark.parametrize("tolerant", [False, True])
@pytest.mark.parametrize(("kind", "version"), [("plain", 8), ("seen", 9), ("span", 9)])
def test_file_keeps_the_bound(kind: str, version: int, tolerant: bool) -> None:
    surrogate = bounded_surrogate(SEEING if kind == "seen" else SHAPE, (2, 5), kind == "seen")
    surrogate = with_span(surrogate) if kind == "span" else surrogate
    surrogate, version = (with_tolerances(surrogate), 10) if tolerant else (surrogate, version)
    data = surrogate.to_bytes()
    assert int.from_bytes(data[8:12], "little") == version
    again = Surrogate.from_bytes(data)
    assert again.to_bytes() == data
    inputs = record(surrogate)
    assert np.array_equal(again.error_bounds(inputs), surrogate.error_bounds(inputs))
    assert again.memory_length == surrogate.memory_length
    if tolerant:
        assert np.array_equal(again.trusted(inputs), surrogate.trusted(inputs))


@pytest.mark.parametrize(
    "tolerances", [np.ones(3), np.ones((2, 1)), np.array([1.0, 0.0]), np.array([np.inf, 1.0])]
)
def test_tolerances_of_a_bound_must_be_positive_ones_for_each_output(
    tolerances: FloatArray,
) -> None:
    bound = with_tolerances(bounded_surrogate(SHAPE)).bound
    assert bound is not None
    with refused(ValueError, "tolerances of an error bound of shape", "expected (2,), finite"):
        replace(bound, tolerances=tolerances)


@pytest.mark.parametrize(
    "floors", [np.ones(3), np.ones((2, 1)), np.array([1.0, -1e-9]), np.array([np.inf, 1.0])]
)
def test_floors_of_a_bound_must_be_finite_ones_for_each_output(floors: FloatArray) -> None:
    bound = with_tolerances(bounded_surrogate(SHAPE)).bound
    assert bound is not None
    with refused(ValueError, "floors of an error bound", "expected 2 finite numbers"):
        replace(bound, floors=floors)


@pytest.mark.parametrize(
    "shares", [np.ones(3), np.array([1.0, 0.0]), np.array([1.1, 1.0]), np.array([np.nan, 1.0])]
)
def test_shares_of_the_disagreement_are_between_0_and_1(shares: FloatArray) -> None:
    bound = with_tolerances(bounded_surrogate(SHAPE)).bound
    assert bound is not None
    with refused(ValueError, "shares of the disagreement", "expected 2 numbers above 0"):
        replace(bound, shares=shares)


def test_quietest_logarithms_must_be_finite_ones_for_each_logarithm() -> None:
    bound = with_tolerances(bounded_surrogate(SHAPE)).bound
    assert bound is not None
    count = bound.n_logarithms
    for quietest in (np.zeros(count + 1), np.full(count, -np.inf), np.full(count, np.nan)):
        with refused(ValueError, "quietest logarithms", f"expected ({count},), all of them"):
            replace(bound, quietest=quietest)


def test_tolerances_floors_and_quietest_logarithms_come_together() -> None:
    bound = with_tolerances(bounded_surrogate(SHAPE)).bound
    assert bound is not None
    for name in ("tolerances", "floors", "quietest"):
        with refused(ValueError, f"error bound without {name}; expected all or none"):
            replace(bound, **{name: None})


def test_head_gets_no_logarithm_below_the_quietest() -> None:
    surrogate = with_tolerances(bounded_surrogate(SHAPE))
    bound, inputs = surrogate.bound, record(surrogate)
    assert bound is not None
    assert bound.quietest is not None
    scaled = surrogate.input_scaling.apply(inputs)[None]
    predicted = surrogate.output_scaling.apply(surrogate.predict_newest(inputs))[None]
    (statistics,) = bound.statistics(scaled, predicted)[0]
    signed = statistics.shape[1] - bound.n_logarithms
    assert 0 < (statistics[:, signed:] < bound.quietest).mean() < 1
    limited = statistics.copy()
    for row in limited:
        for i, least in enumerate(bound.quietest):
            row[signed + i] = max(row[signed + i], least)
    exponents = bound.head.evaluate(limited[:, None])
    expected = local_scales(exponents.astype(float))
    np.testing.assert_allclose(surrogate.trust(inputs).scales, expected, rtol=1e-6)


def test_tolerances_of_a_bound_that_does_not_see_the_estimator_are_refused() -> None:
    """A file with tolerances says by its version that the head sees the estimates."""
    surrogate = bounded_surrogate(SEEING)
    with refused(ValueError, "does not use the error estimator", "fit the bound again"):
        with_tolerances(surrogate)


def test_trust_without_tolerances_or_with_bad_ones_is_refused() -> None:
    surrogate = bounded_surrogate(SHAPE)
    inputs = record(surrogate)
    with refused(ValueError, "an error bound without tolerances", "use in_domain"):
        surrogate.trusted(inputs)
    tolerant = with_tolerances(surrogate)
    for bad in (np.ones(3), np.array([1.0, -1.0]), np.array([1.0, np.nan])):
        with refused(ValueError, "expected 2 finite numbers that are not negative"):
            tolerant.trusted(inputs, bad)


def test_file_without_a_bound_is_written_as_before() -> None:
    surrogate = random_surrogate(SHAPE)
    assert int.from_bytes(surrogate.to_bytes()[8:12], "little") == 6


def test_damaged_file_is_refused() -> None:
    surrogate = bounded_surrogate(SHAPE)
    data = surrogate.to_bytes()
    with refused(PayloadError, "checksum"):
        Surrogate.from_bytes(data[:200] + b"\xff" + data[201:])


def test_surrogate_without_a_bound_says_so() -> None:
    surrogate = random_surrogate(SHAPE)
    with refused(ValueError, "recipe's table"):
        surrogate.error_bounds(record(surrogate))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"blocks": (3, 2)}, "blocks of 3 and 2 samples"),
        ({"blocks": (0, 2)}, "blocks of 0 and 2 samples"),
        ({"limits": np.zeros(3)}, r"limits .* of shape \(3,\)"),
        ({"factors": np.full((3, 2), -1.0)}, "finite and positive"),
        ({"factors": np.array([[3.0, 1], [2, 1], [1, 1]])}, "expected them to rise"),
    ],
)
def test_parts_that_do_not_fit_are_refused(changes: dict[str, object], message: str) -> None:
    bound = bounded_surrogate(SHAPE).bound
    assert bound is not None
    with pytest.raises(ValueError, match=message):
        replace(bound, **changes)  # type: ignore[arg-type]


def test_bound_of_layers_is_refused() -> None:
    bound = bounded_surrogate(SHAPE).bound
    layers = random_surrogate(replace(SHAPE, cell=None))
    with refused(ValueError, "state-space networks without physical parameters"):
        replace(layers, bound=bound)


def test_companion_of_another_window_is_refused() -> None:
    bound = bounded_surrogate(replace(SHAPE, n_in=11)).bound
    with refused(ValueError, "expected"):
        replace(random_surrogate(SHAPE), bound=bound)


def test_logarithms_are_about_those_to_base_two() -> None:
    values = np.geomspace(1e-29, 1e30, 4001)
    deviation = logarithms(values) - np.log2(values)
    assert -0.0862 < deviation.min() <= deviation.max() < 1e-5
    assert logarithms(np.zeros(1)) == logarithms(np.full(1, 1e-31))


def test_means_are_those_of_whole_blocks_and_the_begun_one() -> None:
    values = np.arange(40.0)[None, :, None]
    found = block_means(values, 3)[0, :, 0]
    assert [found[k] for k in (0, 1, 39)] == [
        pytest.approx(plain_mean(values[0, :, 0].tolist(), k, 3)) for k in (0, 1, 39)
    ]
    assert found[0] == 0
    assert block_lengths(0.03) == (1, 5)
    assert block_lengths(10.0) == (1, 1)


def test_states_of_the_ping_pong_are_those_behind_its_values() -> None:
    network = random_surrogate(SHAPE).network
    assert isinstance(network, StateSpace)
    scaled = np.random.default_rng(1).uniform(-1, 1, (3, 50, 2))
    values, states = network.ping_pong_states(network.features.along(scaled))
    assert np.array_equal(values, network.stream(scaled))
    assert states.shape == (3, 50, len(network.cell.a))
    handed_over = 9 * np.arange(1, 5)  # then the younger state's weight is 1, and it is the older
    younger = network.evaluate(np.stack([scaled[0, k - 8 : k + 1] for k in handed_over]))
    np.testing.assert_allclose(values[0, handed_over], younger, atol=0.2)


def test_confidences_rise() -> None:
    assert list(CONFIDENCES) == sorted(set(CONFIDENCES))
    assert isinstance(bounded_surrogate(SHAPE).bound, ErrorBound)


def test_bounds_and_domain_of_many_records_are_those_of_each() -> None:
    surrogate = bounded_surrogate(SHAPE)
    one = record(surrogate)
    records = np.stack([one, 1.7 * one, one[::-1]])
    found = surrogate.error_bounds_and_domain(records)
    assert len(found) == 3
    for inputs, (bounds, inside) in zip(records, found, strict=True):
        np.testing.assert_allclose(bounds, surrogate.error_bounds(inputs), rtol=1e-5)
        assert np.array_equal(inside, surrogate.in_domain(inputs))
    assert not np.allclose(found[0][0], found[2][0])
