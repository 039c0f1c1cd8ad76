"""Linear models are fitted as sections of two states, which takes little time for many states.

Each section has x[k] = A x[k-1] + B f[k] with its own A of 2 x 2 numbers, whose poles are a
conjugate pair or two real ones, and may turn from one to the other. So n states have about
n (2 + q + p) parameters in the place of n (n + q + p), and the outputs and their slopes are sums
of a few filtered signals, of which all products that a least-squares step needs are sums.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import final

import numpy as np
import scipy.signal
import torch
from numpy.typing import NDArray

from slide_fmu.core.measures import TINY
from slide_fmu.core.signals import FloatArray
from slide_fmu.fitting.state_space.cell import CellShape
from slide_fmu.fitting.state_space.levenberg_marquardt import LeastSquares
from slide_fmu.fitting.state_space.normal_equations import NormalEquations
from slide_fmu.fitting.state_space.penalties import PolePenalty
from slide_fmu.fitting.state_space.segments import Segments
from slide_fmu.fitting.state_space.whitening import Whitening

CHUNK = 4_000_000
"""Largest number of values of the filtered signals at a time."""
RIDGE, LEAST_RIDGE = 1e-3, 1e-9
"""Regularisation of the first B and D, relative to the entries of the diagonal of their normal
equations, and to its mean: slow inputs hardly tell the effects of several states and of D apart,
which without the first one are large and cancel."""
IN_DOUBLE = torch.zeros((), dtype=torch.float64)
"""What sections are computed with, on the CPU."""
MOST_ALIKE, SLOWEST_TO_VANISH = 100.0, 0.03
"""A matrix has sections if the condition number of its eigenvectors is at most the first number,
and no pole is below the second one: delays have equal poles near zero."""


@final
@dataclass(frozen=True, eq=False)
class Sections:
    """Sections are the states of a linear model, two by two; the last one may have a single state.

    Attributes:
        a: matrix of each section, shape (sections, 2, 2).
        b: input matrices, shape (sections, 2, q).
        c: output matrices, shape (p, sections, 2).
        d: feedthrough and constant term of each output, shape (p, m + 1).
        odd: whether the last section has its first state only.
    """

    a: FloatArray
    b: FloatArray
    c: FloatArray
    d: FloatArray
    odd: bool

    @staticmethod
    def of(
        a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray, radius: float = math.inf
    ) -> Sections:
        """Return the sections of x[k] = A x[k-1] + B f[k], y[k] = C x[k] + D [w[k], 1].

        Poles outside a radius are pulled in.
        """
        values, vectors = np.linalg.eig(a)
        values = values * np.minimum(1.0, radius / np.maximum(np.abs(values), TINY))
        upper, real = np.flatnonzero(values.imag > 0), np.flatnonzero(values.imag == 0)
        real = real[np.argsort(values[real].real)]
        blocks, basis = [], []
        for i in upper:
            real_part, turn = values[i].real, values[i].imag
            blocks.append([[real_part, turn], [-turn, real_part]])
            basis += [vectors[:, i].real, vectors[:, i].imag]
        for i, j in zip(real[0::2], real[1::2], strict=False):
            blocks.append([[values[i].real, 0.0], [0.0, values[j].real]])
            basis += [vectors[:, i].real, vectors[:, j].real]
        if odd := len(real) % 2:
            blocks.append([[values[real[-1]].real, 0.0], [0.0, 0.0]])
            basis.append(vectors[:, real[-1]].real)
        change = np.stack(basis, axis=1)
        driven, seen = np.linalg.lstsq(change, b, rcond=None)[0], c @ change
        if odd:
            driven, seen = np.pad(driven, ((0, 1), (0, 0))), np.pad(seen, ((0, 0), (0, 1)))
        driven, seen = driven.reshape(len(blocks), 2, -1), seen.reshape(len(c), len(blocks), 2)
        size = np.maximum(np.sqrt(np.sum(seen**2, axis=(0, 2))), TINY)[:, None]
        return Sections(np.array(blocks), driven * size[:, :, None], seen / size, d, bool(odd))

    @staticmethod
    def of_cell(shape: CellShape, theta: torch.Tensor) -> Sections:
        """Return the sections of a plain linear cell with the parameters theta, shape (P,)."""
        cell = shape.split(theta.double().cpu())
        a, b, c, d, constant = (part.numpy() for part in (cell.a, cell.b, cell.c, cell.d, cell.d0))
        return Sections.of(a, b, c, np.concatenate([d, constant[:, None]], axis=1))

    @property
    def exists(self) -> NDArray[np.bool_]:
        """Tell which of ``values`` there are: an odd section has no second state."""
        a, b, c, d = (np.ones(part.shape, bool) for part in self._parts)
        if self.odd:
            a[-1, 1], a[-1, :, 1], b[-1, 1], c[:, -1, 1] = False, False, False, False
        return np.concatenate([part.ravel() for part in (a, b, c, d)])

    @property
    def of_inputs(self) -> NDArray[np.bool_]:
        """Tell which of ``values`` are of B and D, in which the outputs are linear."""
        a, b, c, d = (np.zeros(part.shape, bool) for part in self._parts)
        b[:], d[:] = True, True
        return np.concatenate([part.ravel() for part in (a, b, c, d)])

    @property
    def _parts(self) -> tuple[FloatArray, ...]:
        return self.a, self.b, self.c, self.d

    @property
    def values(self) -> FloatArray:
        """All parameters: A, B, C and D, shape (P,)."""
        return np.concatenate([part.ravel() for part in self._parts])

    def with_values(self, values: FloatArray) -> Sections:
        """Return sections with other parameters, shape (P,)."""
        cuts = np.cumsum([part.size for part in self._parts])[:-1]
        a, b, c, d = (
            new.reshape(part.shape)
            for new, part in zip(np.split(values, cuts), self._parts, strict=True)
        )
        return replace(self, a=a, b=b, c=c, d=d)

    def theta(self, shape: CellShape) -> torch.Tensor:
        """Return the parameters of a cell without hidden units, in float64."""
        n, a = shape.n_states, scipy.linalg.block_diag(*self.a)
        b, c = self.b.reshape(len(a), -1), self.c.reshape(len(self.c), -1)
        parts = a[:n, :n], b[:n], c[:, :n], self.d[:, :-1]
        theta = shape.linear(*(torch.from_numpy(np.ascontiguousarray(part)) for part in parts))
        if shape.bias:
            constant = shape.split(theta[: shape.n_weights]).d0
            constant.view(len(c), -1)[:, 0] = torch.from_numpy(self.d[:, -1])
        return theta


@final
class ModalFit:
    """A ModalFit is the least-squares problem of the sections of a linear cell.

    Args:
        shape: the shape of the cell, without hidden units.
        segments: what it is fitted to.
        begin: sections with the poles, and the directions of the outputs, to begin with.
        penalty: the penalty on slow poles.
        of_cell: the same problem by the cell's own parameters; its sums are taken.
    """

    def __init__(
        self,
        shape: CellShape,
        segments: Segments,
        begin: Sections,
        penalty: PolePenalty,
        of_cell: LeastSquares,
    ) -> None:
        self._shape, self._segments, self._begin = shape, segments, begin
        self._penalty, self._of_cell = penalty, of_cell
        self._exists = begin.exists
        if not shape.bias:
            self._exists = self._exists & ~_of_constant(begin)
        zero = begin.with_values(np.zeros(len(self._exists))).theta(shape)
        units = np.eye(len(self._exists))[self._exists]
        columns = [begin.with_values(unit).theta(shape) - zero for unit in units]
        self._slopes = torch.stack(columns, 1)
        """Slopes of the cell's parameters by those of the sections, (P, free)."""

    def theta(self, values: torch.Tensor) -> torch.Tensor:
        """Return the parameters of the cell for values of the sections, shape (free,)."""
        return self._sections(values).theta(self._shape)

    @property
    def first(self) -> torch.Tensor:
        """The values of the sections to begin with, shape (free,)."""
        return torch.from_numpy(self._begin.values[self._exists])

    def with_best_inputs(self) -> torch.Tensor:
        """Return the values to begin with, but with the best B and D, shape (free,)."""
        chosen = torch.from_numpy(self._begin.of_inputs[self._exists])
        return with_best(self.first, chosen, self._sums(self._begin))

    def least_squares(self) -> LeastSquares:
        """Return the problem by the values of the sections, shape (free,)."""

        def normal(values: torch.Tensor) -> NormalEquations:
            sections = self._sections(values)
            sums, theta = self._sums(sections), sections.theta(self._shape)
            count = len(theta)
            none = NormalEquations(0.0, theta.new_zeros(count, count), theta.new_zeros(count))
            poles, slopes = self._penalty.join(none, self._shape, theta), self._slopes
            return NormalEquations(
                sums.cost + poles.cost,
                sums.matrix + slopes.T @ poles.matrix @ slopes,
                sums.gradient + slopes.T @ poles.gradient,
            )

        return LeastSquares(
            normal,
            lambda values: self._of_cell.cost(self._like(values)),
            self._of_cell.count,
            lambda values: self._of_cell.validation(self._like(values)),
        )

    def _like(self, values: torch.Tensor) -> torch.Tensor:
        return self.theta(values).to(self._segments.features)

    def _sections(self, values: torch.Tensor) -> Sections:
        whole = self._begin.values
        whole[self._exists] = values.double().cpu().numpy()
        return self._begin.with_values(whole)

    def _sums(self, sections: Sections) -> NormalEquations:
        """Return the normal equations of the outputs by the free values, without the penalty."""
        free, p = int(self._exists.sum()), len(sections.c)
        maps = [_map(sections, output)[:, self._exists] for output in range(p)]
        matrix, gradient, cost = np.zeros((free, free)), np.zeros(free), 0.0
        size = max(1, CHUNK // (len(self._segments.features) * len(maps[0])))
        for chunk in self._segments.chunks(size):
            signals, residuals = _signals(self._shape, sections, chunk)
            shared = None
            for output, of_output in enumerate(maps):
                columns, left = signals, residuals[:, :, output]
                if chunk.whitening is not None:
                    own = chunk.whitening.of_output(output).to(IN_DOUBLE)
                    columns, left = (_whitened(own, part) for part in (columns, left[:, :, None]))
                    left, shared = left[:, :, 0], None
                flat = columns.reshape(-1, columns.shape[2])
                shared = flat.T @ flat if shared is None else shared
                matrix += of_output.T @ shared @ of_output
                gradient += of_output.T @ (flat.T @ left.ravel())
                cost += float(np.sum(left**2))
        return NormalEquations(cost, torch.from_numpy(matrix), torch.from_numpy(gradient))


def has_sections(a: FloatArray) -> bool:
    """Tell whether a matrix A, (n, n), can be fitted by sections of two states."""
    values, vectors = np.linalg.eig(a)
    alike = float(np.linalg.cond(vectors))
    return alike <= MOST_ALIKE and float(np.abs(values).min()) >= SLOWEST_TO_VANISH


def with_best(theta: torch.Tensor, chosen: torch.Tensor, normal: NormalEquations) -> torch.Tensor:
    """Return parameters, (P,), of which the chosen ones, (P,), are the best for the others.

    The outputs are linear in them; the normal equations are those at theta.
    """
    matrix, best = normal.matrix[chosen][:, chosen].clone(), theta.clone()
    matrix.diagonal().mul_(1 + RIDGE).add_(LEAST_RIDGE * matrix.diagonal().mean())
    best[chosen] -= torch.linalg.solve(matrix, normal.gradient[chosen])
    return best


def _of_constant(sections: Sections) -> NDArray[np.bool_]:
    """Tell which of the values of sections are the constant terms of the outputs."""
    none = sections.with_values(np.zeros(len(sections.values)))
    d = none.d.copy()
    d[:, -1] = 1.0
    return np.asarray(replace(none, d=d).values > 0)


def _whitened(whitening: Whitening, values: FloatArray) -> FloatArray:
    """Filter values, (samples, B, columns), as residuals of one output."""
    return np.asarray(whitening.along(torch.from_numpy(values)[:, :, None])[:, :, 0])


def _complement(a: FloatArray) -> FloatArray:
    """Return tr(A) I - A: the inverse of I - A/z is (I - this/z) / (1 - tr(A)/z + det(A)/z^2)."""
    return np.asarray(np.trace(a) * np.eye(2) - a)


def _later(values: FloatArray) -> FloatArray:
    """Return values, (N, ...), one sample later, with zeros at first."""
    return np.concatenate([np.zeros_like(values[:1]), values[:-1]])


def _signals(
    shape: CellShape, sections: Sections, segments: Segments
) -> tuple[FloatArray, FloatArray]:
    """Return the signals that slopes are sums of, and the residuals, of the scored samples.

    The signals have the shape (samples, B, sections * (2 q + 4) + m + 1): of each section, the
    state inputs filtered by its poles, now and one sample before; both states, filtered once more,
    one and two samples before. Then come the feedthrough and ones. All have the segments' weights.
    """
    features = segments.features.double().cpu().numpy()
    drive, static = (
        features[:, :, list(shape.roles.drive)],
        features[:, :, list(shape.roles.static)],
    )
    parts, outputs, first = [], 0.0, segments.burn_in
    for k, a in enumerate(sections.a):
        denominator = np.array([1.0, -np.trace(a), np.linalg.det(a)])
        passed = scipy.signal.lfilter([1.0], denominator, drive, axis=0)
        before, mixed = _later(passed), _complement(a) @ sections.b[k]
        states = passed @ sections.b[k].T - before @ mixed.T
        again = scipy.signal.lfilter([0.0, 1.0], denominator, states, axis=0)
        parts += [part[first:] for part in (passed, before, again, _later(again))]
        outputs = outputs + states[first:] @ sections.c[:, k].T
    static = static[first:]
    parts += [static, np.ones((*static.shape[:2], 1))]
    outputs = outputs + np.concatenate(parts[-2:], axis=2) @ sections.d.T
    weights = segments.weights.double().cpu().numpy()[:, None]
    residuals = outputs - segments.targets.double().cpu().numpy()
    return weights * np.concatenate(parts, axis=2), weights * residuals


def _map(sections: Sections, output: int) -> FloatArray:
    """Return the slopes of an output by all values, as sums of ``_signals``: (signals, P)."""
    (count, _, q), size = sections.b.shape, sections.values.size
    places = sections.with_values(np.arange(size, dtype=float))
    width = 2 * q + 4
    of_static = count * width + np.arange(sections.d.shape[1])
    result = np.zeros((count * width + sections.d.shape[1], size))
    for k, a in enumerate(sections.a):
        now, before = k * width + np.arange(q), k * width + q + np.arange(q)
        again, once_more = k * width + 2 * q + np.arange(2), k * width + 2 * q + 2 + np.arange(2)
        of_a, of_b = _numbers(places.a[k]), _numbers(places.b[k])
        of_c, mixed = _numbers(places.c[output, k]), _complement(a) @ sections.b[k]
        # what an input of each state adds to the output at once, and one sample later
        at_once, later = sections.c[output, k], -sections.c[output, k] @ _complement(a)
        for state in range(2):
            result[again, of_a[state]], result[once_more, of_a[state]] = (
                at_once[state],
                later[state],
            )
            result[now, of_b[state]], result[before, of_b[state]] = at_once[state], later[state]
            result[now, of_c[state]] = sections.b[k, state]
            result[before, of_c[state]] = -mixed[state]
    result[of_static, _numbers(places.d[output])] = 1.0
    return result


def _numbers(values: FloatArray) -> NDArray[np.intp]:
    return np.asarray(values).astype(np.intp)
