"""Surrogates with random weights, and one that sums its window."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, Literal

import numpy as np

from slide_fmu.core.parameter_basis import ParameterBasis
from slide_fmu.core.parameters import Parameter
from slide_fmu.core.scaling import Affine, LogError
from slide_fmu.core.signals import Angle, FloatArray, Hold, Signal
from slide_fmu.core.window import Window
from slide_fmu.features.base import Features
from slide_fmu.features.chain_motion import ChainMotion
from slide_fmu.features.differences import Differences
from slide_fmu.features.director import ANGLE, COSINE, OTHER, SINE, Director
from slide_fmu.features.drive_law import DRIVE_LAWS
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.features.serial_chain import SerialChain
from slide_fmu.network.base import Float32Array, Network
from slide_fmu.network.feed_forward.network import FeedForward, Layer
from slide_fmu.network.state_space.cell import GATED, Cell, Roles
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.network.state_space.polynomial import CellPolynomial
from slide_fmu.surrogate.error_estimator import ErrorEstimator
from slide_fmu.surrogate.input_forecast import InputForecast
from slide_fmu.surrogate.surrogate import Surrogate

STEP = 0.005
DIRECTORS = (COSINE, SINE, ANGLE, OTHER)
"""Kinds of the inputs of networks that see directors, as far as there are inputs."""
SMALL_TURN = 8.0
"""What features without an angle are divided by where they serve as cosine and sine."""


@dataclass(frozen=True)
class CellShape:
    """What the cell of a random state-space surrogate looks like."""

    states: int = 3
    units: int = 5
    activation: str = "tanh"
    contraction: float = 0.6
    roles: bool = False  # drive and static part differ; always so with gated units
    turned: int = 0
    factors: int = 0
    parameters: int = 0  # that its weights follow
    substeps: int = 1


@dataclass(frozen=True)
class Shape:
    """What a random surrogate looks like: state space with a cell, else feed-forward."""

    n_in: int = 12
    n_out: int = 4
    n_inputs: int = 1
    n_outputs: int = 1
    features: Literal["differences", "director", "chain"] = "differences"
    differences: int = 0
    hidden: tuple[int, ...] = (20,)
    activation: str = "relu"
    block: bool = True
    skip: bool = False
    positions: int = 0
    means: bool = False
    narrow: bool = False  # features leave the ranges that the estimator knows
    estimator_samples: int = 0  # 0: as many as fit in the window with all positions
    ages: int = 0  # samples of their windows that layers look at; 0: all
    name: str = "sample"
    seed: int = 0
    hold: Hold = "zero_order"
    cell: CellShape | None = None
    forecasts: bool = False  # inputs are set to what they are now, and forecast


TWO_MASSES = Shape(n_inputs=2, n_outputs=2, activation="elu", positions=3, name="two_masses")
"""Two inputs, two outputs and an estimator, for tests of FMU files."""


def random_chain(n: int, seed: int) -> SerialChain:
    """A chain of n joints; nothing about it is special."""
    rng = np.random.default_rng(seed)
    return SerialChain(
        prismatic=rng.integers(0, 2, n).astype(np.float64),
        theta=rng.uniform(-2, 2, n),
        alpha=rng.uniform(-2, 2, n),
        steps=rng.normal(0, 0.3, (n, 3)),
        masses=rng.uniform(0.5, 5, n),
        centres=rng.normal(0, 0.2, (n, 3)),
        inertias=_symmetric(rng.normal(0, 0.1, (n, 3, 3))),
        gravity=rng.normal(0, 6, 3),
        tool=rng.normal(0, 0.2, 3),
    )


def _symmetric(matrices: FloatArray) -> FloatArray:
    return np.asarray(matrices + np.swapaxes(matrices, 1, 2))


SEEN: dict[str, dict[str, Any]] = {
    "inputs": {"n_inputs": 2},
    "differences": {"n_inputs": 2, "differences": 2},
    "director": {"n_inputs": 2, "features": "director"},
    "mixed": {"n_inputs": 4, "features": "director"},
    "chain": {"n_inputs": 3, "features": "chain"},
}
"""Arguments of Shape: what networks see of how many inputs."""


def random_features(shape: Shape, seed: int) -> FeatureMap:
    """Features of mean 0 and standard deviation 1; the last two may serve as cosine and sine.

    Without differences they are the inputs as they are.
    """
    n, rng = shape.n_inputs, np.random.default_rng(seed)
    features: Features = Differences(n, shape.differences)
    turn, scale = (0, n - 1), SMALL_TURN
    if shape.features == "director":
        is_angle = np.array(DIRECTORS[:n]) == ANGLE
        middle, half_range = rng.normal(size=n), rng.uniform(1, 2, n)
        in_rad = Affine(np.where(is_angle, middle, 0), np.where(is_angle, half_range, 1))
        features, turn, scale = Director(DIRECTORS[:n], in_rad), (0, 1), 1.0
    elif shape.features == "chain":
        middle, half_range = rng.normal(size=n), rng.uniform(0.5, 1.5, n)
        law = tuple(DRIVE_LAWS.values())[seed % len(DRIVE_LAWS)]
        features = ChainMotion(random_chain(n, seed), law, middle, half_range, STEP)
        turn, scale = features.indices(("frame",)), 1.0  # type: ignore[assignment]
    elif shape.differences == 0 and (shape.cell is None or not shape.cell.turned):
        return FeatureMap(features)
    signals = features.along(rng.uniform(-3, 3, (1, 60, n)))[0]
    chosen = rng.permutation(features.n_signals)
    mean, spread = signals.mean(axis=0)[chosen], signals.std(axis=0)[chosen]
    return FeatureMap(
        features,
        (*(int(i) for i in chosen), *turn),
        Affine.of_channels([*mean, 0, 0], [*np.maximum(spread, 1e-3), scale, scale]),
    )


def random_roles(shape: CellShape, n_features: int, seed: int) -> Roles | None:
    """Some features for each role that the cell has; None where all are drive and static part."""
    rng, gated = np.random.default_rng(seed), shape.activation == GATED
    if not (gated or shape.roles or shape.turned or shape.factors):
        return None

    def some() -> tuple[int, ...]:
        count = int(rng.integers(1, min(n_features, 6) + 1))
        return tuple(int(i) for i in rng.integers(0, n_features, count))

    return Roles(
        drive=some(),
        static=some(),
        gated=some() if gated else (),
        schedule=some() if gated else (),
        readout=tuple(int(i) for i in rng.integers(0, n_features, shape.factors)),
        turn=(n_features - 2, n_features - 1) if shape.turned else (),
    )


def random_ages(count: int, n_samples: int, seed: int) -> tuple[int, ...]:
    """The oldest sample and some newer ones; none where all are looked at."""
    if not 0 < count < n_samples:
        return ()
    newer = np.random.default_rng(seed).permutation(n_samples - 1)[: count - 1]
    return (n_samples - 1, *sorted((int(age) for age in newer), reverse=True))


def _network(shape: Shape, n_samples: int, n_values: int, seed: int) -> FeedForward:
    rng, ages = np.random.default_rng(seed), random_ages(shape.ages, n_samples, seed)
    spread = 0.3 if shape.activation == "cubic" else 1.0  # cubes of more would grow without bound

    def weights(rows: int, columns: int) -> Float32Array:
        return rng.normal(0, spread * columns**-0.5, (rows, columns)).astype(np.float32)

    features = random_features(shape, seed)
    sizes = [(len(ages) or n_samples) * features.n_signals, *shape.hidden, n_values]
    layers = []
    for index, (n_in, n_out) in enumerate(pairwise(sizes)):
        activation = "identity" if index == len(sizes) - 2 else shape.activation
        bias = rng.normal(0, 0.1, n_out).astype(np.float32)
        layers.append(Layer(weights(n_out, n_in), bias, activation))
    skip = weights(n_values, sizes[0]) if shape.skip else None
    return FeedForward(tuple(layers), n_samples, features, skip, ages)


def random_cell(
    shape: CellShape, n_features: int, n_values: int, seed: int, roles: Roles | None = None
) -> Cell:
    """A cell that contracts: A is ``contraction`` times a rotation, the units add little."""
    rng = np.random.default_rng(seed)
    every = tuple(range(n_features))
    roles = Roles(every, every) if roles is None else roles
    n, units, gated = shape.states, shape.units, shape.activation == GATED
    drive, rows = len(roles.drive), n_values * (1 + shape.factors)

    def weights(rows: int, columns: int, norm: float) -> Float32Array:
        matrix = rng.normal(size=(rows, columns))
        largest = np.linalg.norm(matrix, 2) if matrix.size else 1.0
        return (norm * matrix / largest).astype(np.float32)

    rotation = np.linalg.qr(rng.normal(size=(n, n)))[0]
    arguments = len(roles.schedule) + 1 if gated else n + drive + 1
    return Cell(
        a=(shape.contraction * rotation).astype(np.float32),
        b=weights(n, drive, 0.5),
        e=weights(n, units, 0.3 * (1 - shape.contraction)),
        w=weights(units, arguments, 0.1 if shape.activation in ("cubic", "mixed") else 1.0),
        v=weights(units, n + len(roles.gated), 1.0) if gated else None,
        c=weights(rows, n, 1.0),
        d=weights(rows, len(roles.static), 0.3),
        d0=rng.normal(0, 0.1, rows).astype(np.float32),
        activation=shape.activation,
        substeps=shape.substeps,
    )


PARAMETERS = (
    Parameter("mass", "kg", 1.0, 3.0, transform="log"),
    Parameter("damping", "N s/m", -2.0, 2.0, start=1.5, description="It may be negative."),
    Parameter("stiffness", "N/m", 100.0, 400.0, transform="reciprocal"),
)
"""Those of random surrogates, as many as they have."""


def random_weights(
    shape: CellShape, n_features: int, n_values: int, seed: int, roles: Roles | None
) -> Cell | CellPolynomial:
    """A cell that contracts, or one that does so for all parameters."""
    first = random_cell(shape, n_features, n_values, seed, roles)
    if shape.parameters == 0:
        return first
    basis = ParameterBasis.of_degree(PARAMETERS[: shape.parameters], 2)
    others = [
        random_cell(shape, n_features, n_values, seed + 1 + term, roles)
        for term in range(len(basis.degrees) - 1)
    ]
    part = np.float32(0.1 * (1 - shape.contraction) / len(others))
    small = [
        replace(cell, **{name: part * weights for name, weights in cell.arrays().items()})
        for cell in others
    ]
    return CellPolynomial(basis, (first, *small))


def _state_space(shape: Shape, n_samples: int, n_out: int, n_values: int, seed: int) -> StateSpace:
    cell = shape.cell
    assert cell is not None
    features = random_features(shape, seed)
    roles = random_roles(cell, features.n_signals, seed)
    weights = random_weights(cell, features.n_signals, n_values, seed, roles)
    return StateSpace(weights, n_samples, n_out, features, roles, cell.turned)


def _predictor(shape: Shape) -> Network:
    if shape.cell is not None:
        return _state_space(shape, shape.n_in, shape.n_out, shape.n_outputs, shape.seed)
    samples = shape.n_in if shape.block else shape.n_in - shape.n_out + 1
    values = shape.n_outputs * (shape.n_out if shape.block else 1)
    return _network(shape, samples, values, shape.seed)


def _estimator(shape: Shape) -> ErrorEstimator | None:
    if shape.positions == 0:
        return None
    seen = shape.estimator_samples or shape.n_in - shape.positions + 1
    network = _network(shape, seen, shape.n_outputs * (1 + shape.means), shape.seed + 1)
    return ErrorEstimator(network, LogError(-3, 1), shape.positions, _ranges(shape, network))


def _ranges(shape: Shape, network: FeedForward) -> Float32Array:
    """Ranges that some features leave, or that hold whatever is tested."""
    count = network.features.n_signals
    if not shape.narrow:
        return np.repeat(np.float32([[-1e30], [1e30]]), count, axis=1)
    rng = np.random.default_rng(shape.seed + 2)
    return np.stack([-rng.uniform(0.8, 2, count), rng.uniform(0.8, 2, count)]).astype(np.float32)


def random_surrogate(shape: Shape) -> Surrogate:
    """A surrogate of this shape; its estimator is there when positions > 0."""
    rng = np.random.default_rng(shape.seed + 1000)
    window = Window(STEP, shape.n_in, shape.n_out)
    offset = np.clip(rng.normal(size=shape.n_inputs), -2, 2)
    scale = rng.uniform(1, 2, shape.n_inputs)
    if shape.features == "director":
        offset[:2], scale[1] = 0, scale[0]
    return Surrogate(
        shape.name,
        window,
        _inputs(shape, np.maximum(offset - 0.5 * scale, -2)),
        tuple(Signal(f"y{i}", "m", -4, 4) for i in range(shape.n_outputs)),
        Affine(offset, scale),
        Affine.of_channels(rng.normal(size=shape.n_outputs), rng.uniform(1, 2, shape.n_outputs)),
        _predictor(shape),
        _estimator(shape),
        _forecast(shape),
    )


def _forecast(shape: Shape) -> InputForecast | None:
    """Inputs that move and are not forecast count as reached by the end of the step."""
    if shape.forecasts:
        return forecast_of(shape.n_inputs)
    if shape.hold == "zero_order":
        return None
    nothing = np.zeros((shape.n_inputs, 0, 1)), np.zeros(shape.n_inputs)
    return InputForecast(False, True, *nothing)


CANDIDATES = np.array([[-1.0, 0.0, 0.0], [-3.02, 1.0, 0.0], [-5.9, 4.0, -1.0]])
"""A straight line, about a parabola, about a cubic."""


def forecast_of(n_inputs: int, at_step_end: bool = False, planned: bool = False) -> InputForecast:
    """A forecast of some inputs, not the same for all."""
    weights = np.array([CANDIDATES * (1 - 0.01 * index) for index in range(n_inputs)])
    return InputForecast(planned, at_step_end, weights, np.linspace(0.3, 0.4, n_inputs), 5)


def _inputs(shape: Shape, starts: FloatArray) -> tuple[Signal, ...]:
    """An angle where the network sees features of one."""
    angles: list[Angle | None] = [None] * shape.n_inputs
    low = -2
    if shape.features == "director":
        angles[:2], low = ["cosine", "sine"], -3
    return tuple(
        Signal(f"u{i}", "N", low, 3, start=float(start), hold=shape.hold, angle=angle)
        for i, (start, angle) in enumerate(zip(starts, angles, strict=True))
    )


def sum_surrogate(n_in: int = 4, hold: Hold = "zero_order") -> Surrogate:
    """The output is the sum of the inputs in the window."""
    ones = Layer(np.ones((1, n_in), np.float32), np.zeros(1, np.float32), "identity")
    unit = Affine.of_channels([0.0], [1.0])
    network = FeedForward((ones,), n_in, FeatureMap(Differences(1)))
    inputs, outputs = (Signal("u", "1", -1.0, 1.0, hold=hold),), (Signal("y", "1", -1.0, 9.0),)
    window = Window(STEP, n_in, 1)
    return Surrogate("window_sum", window, inputs, outputs, unit, unit, network)
