"""Inputs, features and results that are not finite: refused, and without a trace."""

from __future__ import annotations

import copy
import dataclasses
import math

import numpy as np
import pytest

from slide_fmu.core.scaling import Affine
from slide_fmu.features.differences import Differences
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.network.feed_forward.network import FeedForward
from slide_fmu.network.state_space.network import StateSpace
from tests.fmu.callers import Fmi2
from tests.fmu.future import future
from tests.fmu.native import DISCARD, ERROR, OK, ExportedFmu, Load
from tests.fmu.samples import STEP, CellShape, Shape, random_surrogate, sum_surrogate


def test_failed_step_leaves_derivatives_though_it_joined_steps_before(load: Load) -> None:
    """Two steps with the same held inputs are kept as one when the next begins."""
    surrogate = random_surrogate(Shape(n_inputs=2, activation="cubic"))
    caller = Fmi2(load(surrogate))
    assert caller.initialize(0.0, None) == caller.call("ExitInitializationMode") == OK
    for time, length in ((0.0, 1.0), (1.0, 0.6)):
        assert caller.set(0, (0.3, -0.2)) == caller.do_step(time * STEP, length * STEP) == OK
    before = caller.directional(range(2, 3), range(2), np.array([1.0, 0.0]))
    assert caller.set(0, (0.3, -1e30)) == OK
    assert caller.do_step(1.6 * STEP, 0.6 * STEP) == ERROR
    assert caller.directional(range(2, 3), range(2), np.array([1.0, 0.0])) == before


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e300])
def test_input_that_is_not_finite_is_discarded(rich: ExportedFmu, value: float) -> None:
    native = rich.instance().start()
    native.step(0.1, 0.2)
    saved = native.save()
    assert native.set(0.5, value) == DISCARD
    assert "value reference 1" in native.messages[-1]
    assert native.save() == saved


def test_results_that_are_not_finite_are_refused(load: Load) -> None:
    native = load(sum_surrogate()).instance().start()
    native.set(3e38)
    assert native.try_get(1)[0] == DISCARD
    assert native.do_step(0.0) == ERROR
    native.step(1.0)
    native.step(3e38)
    native.set(-1.0)
    assert native.do_step(2 * STEP) == OK
    native.set(3e38)
    before = native.get(1, 2)
    assert native.do_step(3 * STEP) == ERROR
    assert native.get(1, 2) == before
    native.set(-1.0)
    assert native.do_step(3 * STEP) == OK


@pytest.mark.parametrize("means", [False, True])
def test_estimates_that_are_not_finite_count_as_the_largest(load: Load, means: bool) -> None:
    surrogate = random_surrogate(Shape(positions=2, means=means))
    estimator = surrogate.estimator
    assert estimator is not None
    assert isinstance(estimator.network, FeedForward)
    layers = tuple(
        dataclasses.replace(layer, weights=np.float32(1e25) * layer.weights)
        for layer in estimator.network.layers
    )
    network = FeedForward(layers, estimator.network.n_samples, FeatureMap(Differences(1)))
    estimator = dataclasses.replace(estimator, network=network)
    native = load(dataclasses.replace(surrogate, estimator=estimator)).instance().start()
    native.step(1.0)
    largest = 10**estimator.log_error.high * surrogate.output_scaling.scale[0]
    assert native.get(2) == pytest.approx([largest], rel=1e-12)


def test_cells_that_overflow_are_refused_and_go_on(load: Load) -> None:
    surrogate = random_surrogate(Shape(positions=2, cell=CellShape()))
    network = surrogate.network
    assert isinstance(network, StateSpace)
    steep = dataclasses.replace(network.cell, b=1000 * network.cell.b)
    network = StateSpace(steep, network.n_samples, network.n_out, network.features)
    native = load(dataclasses.replace(surrogate, network=network)).instance().start()
    native.step(1.0)
    native.set(3e38)
    before = future(native, STEP, (1.0,), 6)
    for length in (STEP, 2 * STEP, 1.5 * STEP):
        status = [native.do_step(STEP, length) for _ in range(2)]
        assert status == [ERROR, ERROR]
        assert future(native, STEP, (1.0,), 6) == before
    native.step(1.0)
    assert np.all(np.isfinite(native.get(1, 5)))


def magnified(features: FeatureMap) -> FeatureMap:
    """The same features times 1e6, so that most of them overflow; but for cosine and sine."""
    scale = features.scaling.scale * np.array([*[1e-6] * (features.n_signals - 2), 1, 1])
    scaling = Affine.of_channels(features.scaling.offset, scale)
    return FeatureMap(features.features, features.chosen, scaling)


@pytest.mark.parametrize("cell", [None, CellShape(units=8, activation="gated", turned=1)])
def test_features_that_are_not_finite_are_refused(load: Load, cell: CellShape | None) -> None:
    """Saturated units would hide them: loads overflow where the inputs do not."""
    shape = Shape(n_inputs=2, features="chain", activation="tanh", positions=2, cell=cell)
    surrogate = random_surrogate(shape)
    network = copy.copy(surrogate.network)
    network.features = magnified(network.features)
    native = load(dataclasses.replace(surrogate, network=network)).instance().start()
    native.step(0.1, 0.2)
    native.set(3e38, 0.2)
    before = native.get(2, 3)
    for length in (STEP, 2 * STEP, 1.5 * STEP):
        assert native.do_step(STEP, length) == ERROR
        assert "not finite" in native.messages[-1]
        assert native.get(2, 3) == before
    native.step(0.1, 0.2)
    assert np.all(np.isfinite(native.get(2, 3)))


@pytest.mark.parametrize("length", [2 * STEP, 2.5 * STEP, 9 * STEP])
def test_failed_step_leaves_no_trace(load: Load, length: float) -> None:
    """Two samples of the largest float sum to infinity; a bad first step is undone as well."""
    native = load(sum_surrogate()).instance().start()
    fresh = future(native, 0.0, (1.0,), 3)
    native.set(3e38)
    changed = future(native, 0.0, (1.0,), 3)
    assert native.do_step(0.0, length) == ERROR
    assert future(native, 0.0, (1.0,), 3) == changed != fresh
    native.step(1.0)
    native.set(3e38)
    before = future(native, STEP, (1.0,), 3)
    assert native.do_step(STEP, length) == ERROR
    assert future(native, STEP, (1.0,), 3) == before
    native.set(2.0)
    assert native.do_step(STEP, length) == OK
