"""Surrogates with random weights, and one that sums its window."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from slide_fmu.network import FeedForward, Float32Array, Layer
from slide_fmu.scaling import Affine, LogError
from slide_fmu.signals import Signal
from slide_fmu.surrogate import ErrorEstimator, Surrogate
from slide_fmu.window import Window

STEP = 0.005


@dataclass(frozen=True)
class Shape:
    """What a random surrogate looks like."""

    n_in: int = 12
    n_out: int = 4
    n_inputs: int = 1
    n_outputs: int = 1
    hidden: tuple[int, ...] = (20,)
    activation: str = "relu"
    block: bool = True
    skip: bool = False
    positions: int = 0
    means: bool = False
    name: str = "sample"
    seed: int = 0


def _network(shape: Shape, n_samples: int, n_values: int, seed: int) -> FeedForward:
    rng = np.random.default_rng(seed)

    def weights(rows: int, columns: int) -> Float32Array:
        return rng.normal(0, columns**-0.5, (rows, columns)).astype(np.float32)

    sizes = [n_samples * shape.n_inputs, *shape.hidden, n_values]
    layers = []
    for index, (n_in, n_out) in enumerate(pairwise(sizes)):
        activation = "identity" if index == len(sizes) - 2 else shape.activation
        bias = rng.normal(0, 0.1, n_out).astype(np.float32)
        layers.append(Layer(weights(n_out, n_in), bias, activation))
    skip = weights(n_values, sizes[0]) if shape.skip else None
    return FeedForward(tuple(layers), n_samples, shape.n_inputs, skip)


def random_surrogate(shape: Shape) -> Surrogate:
    """A surrogate of this shape; its estimator is there when positions > 0."""
    rng = np.random.default_rng(shape.seed + 1000)
    window = Window(STEP, shape.n_in, shape.n_out)
    samples = shape.n_in if shape.block else window.receptive_field
    values = shape.n_outputs * (shape.n_out if shape.block else 1)
    estimator = None
    if shape.positions > 0:
        seen = shape.n_in - shape.positions + 1
        network = _network(shape, seen, shape.n_outputs * (1 + shape.means), shape.seed + 1)
        estimator = ErrorEstimator(network, LogError(-3, 1), shape.positions)
    return Surrogate(
        shape.name,
        window,
        tuple(Signal(f"u{i}", "N", -2, 3) for i in range(shape.n_inputs)),
        tuple(Signal(f"y{i}", "m", -4, 4) for i in range(shape.n_outputs)),
        "held",
        Affine.of_channels(rng.normal(size=shape.n_inputs), rng.uniform(1, 2, shape.n_inputs)),
        Affine.of_channels(rng.normal(size=shape.n_outputs), rng.uniform(1, 2, shape.n_outputs)),
        _network(shape, samples, values, shape.seed),
        estimator,
    )


def sum_surrogate(n_in: int = 4) -> Surrogate:
    """The output is the sum of the inputs in the window."""
    ones = Layer(np.ones((1, n_in), np.float32), np.zeros(1, np.float32), "identity")
    unit = Affine.of_channels([0.0], [1.0])
    network = FeedForward((ones,), n_in, 1)
    signals = [(Signal(name, "1", -1.0, high),) for name, high in (("u", 1.0), ("y", 9.0))]
    window = Window(STEP, n_in, 1)
    return Surrogate("window_sum", window, signals[0], signals[1], "held", unit, unit, network)
