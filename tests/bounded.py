"""Error bounds with random weights, for tests."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from slide_fmu.core.scaling import Affine
from slide_fmu.features.differences import Differences
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.network.feed_forward.network import FeedForward, Layer
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.surrogate.error_bound import ErrorBound
from slide_fmu.surrogate.error_estimator import ErrorEstimator
from slide_fmu.surrogate.span_estimate import SpanEstimate
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.samples import Shape, random_surrogate


def random_bound(
    companion: StateSpace,
    seed: int,
    blocks: tuple[int, int] = (2, 5),
    units: int = 5,
    estimator: ErrorEstimator | None = None,
    moving: bool = False,
) -> ErrorBound:
    """A bound beside some companion, whose head has one layer of tanh units.

    The head sees what the estimator expects, if there is one. Tolerances and floors are such that
    random inputs exceed them at times; some logarithms of random inputs are smaller than the
    quietest of the head.
    """
    rng = np.random.default_rng(seed)
    n_outputs = companion.n_values
    n_seen = len(companion.cell.a) + len(companion.roles.drive)
    n_statistics = 2 * n_seen + (3 if estimator is None else 4) * n_outputs
    features = FeatureMap(
        Differences(n_statistics),
        scaling=Affine(rng.normal(size=n_statistics), rng.uniform(2, 6, n_statistics)),
    )

    def layer(rows: int, columns: int, activation: str) -> Layer:
        weights = rng.normal(0, 1 / np.sqrt(columns), (rows, columns)).astype(np.float32)
        return Layer(weights, rng.normal(0, 0.3, rows).astype(np.float32), activation)

    layers = layer(units, n_statistics, "tanh"), layer(n_outputs, units, "identity")
    factors = np.cumsum(rng.uniform(0.5, 1, (3, n_outputs)), axis=0)
    tolerances = factors[1] * np.linspace(0.8, 1.2, n_outputs)
    return ErrorBound(
        companion,
        FeedForward(layers, 1, features),
        blocks,
        factors,
        rng.uniform(0.05, 0.5, n_seen + 2 * n_outputs),
        tolerances=tolerances,
        floors=0.3 * tolerances[::-1],
        shares=np.linspace(1.0, 0.5, n_outputs),
        doubt=0.75,
        moving=moving,
        quietest=np.linspace(-6.0, 0.0, n_statistics - n_seen),
        estimator=estimator,
    )


def with_span(surrogate: Surrogate, block: int = 7) -> Surrogate:
    """The surrogate with an error estimate of its bound, and without an error estimator.

    The head gives the RMS errors that it is made of, beside the local scales.
    """
    bound = surrogate.bound
    assert bound is not None
    assert bound.estimator is None
    span = SpanEstimate(block, np.linspace(0.7, 1.3, bound.companion.n_values))
    *hidden, last = bound.head.layers
    weights = np.concatenate([last.weights, 0.5 * last.weights[::-1]])
    bias = np.concatenate([last.bias, last.bias[::-1] - np.float32(0.2)])
    layers = *hidden, replace(last, weights=weights, bias=bias)
    head = FeedForward(layers, 1, bound.head.features)
    return replace(surrogate, estimator=None, bound=replace(bound, head=head, span=span))


def with_tolerances(surrogate: Surrogate, share: float) -> Surrogate:
    """The surrogate with a multiple of the tolerances of its bound."""
    bound = surrogate.bound
    assert bound is not None
    return replace(surrogate, bound=replace(bound, tolerances=share * bound.tolerances))


def bounded_surrogate(shape: Shape, blocks: tuple[int, int] = (2, 5)) -> Surrogate:
    """A random state-space surrogate of a shape with a random bound beside it.

    Its companion has more units than the surrogate, as a recipe may ask for.
    """
    surrogate = random_surrogate(shape)
    assert shape.cell is not None
    larger = replace(shape.cell, units=shape.cell.units + 10)
    other = random_surrogate(replace(shape, cell=larger, seed=shape.seed + 77)).network
    assert isinstance(other, StateSpace)
    moving = surrogate.hold == "first_order"
    bound = random_bound(other, shape.seed, blocks, estimator=surrogate.estimator, moving=moving)
    return replace(surrogate, bound=bound)
