"""State-space networks: one small cell, run along the inputs, evaluated in two ways.

- Window: n_samples cells from x = 0; the values are a pure function of the window.
- Ping-pong: two states, restarted in turn, one cell each per sample. Memory is strictly finite
  and a step still costs two cells, whatever the window: the way of the FMU.

They differ by what the cell has not forgotten. The ping-pong measures that between its restarts:
the truncation error, see ``StateSpace.ping_pong``. (With changes among the features, windows of
long records also differ in their first samples: alone, a window counts its first input as held
before it; within a record, the inputs before it are known.)
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.parameters import Parameter, starts_of
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import Window, checked_batch
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.network.base import Float32Array, Network, Parametric, batches
from slide_fmu.network.state_space.cell import Cell, Roles, check_cell
from slide_fmu.network.state_space.equations import ByRole, Equations, outputs
from slide_fmu.network.state_space.polynomial import CellPolynomial

CHUNK = 1 << 16
"""Samples evaluated at once: bounds the memory of a long prediction."""


class StateSpace(Network, Parametric):
    """A cell along a sequence of scaled inputs. Final.

    Inputs before a sequence count as equal to its first.

    Args:
        cell: the weights; or polynomials of parameters for them, then the cell is that at the
            parameters' start values.
        n_samples: inputs that a state sees before it counts: n_in of the window.
        n_out: samples over which the ping-pong fades to its younger state: n_out of the window.
        features: what it sees of the inputs.
        roles: what the features are for; all are drive and static part if not given.
        turned: pairs of states, the first ones, that gated units see in the turned frame.

    Raises:
        ValueError: sizes do not fit.
    """

    def __init__(
        self,
        cell: Cell | CellPolynomial,
        n_samples: int,
        n_out: int,
        features: FeatureMap,
        roles: Roles | None = None,
        turned: int = 0,
    ) -> None:
        if not 1 <= n_out <= n_samples:
            raise ValueError(
                f"state-space network: n_samples = {n_samples}, n_out = {n_out}; "
                "expected 1 <= n_out <= n_samples"
            )
        every = tuple(range(features.n_signals))
        self.roles = Roles(drive=every, static=every) if roles is None else roles
        self.polynomial = cell if isinstance(cell, CellPolynomial) else None
        if isinstance(cell, CellPolynomial):
            for term in cell.terms:
                check_cell(term, self.roles, features.n_signals, turned)
            cell = cell.at(starts_of(cell.basis.parameters))
        check_cell(cell, self.roles, features.n_signals, turned)
        self.cell = cell
        self.features = features
        self.turned = turned
        self.n_samples = n_samples
        self.memory_length = n_samples - n_out + 1
        self.n_out = n_out
        self.n_channels = features.n_channels
        self.n_values = len(cell.c) // (1 + len(self.roles.readout))

    def require_window(self, window: Window, n_outputs: int) -> None:
        """Reject sizes other than those of the window and of the outputs."""
        found = (self.n_samples, self.n_out, self.n_values)
        expected = (window.n_in, window.n_out, n_outputs)
        if found != expected:
            raise ValueError(
                f"state-space network with n_samples, n_out, n_values = {found}; "
                f"expected {expected}, those of the window and the outputs"
            )

    def block_length(self, n_outputs: int) -> int:
        """Give the samples of the output window, along which the cell runs."""
        return self.n_out

    @property
    def measures_truncation(self) -> bool:
        """It is true: by what the younger state of the ping-pong changes."""
        return True

    @property
    def is_affine(self) -> bool:
        plain = self.features.features.linear and not self.roles.readout
        return len(self.cell.w) == 0 and plain

    def count_parameters(self) -> int:
        terms = 1 if self.polynomial is None else len(self.polynomial.terms)
        return terms * int(sum(array.size for array in self.cell.arrays().values()))

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return () if self.polynomial is None else self.polynomial.basis.parameters

    def at(self, values: FloatArray) -> StateSpace:
        if self.polynomial is None:
            return self
        return self._with(self.polynomial.at(values))

    def starting_at(self, values: FloatArray) -> StateSpace:
        """Give the network whose parameters start at values, (n_parameters,), in their units."""
        return self if self.polynomial is None else self._with(self.polynomial.starting_at(values))

    def _with(self, cell: Cell | CellPolynomial) -> StateSpace:
        return StateSpace(cell, self.n_samples, self.n_out, self.features, self.roles, self.turned)

    def evaluate(self, sequences: NDArray[Any]) -> Float32Array:
        return self.block(sequences, 1)[:, 0]

    def block(self, sequences: NDArray[Any], n_out: int) -> Float32Array:
        """Give the last values of one run over each window; see ``Network.block``.

        The oldest of them has seen n_samples - n_out + 1 inputs.
        """
        checked_batch("sequences", sequences, (self.n_samples, self.n_channels))
        parts = [
            self.run(self.features.along(sequences[some]))[0][:, -n_out:]
            for some in batches(len(sequences), CHUNK // self.n_samples)
        ]
        return np.concatenate(parts)

    def stream(self, records: NDArray[Any]) -> Float32Array:
        return self.ping_pong(records)[0]

    def ping_pong(self, records: NDArray[Any]) -> tuple[Float32Array, Float32Array]:
        """Evaluate long records at every sample, by two states that are restarted in turn.

        The older state has seen between n_samples and 2 n_samples inputs. When the younger has
        seen n_samples, it becomes the older and a new one starts from x = 0. Until then the
        values fade from the older to the younger over the last n_out samples: no jump. What the
        younger changes in the values is what its shorter memory costs: the truncation error is
        the largest of that between two hand-overs, kept until the next one. The first input
        counts as held for ever before: the first sample is a hand-over after 2 n_samples of it.

        Records as for ``stream`` give values and truncation errors, (B, N, n_values) each.
        """
        some = self._together(records)
        values, errors, _ = _joined(self._segments(self.features.along(records[k])) for k in some)
        return values, errors

    def ping_pong_states(
        self, features: Float32Array, newest: Float32Array | None = None
    ) -> tuple[Float32Array, Float32Array]:
        """Evaluate the features of long records by ``ping_pong``: values, and the older state's x.

        Features (B, N, q) as of ``features.along`` give values (B, N, n_values) and x after every
        sample, (B, N, n). With ``newest``, likewise, each result is that of the time when its
        sample was the newest one, with these features, and those before it were as they are.
        """
        some = self._together(features)
        values, _, states = _joined(
            self._segments(features[k], None if newest is None else newest[k]) for k in some
        )
        return values, states

    def _together(self, records: NDArray[Any]) -> list[slice]:
        """Give those of long records that are evaluated at once: few enough for the memory."""
        return batches(len(records), CHUNK // (records.shape[1] + 2 * self.n_samples))

    def _segments(
        self, along: Float32Array, newest: Float32Array | None = None
    ) -> tuple[Float32Array, Float32Array, Float32Array]:
        """Run all segments of n_samples between hand-overs at once, each from x = 0.

        Features (B, N, q) give values and truncation errors, (B, N, n_values) each, and the older
        state's x, (B, N, n). While the first input is held, so are its features. The newest
        features are as of ``ping_pong_states``.
        """
        n, (count, length, _) = self.n_samples, along.shape
        segments = 2 + -(-(length - 1) // n)
        lead, tail = 2 * n - 1, (segments - 2) * n - (length - 1)

        def cut(values: Float32Array) -> Float32Array:
            padded = np.pad(values, ((0, 0), (lead, tail), (0, 0)), mode="edge")
            return padded.reshape(count, segments, n, -1)

        features = cut(along)
        rows = features.reshape(count * segments, n, -1)
        begun = np.zeros((len(rows), len(self.cell.a)), np.float32)
        younger, path = self._path(rows, begun)
        states = path[:, -1].reshape(count, segments, -1)[:, :-1].reshape(-1, path.shape[-1])
        further = features[:, 1:].reshape(count * (segments - 1), n, -1)
        older, after = self._path(further, states)
        if newest is not None:
            others = cut(newest)
            younger, _ = self._newest(others.reshape(rows.shape), begun, path)
            older, after = self._newest(others[:, 1:].reshape(further.shape), states, after)
        younger = younger.reshape(count, segments, n, -1)[:, 1:]
        older = older.reshape(younger.shape)
        faded = self.fade()[:, None] * (younger - older)
        values = older + faded
        errors = np.repeat(np.abs(faded).max(axis=2), n, axis=1)
        shown = slice(n - 1, n - 1 + length)
        kept = errors[:, :length]  # of the hand-over at or before each sample
        values = values.reshape(count, -1, self.n_values)[:, shown]
        return values, kept, after.reshape(count, -1, after.shape[-1])[:, shown]

    def fade(self) -> Float32Array:
        """Give the weight of the younger state at its ages 1 to n_samples, shape (n_samples,)."""
        ages = np.arange(1, self.n_samples + 1) - (self.n_samples - self.n_out)
        return np.asarray(np.maximum(ages, 0) / self.n_out, dtype=np.float32)

    def run(
        self, features: Float32Array, states: Float32Array | None = None
    ) -> tuple[Float32Array, Float32Array]:
        """Run the cell along sequences of features, shape (B, N, q), from states x, shape (B, n).

        The states are zero if not given. The results are the values after each sample, shape
        (B, N, n_values), and x after the last one.
        """
        x = np.zeros((len(features), len(self.cell.a)), np.float32) if states is None else states
        values, after = self._path(features, x)
        return np.ascontiguousarray(values), after[:, -1]

    def _path(
        self, features: Float32Array, states: Float32Array
    ) -> tuple[Float32Array, Float32Array]:
        """Values and x after every sample, (B, N, n_values) and (B, N, n)."""
        inputs = ByRole.of(self.roles, np.moveaxis(features, 1, 0))
        after = Equations(self.cell, inputs, self.turned, np).run(states)
        values = outputs(self.cell, after, inputs)
        return np.moveaxis(values, 0, 1), np.moveaxis(after, 0, 1)

    def _newest(
        self, features: Float32Array, begun: Float32Array, path: Float32Array
    ) -> tuple[Float32Array, Float32Array]:
        """Give values and x after each sample as it was the newest, from those before it.

        Of sequences (B, N, q) that began at states (B, n) and passed the path (B, N, n).
        """
        before = np.concatenate([begun[:, None], path[:, :-1]], axis=1)
        rows = features.reshape(-1, 1, features.shape[2])
        values, after = self._path(rows, before.reshape(-1, before.shape[2]))
        shape = *features.shape[:2], -1
        return values.reshape(shape), after.reshape(shape)


def _joined(
    parts: Iterable[tuple[Float32Array, Float32Array, Float32Array]],
) -> tuple[Float32Array, Float32Array, Float32Array]:
    """Join arrays of some records with those of the others."""
    first, second, third = (np.concatenate(part) for part in zip(*parts, strict=True))
    return first, second, third
