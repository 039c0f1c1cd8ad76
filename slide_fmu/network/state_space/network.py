"""State-space networks run one small cell along the inputs; there are two ways to evaluate them.

- Window: n_samples cells from x = 0; the values are a pure function of the window.
- Ping-pong: two states, restarted alternately, one cell each per sample. The memory is strictly
finite, and a step costs two cells for any window: the FMU evaluates this way.

They differ by what the cell has not yet forgotten. The ping-pong measures this between its
restarts: the truncation error, see ``StateSpace.ping_pong``. (With changes among the features,
windows of long sequences also differ in their first samples: a single window counts as constant
before its first input; within a sequence, the inputs before it are known.)
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, final

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
"""Number of samples evaluated at once; it limits the memory of a long prediction."""


@final
class StateSpace(Network, Parametric):
    """A StateSpace is a cell along a sequence of scaled inputs.

    Inputs before a sequence count as equal to its first.

    Args:
        cell: the weights, or their polynomials of parameters. For polynomials, ``cell`` is the
            cell at the parameters' start values.
        n_samples: number of inputs that a state takes before it is used: n_in of the window.
        n_out: samples over which the ping-pong fades to its younger state: n_out of the window.
        features: the features formed from the inputs.
        roles: the role of each feature; by default all are drive and static.
        turned: number of pairs of states, from the first, that gated units see in the turned
            frame.

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
        """Reject sizes that differ from the window and the outputs."""
        sizes = (self.n_samples, self.n_out, self.n_values)
        expected = (window.n_in, window.n_out, n_outputs)
        if sizes != expected:
            raise ValueError(
                f"state-space network with n_samples, n_out, n_values = {sizes}; "
                f"expected {expected}, those of the window and the outputs"
            )

    def block_length(self, n_outputs: int) -> int:
        """Return the number of samples of the output window, along which the cell runs."""
        return self.n_out

    @property
    def measures_truncation(self) -> bool:
        """True: the truncation error is the change by the younger state of the ping-pong."""
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
        """Return the network with other start values of its parameters, (n_parameters,)."""
        return self if self.polynomial is None else self._with(self.polynomial.starting_at(values))

    def _with(self, cell: Cell | CellPolynomial) -> StateSpace:
        return StateSpace(cell, self.n_samples, self.n_out, self.features, self.roles, self.turned)

    def evaluate(self, sequences: NDArray[Any]) -> Float32Array:
        return self.block(sequences, 1)[:, 0]

    def block(self, sequences: NDArray[Any], n_out: int) -> Float32Array:
        """Return the last values of one run over each window; see ``Network.block``.

        The oldest value depends on n_samples - n_out + 1 inputs.
        """
        checked_batch("sequences", sequences, (self.n_samples, self.n_channels))
        parts = [
            self.run(self.features.along(sequences[some]))[0][:, -n_out:]
            for some in batches(len(sequences), CHUNK // self.n_samples)
        ]
        return np.concatenate(parts)

    def stream(self, sequences: NDArray[Any]) -> Float32Array:
        return self.ping_pong(sequences)[0]

    def ping_pong(self, sequences: NDArray[Any]) -> tuple[Float32Array, Float32Array]:
        """Evaluate long sequences at every sample, by two states that are restarted alternately.

        The older state has run over n_samples to 2 n_samples inputs. When the younger one has run
        over n_samples, it becomes the older one and a new state starts from x = 0. Until then the
        values fade from the older to the younger state over the last n_out samples, without a
        jump. The change of the values by the younger state is the effect of its shorter memory.
        The truncation error is the largest such change between two hand-overs, kept until the next
        one. The first input counts as constant before the start, so the first sample is a
        hand-over after 2 n_samples of it. Sequences as for ``stream`` give values and truncation
        errors, (B, N, n_values) each.
        """
        some = self._together(sequences)
        values, errors, _ = _joined(
            self._segments(self.features.along(sequences[k])) for k in some
        )
        return values, errors

    def ping_pong_states(
        self, features: Float32Array, newest: Float32Array | None = None
    ) -> tuple[Float32Array, Float32Array]:
        """Evaluate features of long sequences by ``ping_pong``: values, and x of the older state.

        Features (B, N, q) as from ``features.along`` give values (B, N, n_values) and x after
        every sample, (B, N, n). If ``newest`` is given, (B, N, q), each result is computed with
        ``newest`` at its own sample, and with ``features`` at the samples before.
        """
        some = self._together(features)
        values, _, states = _joined(
            self._segments(features[k], None if newest is None else newest[k]) for k in some
        )
        return values, states

    def _together(self, sequences: NDArray[Any]) -> list[slice]:
        """Return slices of long sequences that are evaluated at once, to limit the memory."""
        return batches(len(sequences), CHUNK // (sequences.shape[1] + 2 * self.n_samples))

    def _segments(
        self, along: Float32Array, newest: Float32Array | None = None
    ) -> tuple[Float32Array, Float32Array, Float32Array]:
        """Run all segments of n_samples between hand-overs at once, each from x = 0.

        Features (B, N, q) give values and truncation errors, (B, N, n_values) each, and x of the
        older state, (B, N, n). Before the start the features count as constant. ``newest`` is as
        for ``ping_pong_states``.
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
        kept = errors[:, :length]  # the truncation error of the last hand-over at each sample
        values = values.reshape(count, -1, self.n_values)[:, shown]
        return values, kept, after.reshape(count, -1, after.shape[-1])[:, shown]

    def fade(self) -> Float32Array:
        """Return the weight of the younger state at its ages 1 to n_samples, (n_samples,)."""
        ages = np.arange(1, self.n_samples + 1) - (self.n_samples - self.n_out)
        return np.asarray(np.maximum(ages, 0) / self.n_out, dtype=np.float32)

    def run(
        self, features: Float32Array, states: Float32Array | None = None
    ) -> tuple[Float32Array, Float32Array]:
        """Run the cell along sequences of features, shape (B, N, q), from states x, shape (B, n).

        The states are zero if not given. The results are the values after each sample, shape (B,
        N, n_values), and x after the last sample.
        """
        x = np.zeros((len(features), len(self.cell.a)), np.float32) if states is None else states
        values, after = self._path(features, x)
        return np.ascontiguousarray(values), after[:, -1]

    def _path(
        self, features: Float32Array, states: Float32Array
    ) -> tuple[Float32Array, Float32Array]:
        """Return values and x after every sample, (B, N, n_values) and (B, N, n)."""
        inputs = ByRole.of(self.roles, np.moveaxis(features, 1, 0))
        after = Equations(self.cell, inputs, self.turned, np).run(states)
        values = outputs(self.cell, after, inputs)
        return np.moveaxis(values, 0, 1), np.moveaxis(after, 0, 1)

    def _newest(
        self, features: Float32Array, begun: Float32Array, path: Float32Array
    ) -> tuple[Float32Array, Float32Array]:
        """Return values and x after each sample, with the newest features at that sample only.

        The sequences (B, N, q) began at states (B, n); ``path``, (B, N, n), has their states.
        """
        before = np.concatenate([begun[:, None], path[:, :-1]], axis=1)
        rows = features.reshape(-1, 1, features.shape[2])
        values, after = self._path(rows, before.reshape(-1, before.shape[2]))
        shape = *features.shape[:2], -1
        return values.reshape(shape), after.reshape(shape)


def _joined(
    parts: Iterable[tuple[Float32Array, Float32Array, Float32Array]],
) -> tuple[Float32Array, Float32Array, Float32Array]:
    """Join arrays of several groups of sequences."""
    first, second, third = (np.concatenate(part) for part in zip(*parts, strict=True))
    return first, second, third
