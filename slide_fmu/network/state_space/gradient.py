"""How the values of networks move with their features: reverse mode, in float64."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.features.gradient import PullBack
from slide_fmu.network.base import Float32Array, Network
from slide_fmu.network.feed_forward import FeedForward, Layer
from slide_fmu.network.state_space import StateSpace


def _elu(z: FloatArray) -> tuple[FloatArray, FloatArray]:
    grown = np.expm1(np.minimum(z, 0))
    return np.where(z > 0, z, grown), np.where(z > 0, 1.0, grown + 1)


def _tanh(z: FloatArray) -> tuple[FloatArray, FloatArray]:
    values = np.tanh(z)
    return values, 1 - values**2


def _gelu(z: FloatArray) -> tuple[FloatArray, FloatArray]:
    root, cubic = np.sqrt(2 / np.pi), 0.044715
    t = np.tanh(root * (z + cubic * z**3))
    slope = 0.5 * (1 + t) + 0.5 * z * (1 - t**2) * root * (1 + 3 * cubic * z**2)
    return 0.5 * z * (1 + t), slope


ACTIVATIONS: dict[str, Callable[[FloatArray], tuple[FloatArray, FloatArray]]] = {
    "identity": lambda z: (z, np.ones(z.shape)),
    "relu": lambda z: (np.maximum(z, 0), np.where(z > 0, 1.0, 0.0)),
    "elu": _elu,
    "tanh": _tanh,
    "gelu": _gelu,
    "cubic": lambda z: (z**3, 3 * z**2),
}
"""Value and slope of the activations of ``slide_fmu.network.base`` by name."""


def pull_back_block(network: Network, features: Float32Array, n_out: int) -> PullBack:
    """Reverse mode of ``Network.block`` after its features.

    Args:
        network: of either family.
        features: of input windows, shape (B, n_in, n_features).
        n_out: samples of an output window.

    Returns:
        A function from weights of the values, shape (B, n_out, n_outputs), to the gradient of
        their weighted sum with respect to the features, shape (B, n_in, n_features).

    Raises:
        TypeError: a family without derivatives.
    """
    seen = features.astype(np.float64)
    if isinstance(network, FeedForward):
        return _pull_back_layers(network, seen, n_out)
    if isinstance(network, StateSpace):
        return _CellTape(network, seen, n_out).pull_back
    raise TypeError(f"no derivatives of networks of type {type(network).__name__}")


def _pull_back_layers(network: FeedForward, features: FloatArray, n_out: int) -> PullBack:
    """One evaluation that gives a block of samples, or one at each of n_out positions."""
    n_samples, (batch, _, n_features) = network.n_samples, features.shape
    positions = features.shape[1] - n_samples + 1
    seen = [n_samples - 1 - age for age in network.ages] or list(range(n_samples))
    windows = [features[:, first : first + n_samples][:, seen] for first in range(positions)]
    flat = np.stack(windows, axis=1).reshape(batch * positions, -1)
    slopes = _layer_slopes(network.layers, flat)

    def pull_back(weights: FloatArray) -> FloatArray:
        of_values = weights.reshape(batch * positions, -1)
        of_layer = of_values
        for layer, slope in zip(reversed(network.layers), reversed(slopes), strict=True):
            of_layer = (of_layer * slope) @ layer.weights
        if network.skip is not None:
            of_layer = of_layer + of_values @ network.skip
        parts = of_layer.reshape(batch, positions, len(seen), n_features)
        gradient = np.zeros(features.shape)
        for first in range(positions):
            gradient[:, [first + age for age in seen]] += parts[:, first]
        return gradient

    return pull_back


def _layer_slopes(layers: tuple[Layer, ...], flat: FloatArray) -> list[FloatArray]:
    """Slopes of the activations of every layer."""
    hidden, slopes = flat, []
    for layer in layers:
        hidden, slope = ACTIVATIONS[layer.activation](hidden @ layer.weights.T + layer.bias)
        slopes.append(slope)
    return slopes


class _CellTape:
    """One run of a cell from x = 0 over windows, and its way back. Final."""

    def __init__(self, network: StateSpace, features: FloatArray, n_out: int) -> None:
        self._network, self._n_out = network, n_out
        self._features = np.moveaxis(features, 1, 0)
        count, batch, _ = self._features.shape
        self._states = np.zeros((count + 1, batch, len(network.cell.a)))
        for k, f in enumerate(self._features):
            self._states[k + 1] = self._advance(self._states[k], f)

    def _role(self, f: FloatArray, name: str) -> FloatArray:
        """The features of a role: (B, n_features) to (B, ...)."""
        return np.asarray(f[:, list(getattr(self._network.roles, name))])

    def _units(self, x: FloatArray, f: FloatArray) -> tuple[FloatArray, ...]:
        """Units and the slope of their activation; of gated ones their gates, its slope, and what
        is offered to them."""
        cell = self._network.cell
        seen_by_w = self._role(f, "schedule")
        if cell.v is None:
            seen_by_w = np.concatenate([x, self._role(f, "drive")], axis=1)
        arguments = _product(seen_by_w, cell.w[:, :-1]) + cell.w[:, -1]
        if cell.v is None:
            return ACTIVATIONS[cell.activation](arguments)
        seen = _turned(x, self._role(f, "turn"), self._network.turned, back=True)
        offered = _product(np.concatenate([seen, self._role(f, "gated")], axis=1), cell.v)
        return *_tanh(arguments), offered

    def _advance(self, x: FloatArray, f: FloatArray) -> FloatArray:
        cell, (units, _, *offered) = self._network.cell, self._units(x, f)
        pushed = (units * offered[0] if offered else units) @ cell.e.T
        pushed = _turned(pushed, self._role(f, "turn"), self._network.turned)
        return np.asarray(x @ cell.a.T + self._role(f, "drive") @ cell.b.T + pushed)

    def pull_back(self, weights: FloatArray) -> FloatArray:
        """Weights (B, n_out, n_outputs) to the gradient of the features, (B, n_in, n_features)."""
        gradient, of_x = np.zeros(self._features.shape), np.zeros(self._states.shape[1:])
        first = len(self._features) - self._n_out
        for k in reversed(range(len(self._features))):
            if k >= first:
                of_x = of_x + self._pull_back_values(k, weights[:, k - first], gradient[k])
            of_x = self._pull_back_step(k, of_x, gradient[k])
        return np.moveaxis(gradient, 0, 1)

    def _add(self, gradient: FloatArray, role: str, values: FloatArray) -> None:
        """Add to the gradient of the features of a role; some may serve twice."""
        for place, feature in enumerate(getattr(self._network.roles, role)):
            gradient[:, feature] += values[:, place]

    def _pull_back_values(self, k: int, weights: FloatArray, gradient: FloatArray) -> FloatArray:
        """What weights (B, n_outputs) of the values after an input give to the state after it."""
        cell, f, x = self._network.cell, self._features[k], self._states[k + 1]
        readout = self._role(f, "readout")
        factors = np.concatenate([np.ones((len(f), 1)), readout], axis=1)
        rows = x @ cell.c.T + self._role(f, "static") @ cell.d.T + cell.d0
        rows = rows.reshape(*weights.shape, -1)
        self._add(gradient, "readout", np.einsum("bp,bpr->br", weights, rows[:, :, 1:]))
        of_rows = (weights[:, :, None] * factors[:, None]).reshape(len(f), -1)
        self._add(gradient, "static", of_rows @ cell.d)
        return np.asarray(of_rows @ cell.c)

    def _pull_back_step(self, k: int, of_next: FloatArray, gradient: FloatArray) -> FloatArray:
        """From the state after an input to that before it."""
        cell, f, x = self._network.cell, self._features[k], self._states[k]
        self._add(gradient, "drive", of_next @ cell.b)
        if cell.v is not None:
            return of_next @ cell.a + self._pull_back_gated(k, of_next, gradient)
        n, (_, slope) = len(cell.a), self._units(x, f)
        inner = (of_next @ cell.e * slope) @ cell.w[:, :-1]
        self._add(gradient, "drive", inner[:, n:])
        return np.asarray(of_next @ cell.a + inner[:, :n])

    def _pull_back_gated(self, k: int, of_next: FloatArray, gradient: FloatArray) -> FloatArray:
        network, f, x = self._network, self._features[k], self._states[k]
        cell, turn, pairs = network.cell, self._role(f, "turn"), network.turned
        assert cell.v is not None
        gates, slope, offered = self._units(x, f)
        of_units = _turned(of_next, turn, pairs, back=True) @ cell.e
        of_products = (of_units * gates) @ cell.v
        n = len(cell.a)
        self._add(gradient, "schedule", (of_units * offered * slope) @ cell.w[:, :-1])
        self._add(gradient, "gated", of_products[:, n:])
        if pairs > 0:
            pushed = (gates * offered) @ cell.e.T
            of_turn = _of_turn(of_next, pushed, pairs)
            of_turn += _of_turn(of_products[:, :n], x, pairs) * _BACK
            self._add(gradient, "turn", of_turn)
        return _turned(of_products[:, :n], turn, pairs)


def _product(vectors: FloatArray, matrix: Float32Array) -> FloatArray:
    """Matrix (m, n) times vectors (B, n), shape (B, m)."""
    return np.asarray(vectors @ matrix.T, dtype=np.float64)


_BACK = np.array([1.0, -1.0])
"""Factors on cosine and sine that make the opposite turn."""


def _pairs(vectors: FloatArray, pairs: int) -> tuple[FloatArray, FloatArray]:
    return vectors[:, 0 : 2 * pairs : 2], vectors[:, 1 : 2 * pairs : 2]


def _turned(vectors: FloatArray, turn: FloatArray, pairs: int, back: bool = False) -> FloatArray:
    """Vectors (B, n) whose first pairs are turned by an angle with cosine and sine (B, 2)."""
    if pairs == 0:
        return vectors
    c, s = np.split(turn * _BACK if back else turn, 2, axis=1)
    (x, y), result = _pairs(vectors, pairs), vectors.copy()
    result[:, 0 : 2 * pairs : 2], result[:, 1 : 2 * pairs : 2] = c * x - s * y, s * x + c * y
    return result


def _of_turn(weights: FloatArray, vectors: FloatArray, pairs: int) -> FloatArray:
    """Gradient of weights (B, n) times turned vectors, with respect to cosine and sine, (B, 2)."""
    (a, b), (x, y) = _pairs(weights, pairs), _pairs(vectors, pairs)
    return np.stack([(a * x + b * y).sum(axis=1), (b * x - a * y).sum(axis=1)], axis=1)
