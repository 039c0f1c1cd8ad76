"""This module estimates how fast a recorded system forgets, from the poles of a linear model.

A model of high order, y[k] = sum A_i y[k-i] + sum B_j u[k-j] (ARX), is consistent whatever the
noise is, if its order is high enough (Ljung, 1999, section 10.4). It is reduced to the states that
matter (balanced truncation); the slowest of its poles whose frequency the inputs excite counts.
Its uncertainty comes from leaving out one segment of the record after another (jackknife).
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
import scipy.linalg
import scipy.signal
from numpy.typing import NDArray

from slide_fmu.core.measures import TINY
from slide_fmu.core.signals import FloatArray, Trajectory
from slide_fmu.memory.modes import time_to_decay
from slide_fmu.records.faults import outliers

ORDERS = (2, 4, 8, 16, 32, 64)
"""Orders that are tried; Schwarz's criterion chooses."""
SAMPLES_PER_COEFFICIENT = 8
"""A model has at most one coefficient for this many samples."""
SEGMENTS = 8
"""Number of segments, one of which is left out in each fit."""
SHOWN = 0.02
"""States whose Hankel singular value is below this part of the largest are truncated."""
RIDGE = 1e-9
"""The regression is regularised by this part of the mean power of its columns: a record without
noise has no unique model of a high order."""
RIDGE_OF_INPUTS = 1e-4
"""Columns of inputs have a larger one: inputs may excite a narrow band, and outside of it noise
would look like a lasting pole. Columns of outputs have no larger one: it would shift a pole at
1."""
EXCITED = 0.999
"""The excited band holds this part of the inputs' power; poles beyond it come from noise."""
SURE = 2.0
"""A rate is surely above zero if it is at least this multiple of its standard deviation."""
ENDLESS = 3.0
"""A pole decays within a record if it falls to exp(-ENDLESS) along its longest piece."""


@dataclass(frozen=True, eq=False)
class RecordDecay:
    """A RecordDecay is the slowest decay of a system, estimated by a linear fit.

    Attributes:
        rate: real part of the slowest pole in 1/s; not negative where nothing decays.
        deviation: its standard deviation in 1/s, by the jackknife.
        frequency: its angular frequency in rad/s; 0 of a real pole.
        remaining_amplitude: fraction A_rel to which initial effects decay.
        order: order of the model of high order.
        states: number of states after truncation.
        longest: duration of the longest piece of the record in s.
    """

    rate: float
    deviation: float
    frequency: float
    remaining_amplitude: float
    order: int
    states: int
    longest: float

    @property
    def time(self) -> float:
        """The decay time in s; infinite where nothing decays."""
        return time_to_decay(self.rate, self.remaining_amplitude)

    @property
    def interval(self) -> tuple[float, float]:
        """The decay times in s at both ends of the 95 % interval of the rate."""
        ends = (self.rate - SURE * self.deviation, self.rate + SURE * self.deviation)
        first, last = (time_to_decay(end, self.remaining_amplitude) for end in ends)
        return first, last

    @property
    def lasts(self) -> bool:
        """Tell whether the slowest pole does not decay within the longest piece."""
        return -self.rate * self.longest < ENDLESS

    @property
    def surely_decays(self) -> bool:
        """Tell whether the slowest pole can be told from one that never decays."""
        return self.rate + SURE * self.deviation < 0.0


def decay_of_records(
    trajectories: Sequence[Trajectory], remaining_amplitude: float
) -> RecordDecay:
    """Fit a linear model to pieces of records, and find its slowest pole.

    Samples that touch an outlier, of an input or an output, are left out.

    Raises:
        ValueError: too few samples follow each other without a gap for a model of the lowest
            order.
    """
    sums = _Sums(_scaled(trajectories))
    edge = _band_edge(trajectories)
    order, poles = sums.chosen(edge)
    rates = np.array([_slowest(sums.poles(order, edge, out), edge).real for out in sums.segments])
    count = len(rates)
    deviation = math.sqrt((count - 1) / count * float(np.sum((rates - rates.mean()) ** 2)))
    step = trajectories[0].step
    pole = _slowest(poles, edge)
    return RecordDecay(
        pole.real / step,
        deviation / step,
        abs(pole.imag) / step,
        remaining_amplitude,
        order,
        len(poles),
        step * max(len(one.inputs) for one in trajectories),
    )


def _scaled(trajectories: Sequence[Trajectory]) -> list[tuple[FloatArray, FloatArray]]:
    """Return inputs and outputs about their means, over their standard deviations.

    Missing outputs stay NaN, and outliers become NaN.
    """
    parts = [(_sound(one.inputs), _sound(one.outputs)) for one in trajectories]
    inputs = _scale(np.concatenate([part[0] for part in parts]))
    outputs = _scale(np.concatenate([part[1] for part in parts]))
    return [((u - inputs[0]) / inputs[1], (y - outputs[0]) / outputs[1]) for u, y in parts]


def _sound(values: FloatArray) -> FloatArray:
    """Return values, (N, channels), with outliers as NaN."""
    sound = values.copy()
    for column in sound.T:
        where = np.flatnonzero(np.isfinite(column))
        column[where[outliers(column[where])]] = np.nan
    return sound


def _scale(values: FloatArray) -> FloatArray:
    """Return mean and standard deviation of the known values, (N, channels), as (2, n)."""
    deviation = np.maximum(np.nanstd(values, axis=0), TINY)
    return np.stack([np.nanmean(values, axis=0), deviation])


def _band_edge(trajectories: Sequence[Trajectory]) -> float:
    """Return the angle per sample, up to pi, below which nearly all power of the inputs lies."""
    longest = max(trajectories, key=lambda one: len(one.inputs)).inputs
    length = min(len(longest), 4096)
    _, power = scipy.signal.welch(longest, nperseg=length, axis=0, detrend="constant")
    share = np.cumsum(power.sum(axis=1)) / max(power.sum(), TINY)
    return math.pi * (int(np.searchsorted(share, EXCITED)) + 1) / (len(share) - 1)


def _slowest(poles: np.ndarray, edge: float) -> complex:
    """Return the logarithm, per sample, of the excited pole that is nearest to the circle.

    It may lie beyond the circle. The one of the lowest frequency counts if none is excited.
    """
    angles = np.abs(np.angle(poles))
    excited = poles[angles <= max(edge, float(angles.min()))]
    pole = complex(excited[np.argmax(np.abs(excited))])
    return complex(np.log(max(abs(pole), 1e-300)), np.angle(pole))


@final
class _Sums:
    """Sums of products over segments of records, from which models of all orders follow.

    Attributes:
        segments: numbers of the segments.
    """

    def __init__(self, parts: Sequence[tuple[FloatArray, FloatArray]]) -> None:
        self._n_outputs, self._n_inputs = parts[0][1].shape[1], parts[0][0].shape[1]
        self._length = max(len(inputs) for inputs, _ in parts)
        self._orders = _orders(parts)
        self._most = self._orders[-1]
        self._products = _segment_products(parts, self._most)
        self.segments = tuple(range(len(self._products)))

    def chosen(self, edge: float) -> tuple[int, np.ndarray]:
        """Return the best order, and the poles of its model."""
        best = min(self._orders, key=self._criterion)
        return best, self.poles(best, edge)

    def poles(self, order: int, edge: float, left_out: int | None = None) -> np.ndarray:
        """Return the poles of the truncated model of an order, shape (n,), the slowest among them.

        They may lie outside of the unit circle, at angles per sample up to the edge.
        """
        coefficients, _, _ = self._fit(order, left_out)
        inside = 1.0 - 1.0 / self._length
        model = _excited_part(self._state_space(coefficients, order), inside, edge)
        return _shown_poles(model, inside)

    def _criterion(self, order: int) -> float:
        """Return Schwarz's criterion of an order."""
        coefficients, covariance, count = self._fit(order, None)
        sign, logarithm = np.linalg.slogdet(covariance)
        return count * (logarithm if sign > 0 else -1e3) + math.log(count) * coefficients.size

    def _fit(self, order: int, left_out: int | None) -> tuple[FloatArray, FloatArray, int]:
        """Return coefficients, covariance of the residual, and the number of samples."""
        kept = [p for index, p in enumerate(self._products) if index != left_out]
        products = np.sum([p for p, _ in kept], axis=0)
        count = sum(n for _, n in kept)
        first = self._most * self._n_outputs
        chosen = np.concatenate(
            [np.arange(order * self._n_outputs), first + np.arange(order * self._n_inputs)]
        )
        matrix = products[np.ix_(chosen, chosen)]
        right = products[chosen][:, -self._n_outputs :]
        ridge = np.full(len(matrix), RIDGE)
        ridge[order * self._n_outputs :] = RIDGE_OF_INPUTS
        damped = matrix + np.diag(ridge * np.trace(matrix) / len(matrix))
        coefficients = scipy.linalg.solve(damped, right, assume_a="pos")
        power = products[-self._n_outputs :, -self._n_outputs :]
        cross = coefficients.T @ right
        return (
            coefficients,
            (power - cross - cross.T + coefficients.T @ matrix @ coefficients) / count,
            count,
        )

    def _state_space(
        self, coefficients: FloatArray, order: int
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return A, B, C of the model whose states are the outputs and inputs of the past."""
        p, q = self._n_outputs, self._n_inputs
        size, first = order * (p + q), order * p
        a, b = np.zeros((size, size)), np.zeros((size, q))
        a[:p] = coefficients.T
        a[p:first, : first - p] = np.eye(first - p)
        a[first + q :, first : size - q] = np.eye(size - first - q)
        b[first : first + q] = np.eye(q)
        return a, b, coefficients.T


def _orders(parts: Sequence[tuple[FloatArray, FloatArray]]) -> list[int]:
    """Return the orders for which pieces have enough samples with a whole past behind them.

    Raises:
        ValueError: no order has enough samples.
    """
    width = sum(values.shape[1] for values in parts[0])
    wanted = SAMPLES_PER_COEFFICIENT * width
    counts = {order: sum(len(_rows(part, order)) for part in parts) for order in ORDERS}
    orders = [order for order in ORDERS if counts[order] >= wanted * order]
    if not orders:
        total, least = sum(len(inputs) for inputs, _ in parts), ORDERS[0]
        raise ValueError(
            f"records of {total} samples with {width} signals, in {len(parts)} pieces, of which "
            f"{counts[least]} follow {least} others without a gap; expected at least "
            f"{least * wanted} for a linear fit: record more, with fewer gaps, or, where outputs "
            "are missing in every other line, leave these lines out, which makes a longer step"
        )
    return orders


def _rows(part: tuple[FloatArray, FloatArray], order: int) -> NDArray[np.intp]:
    """Return the samples of a piece that have a whole past of as many samples as the order.

    All outputs of this past are known, and all its inputs up to the sample before.
    """
    inputs, outputs = part
    known = np.asarray(np.isfinite(outputs).all(axis=1))
    known[: len(inputs)] &= np.asarray(np.isfinite(inputs).all(axis=1))
    seen = np.concatenate([[0], np.cumsum(known)])
    whole = seen[order + 1 :] - seen[: -(order + 1)] == order + 1
    return np.flatnonzero(whole) + order


def _segment_products(
    parts: Sequence[tuple[FloatArray, FloatArray]], order: int
) -> list[tuple[FloatArray, int]]:
    """Return sums of products of regressors and outputs, and their number, of all segments.

    The columns are outputs of the past, the newest first, then inputs, then the outputs now.
    """
    total = sum(len(inputs) for inputs, _ in parts)
    size = max(order + 1, -(-total // SEGMENTS))
    width = order * (parts[0][0].shape[1] + parts[0][1].shape[1]) + parts[0][1].shape[1]
    sums = [(np.zeros((width, width)), 0) for _ in range(SEGMENTS)]
    passed = 0
    for inputs, outputs in parts:
        usable = _rows((inputs, outputs), order)
        for begin in range(order, len(outputs), size):
            rows = usable[(usable >= begin) & (usable < begin + size)]
            index = min(SEGMENTS - 1, (passed + begin) // size)
            columns = [outputs[rows - lag] for lag in range(1, order + 1)]
            columns += [inputs[rows - lag] for lag in range(1, order + 1)]
            table = np.concatenate([*columns, outputs[rows]], axis=1)
            before, count = sums[index]
            sums[index] = before + table.T @ table, count + len(rows)
        passed += len(inputs)
    return [products for products in sums if products[1]]


def _excited_part(
    model: tuple[FloatArray, FloatArray, FloatArray], inside: float, edge: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the part of a model without poles that grow faster than anything was excited.

    Such poles fit noise, or what a filter left of high frequencies. An ordered real Schur form
    takes them apart from the others (Golub and Van Loan, Matrix Computations, section 7.6.3).
    """
    a, b, c = model

    def stays(real: float, imaginary: float) -> bool:
        pole = complex(real, imaginary)
        return abs(pole) * inside < 1.0 or abs(cmath.phase(pole)) <= edge

    form, basis, count = scipy.linalg.schur(a, sort=stays)
    if count in (0, len(a)):
        return model
    first, second = slice(None, count), slice(count, None)
    mixed = scipy.linalg.solve_sylvester(
        form[first, first], -form[second, second], -form[first, second]
    )
    turned = basis.T @ b
    return form[first, first], turned[first] - mixed @ turned[second], (c @ basis)[:, first]


def _shown_poles(model: tuple[FloatArray, FloatArray, FloatArray], inside: float) -> np.ndarray:
    """Return the poles of a model after balanced truncation.

    All poles are moved inwards by a factor first, so that lasting poles can be truncated too. If
    poles still lie outside, these alone are returned.
    """
    a, b, c = model[0] * inside, model[1], model[2]
    poles = np.linalg.eigvals(a)
    if np.max(np.abs(poles)) >= 1.0:
        return np.asarray(poles[[np.argmax(np.abs(poles))]] / inside)
    reached = _root(scipy.linalg.solve_discrete_lyapunov(a, b @ b.T))
    seen = _root(scipy.linalg.solve_discrete_lyapunov(a.T, c.T @ c))
    left, singular, right = np.linalg.svd(seen.T @ reached)
    count = int(np.sum(singular > SHOWN * singular[0]))
    scale = 1.0 / np.sqrt(singular[:count])
    small = (seen @ left[:, :count] * scale).T @ a @ (reached @ right[:count].T * scale)
    return np.asarray(np.linalg.eigvals(small) / inside)


def _root(matrix: FloatArray) -> FloatArray:
    """Return a factor R of a Gramian R R'; what rounding makes negative counts as zero."""
    values, vectors = np.linalg.eigh(0.5 * (matrix + matrix.T))
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))
