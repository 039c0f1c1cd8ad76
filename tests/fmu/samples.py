"""Surrogates with random weights, and one that sums its window."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from slide_fmu.network import FeedForward, Float32Array, Layer, Network
from slide_fmu.scaling import Affine, LogError
from slide_fmu.signals import Hold, Signal
from slide_fmu.state_space import Cell, StateSpace
from slide_fmu.surrogate import ErrorEstimator, Surrogate
from slide_fmu.window import Window

STEP = 0.005


@dataclass(frozen=True)
class CellShape:
    """What the cell of a random state-space surrogate looks like."""

    states: int = 3
    units: int = 5
    differences: int = 0
    activation: str = "tanh"
    contraction: float = 0.6
    estimates: bool = False  # the error estimator has such a cell too


@dataclass(frozen=True)
class Shape:
    """What a random surrogate looks like: state space with a cell, else feed-forward."""

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
    hold: Hold = "held"
    cell: CellShape | None = None


def _network(shape: Shape, n_samples: int, n_values: int, seed: int) -> FeedForward:
    rng = np.random.default_rng(seed)
    spread = 0.3 if shape.activation == "cubic" else 1.0  # cubes of more would grow without bound

    def weights(rows: int, columns: int) -> Float32Array:
        return rng.normal(0, spread * columns**-0.5, (rows, columns)).astype(np.float32)

    sizes = [n_samples * shape.n_inputs, *shape.hidden, n_values]
    layers = []
    for index, (n_in, n_out) in enumerate(pairwise(sizes)):
        activation = "identity" if index == len(sizes) - 2 else shape.activation
        bias = rng.normal(0, 0.1, n_out).astype(np.float32)
        layers.append(Layer(weights(n_out, n_in), bias, activation))
    skip = weights(n_values, sizes[0]) if shape.skip else None
    return FeedForward(tuple(layers), n_samples, shape.n_inputs, skip)


def random_cell(shape: CellShape, n_features: int, n_values: int, seed: int) -> Cell:
    """A cell that contracts: A is ``contraction`` times a rotation, the units add little."""
    rng = np.random.default_rng(seed)
    n, units = shape.states, shape.units

    def weights(rows: int, columns: int, norm: float) -> Float32Array:
        matrix = rng.normal(size=(rows, columns))
        largest = np.linalg.norm(matrix, 2) if matrix.size else 1.0
        return (norm * matrix / largest).astype(np.float32)

    rotation = np.linalg.qr(rng.normal(size=(n, n)))[0]
    return Cell(
        a=(shape.contraction * rotation).astype(np.float32),
        b=weights(n, n_features, 0.5),
        e=weights(n, units, 0.3 * (1 - shape.contraction)),
        w=weights(units, n + n_features + 1, 0.1 if shape.activation == "cubic" else 1.0),
        c=weights(n_values, n, 1.0),
        d=weights(n_values, n_features, 0.3),
        d0=rng.normal(0, 0.1, n_values).astype(np.float32),
        activation=shape.activation,
    )


def _state_space(shape: Shape, n_samples: int, n_out: int, n_values: int, seed: int) -> StateSpace:
    cell = shape.cell
    assert cell is not None
    n_features = shape.n_inputs * (cell.differences + 1)
    scale = np.random.default_rng(seed).uniform(0.5, 2, n_features)
    scale[: shape.n_inputs] = 1
    weights = random_cell(cell, n_features, n_values, seed)
    return StateSpace(weights, n_samples, n_out, shape.n_inputs, cell.differences, scale)


def _predictor(shape: Shape) -> Network:
    if shape.cell is not None:
        return _state_space(shape, shape.n_in, shape.n_out, shape.n_outputs, shape.seed)
    samples = shape.n_in if shape.block else shape.n_in - shape.n_out + 1
    values = shape.n_outputs * (shape.n_out if shape.block else 1)
    return _network(shape, samples, values, shape.seed)


def _estimator(shape: Shape) -> ErrorEstimator | None:
    if shape.positions == 0:
        return None
    seen, values = shape.n_in - shape.positions + 1, shape.n_outputs * (1 + shape.means)
    if shape.cell is not None and shape.cell.estimates:
        network: Network = _state_space(shape, seen, -(-seen // 2), values, shape.seed + 1)
    else:
        network = _network(shape, seen, values, shape.seed + 1)
    return ErrorEstimator(network, LogError(-3, 1), shape.positions)


def random_surrogate(shape: Shape) -> Surrogate:
    """A surrogate of this shape; its estimator is there when positions > 0."""
    rng = np.random.default_rng(shape.seed + 1000)
    window = Window(STEP, shape.n_in, shape.n_out)
    return Surrogate(
        shape.name,
        window,
        tuple(Signal(f"u{i}", "N", -2, 3) for i in range(shape.n_inputs)),
        tuple(Signal(f"y{i}", "m", -4, 4) for i in range(shape.n_outputs)),
        shape.hold,
        Affine.of_channels(rng.normal(size=shape.n_inputs), rng.uniform(1, 2, shape.n_inputs)),
        Affine.of_channels(rng.normal(size=shape.n_outputs), rng.uniform(1, 2, shape.n_outputs)),
        _predictor(shape),
        _estimator(shape),
    )


def sum_surrogate(n_in: int = 4) -> Surrogate:
    """The output is the sum of the inputs in the window."""
    ones = Layer(np.ones((1, n_in), np.float32), np.zeros(1, np.float32), "identity")
    unit = Affine.of_channels([0.0], [1.0])
    network = FeedForward((ones,), n_in, 1)
    signals = [(Signal(name, "1", -1.0, high),) for name, high in (("u", 1.0), ("y", 9.0))]
    window = Window(STEP, n_in, 1)
    return Surrogate("window_sum", window, signals[0], signals[1], "held", unit, unit, network)
