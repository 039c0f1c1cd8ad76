"""State-space networks: one small cell, run along the inputs, evaluated in three ways.

The cell, with the features f_k of the scaled inputs and z_k = [x_k, f_k, 1]:

    x_{k+1} = A x_k + B f_k + E act(W z_k)
    y_{k+1} = C x_{k+1} + D f_k + d0

- Window: n_samples cells from x = 0; the values are a pure function of the window.
- Recursive: one cell per sample, never restarted; it forgets by contraction alone.
- Ping-pong: two states, restarted in turn, one cell each per sample. Memory is strictly finite
  and a step still costs two cells, whatever the window: the way of the FMU.

They differ by what the cell has not forgotten. The ping-pong measures that between its restarts:
the truncation error, see ``StateSpace.ping_pong``. (With differences among the features, windows
of long records also differ in their first two samples: alone, a window counts its first input as
held before it; within a record, the inputs before it are known.)
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slide_fmu.network import ACTIVATIONS, Float32Array, Network, Stepper, check_sequences

CELL_ACTIVATIONS = ("tanh", "cubic")
"""Activations that a cell may have: odd, and both exact and fast in the C runtime."""

MAX_DIFFERENCES = 2
"""Highest order of the differences among the features."""

CHUNK = 1 << 16
"""Samples evaluated at once: bounds the memory of a long prediction."""


@dataclass(frozen=True, eq=False)
class Cell:
    """Weights of the cell: n states, q features, H units, p values; all float32.

    Attributes:
        a: shape (n, n).
        b: shape (n, q).
        e: shape (n, H).
        w: shape (H, n + q + 1), its columns in the order of z = [x, f, 1].
        c: shape (p, n).
        d: shape (p, q).
        d0: shape (p,).
        activation: one of ``CELL_ACTIVATIONS``; without units (H = 0) the cell is linear.

    Raises:
        ValueError: shapes differ, values are not finite, or the activation is unknown.
    """

    a: Float32Array
    b: Float32Array
    e: Float32Array
    w: Float32Array
    c: Float32Array
    d: Float32Array
    d0: Float32Array
    activation: str = "tanh"

    def __post_init__(self) -> None:
        if self.activation not in CELL_ACTIVATIONS:
            raise ValueError(
                f"cell: activation {self.activation!r}; expected one of {list(CELL_ACTIVATIONS)}"
            )
        if self.a.ndim != 2 or min(self.b.ndim, self.e.ndim, self.c.ndim) != 2:
            raise ValueError("cell: a, b, e or c is no matrix; expected two axes each")
        n, q, units, values = len(self.a), self.b.shape[1], self.e.shape[1], len(self.c)
        if n < 1 or values < 1:
            raise ValueError(f"cell of {n} states and {values} values; expected at least one each")
        expected = {
            "a": (n, n),
            "b": (n, q),
            "e": (n, units),
            "w": (units, n + q + 1),
            "c": (values, n),
            "d": (values, q),
            "d0": (values,),
        }
        for name, shape in expected.items():
            self._check(name, getattr(self, name), shape)

    def _check(self, name: str, weights: Float32Array, shape: tuple[int, ...]) -> None:
        if weights.shape != shape or weights.dtype != np.float32:
            raise ValueError(
                f"cell: {name} of shape {weights.shape}, {weights.dtype}; expected {shape}, "
                "float32"
            )
        if not np.all(np.isfinite(weights)):
            raise ValueError(f"cell: a weight of {name} is not finite; was the training stable?")

    def count_parameters(self) -> int:
        """Number of weights."""
        values = [getattr(self, field.name) for field in fields(self)]
        return sum(value.size for value in values if isinstance(value, np.ndarray))


class StateSpace(Network):
    """A cell along a sequence of scaled inputs. Final.

    The features are the scaled inputs u, all channels, and behind them their differences,
    u_k - u_{k-1} and u_k - 2 u_{k-1} + u_{k-2}, each divided by its ``feature_scale``. They are
    formed in float64 and then rounded. Inputs before a sequence count as equal to its first.

    Args:
        cell: the weights.
        n_samples: inputs that a state sees before it counts: n_in of the window.
        n_out: samples over which the ping-pong fades to its younger state: n_out of the window.
        n_channels: number of input channels.
        differences: highest order of the differences among the features, 0 to 2.
        feature_scale: shape (q,), q = n_channels (differences + 1); ones if not given.

    Raises:
        ValueError: sizes do not fit, or a scale is not positive and finite.
    """

    def __init__(
        self,
        cell: Cell,
        n_samples: int,
        n_out: int,
        n_channels: int,
        differences: int = 0,
        feature_scale: NDArray[Any] | None = None,
    ) -> None:
        if not 1 <= n_out <= n_samples:
            raise ValueError(
                f"state-space network: n_samples = {n_samples}, n_out = {n_out}; "
                "expected 1 <= n_out <= n_samples"
            )
        if not 0 <= differences <= MAX_DIFFERENCES:
            raise ValueError(
                f"state-space network: differences = {differences}; "
                f"expected 0 to {MAX_DIFFERENCES}"
            )
        n_features = n_channels * (differences + 1)
        if n_channels < 1 or cell.b.shape[1] != n_features:
            raise ValueError(
                f"state-space network: {n_channels} channels with differences to order "
                f"{differences} make {n_features} features, but the cell takes {cell.b.shape[1]}"
            )
        scale = np.ones(n_features) if feature_scale is None else np.asarray(feature_scale)
        scale = scale.astype(np.float32)
        if scale.shape != (n_features,) or not np.all(np.isfinite(scale) & (scale > 0)):
            raise ValueError(
                f"state-space network: feature scale {scale.tolist()}; expected {n_features} "
                "positive, finite numbers"
            )
        self.cell = cell
        self.n_samples = n_samples
        self.n_needed = n_samples - n_out + 1
        self.n_out = n_out
        self.n_channels = n_channels
        self.n_values = len(cell.c)
        self.differences = differences
        self.feature_scale = scale
        n = len(cell.a)  # what W, A and B, D share, in one product each
        self._of_states = np.ascontiguousarray(np.concatenate([cell.w[:, :n], cell.a]).T)
        self._of_features = np.concatenate([cell.w[:, n:-1], cell.b, cell.d]).T
        self._constant = np.concatenate([cell.w[:, -1], np.zeros(n, np.float32), cell.d0])

    @property
    def is_affine(self) -> bool:
        return len(self.cell.w) == 0

    def count_parameters(self) -> int:
        return self.cell.count_parameters()

    def evaluate(self, sequences: NDArray[Any]) -> Float32Array:
        return self.block(sequences, 1)[:, 0]

    def block(self, sequences: NDArray[Any], n_out: int) -> Float32Array:
        """The last values of one run over each window; see ``Network.block``.

        The oldest of them has seen n_samples - n_out + 1 inputs.
        """
        check_sequences(self, sequences)
        rows = max(1, CHUNK // self.n_samples)
        parts = [
            self.run(self.features(sequences[first : first + rows]))[0][:, -n_out:]
            for first in range(0, len(sequences), rows)
        ]
        return np.concatenate(parts)

    def stream(self, records: NDArray[Any]) -> Float32Array:
        return self.ping_pong(records)[0]

    def ping_pong(self, records: NDArray[Any]) -> tuple[Float32Array, Float32Array]:
        """Values at every sample of long records, by two states that are restarted in turn.

        The older state has seen between n_samples and 2 n_samples inputs. When the younger has
        seen n_samples, it becomes the older and a new one starts from x = 0. Until then the
        values fade from the older to the younger over the last n_out samples: no jump. What the
        younger changes in the values is what its shorter memory costs: the truncation error is
        the largest of that between two hand-overs, kept until the next one. The first input
        counts as held for ever before: the first sample is a hand-over after 2 n_samples of it.

        Args:
            records: scaled inputs, shape (B, N, n_channels), N >= 1.

        Returns:
            Values and truncation errors, shape (B, N, n_values) each.
        """
        rows = max(1, CHUNK // (records.shape[1] + 2 * self.n_samples))
        parts = [
            self._ping_pong(records[first : first + rows])
            for first in range(0, len(records), rows)
        ]
        values, errors = zip(*parts, strict=True)
        return np.concatenate(values), np.concatenate(errors)

    def _ping_pong(self, records: NDArray[Any]) -> tuple[Float32Array, Float32Array]:
        """All segments of n_samples between hand-overs at once, each from x = 0."""
        n, (count, length, _) = self.n_samples, records.shape
        segments = 2 + -(-(length - 1) // n)
        lead, tail = 2 * n - 1, (segments - 2) * n - (length - 1)
        padded = np.pad(records, ((0, 0), (lead, tail), (0, 0)), mode="edge")
        features = self.features(padded).reshape(count, segments, n, -1)
        rows = features.reshape(count * segments, n, -1)
        younger, states = self.run(rows)
        states = states.reshape(count, segments, -1)[:, :-1].reshape(-1, states.shape[-1])
        older, _ = self.run(features[:, 1:].reshape(count * (segments - 1), n, -1), states)
        younger = younger.reshape(count, segments, n, -1)[:, 1:]
        older = older.reshape(younger.shape)
        faded = self.fade()[:, None] * (younger - older)
        values = older + faded
        errors = np.repeat(np.abs(faded).max(axis=2), n, axis=1)
        shown = slice(n - 1, n - 1 + length)
        kept = errors[:, :length]  # of the hand-over at or before each sample
        return values.reshape(count, -1, self.n_values)[:, shown], kept

    def fade(self) -> Float32Array:
        """Weight of the younger state at its ages 1 to n_samples, shape (n_samples,)."""
        ages = np.arange(1, self.n_samples + 1) - (self.n_samples - self.n_out)
        return (np.maximum(ages, 0) / self.n_out).astype(np.float32)

    def recursive(self, records: NDArray[Any]) -> Float32Array:
        """Values at every sample by one state that is never restarted.

        Args:
            records: as for ``ping_pong``; the first input counts as held for n_samples.

        Returns:
            Values, shape (B, N, n_values).
        """
        padded = np.pad(records, ((0, 0), (self.n_samples - 1, 0), (0, 0)), mode="edge")
        return self.run(self.features(padded))[0][:, self.n_samples - 1 :]

    def stepper(self) -> PingPong:
        return PingPong(self)

    def features(self, sequences: NDArray[Any]) -> Float32Array:
        """Features f of scaled inputs: (B, N, n_channels) to (B, N, q), float32."""
        latest = np.asarray(sequences, dtype=np.float64)
        blocks = [latest]
        for _ in range(self.differences):
            latest = np.diff(latest, axis=1, prepend=latest[:, :1])
            blocks.append(latest)
        scaled = np.concatenate(blocks, axis=2) / self.feature_scale.astype(np.float64)
        return scaled.astype(np.float32)

    def run(
        self, features: Float32Array, states: Float32Array | None = None
    ) -> tuple[Float32Array, Float32Array]:
        """One cell after the other along sequences of features.

        Args:
            features: shape (B, N, q).
            states: x before the first of them, shape (B, n); zero if not given.

        Returns:
            Values after each, shape (B, N, n_values), and x after the last, shape (B, n).
        """
        cell, act = self.cell, ACTIVATIONS[self.cell.activation]
        n, units = len(cell.a), len(cell.w)
        driven = np.moveaxis(features, 1, 0) @ self._of_features + self._constant
        x = np.zeros((len(features), n), np.float32) if states is None else states
        values = driven[:, :, units + n :]
        for row, value in zip(driven, values, strict=True):
            total = x @ self._of_states + row[:, : units + n]
            x = total[:, units:] + act(total[:, :units]) @ cell.e.T
            value += x @ cell.c.T
        return np.ascontiguousarray(np.moveaxis(values, 0, 1)), x


class PingPong(Stepper):
    """The ping-pong of ``StateSpace.ping_pong``, step by step. Final."""

    def __init__(self, network: StateSpace) -> None:
        self._network = network
        self._fade = network.fade()
        self._recent: NDArray[np.float64] | None = None
        self._states = np.zeros((2, len(network.cell.a)), np.float32)
        self._age = 0
        self._largest = np.zeros(network.n_values, np.float32)
        self._error: Float32Array | None = None

    def step(self, row: NDArray[Any]) -> Float32Array:
        newest = np.asarray(row, dtype=np.float64)
        if self._recent is None:
            self._recent = np.repeat(newest[None], MAX_DIFFERENCES + 1, axis=0)
            for _ in range(2 * self._network.n_samples):
                values = self._advance()
            return values
        self._recent = np.concatenate([self._recent[1:], newest[None]])
        return self._advance()

    def _advance(self) -> Float32Array:
        """Take the newest input into both states; older first."""
        network = self._network
        assert self._recent is not None
        features = network.features(self._recent[None])[:, -1:]
        pairs, self._states = network.run(np.repeat(features, 2, axis=0), self._states)
        older, younger = pairs[:, 0]
        faded = self._fade[self._age] * (younger - older)
        values = older + faded
        self._largest = np.maximum(self._largest, np.abs(faded))
        self._age += 1
        if self._age == network.n_samples:
            self._error, self._largest = self._largest, np.zeros_like(self._largest)
            self._states = np.stack([self._states[1], np.zeros_like(self._states[1])])
            self._age = 0
        return np.asarray(values, dtype=np.float32)

    @property
    def truncation_error(self) -> Float32Array | None:
        return self._error
