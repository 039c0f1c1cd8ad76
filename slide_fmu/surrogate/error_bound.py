"""The error bound gives a limit of this step's error, and tells whether its inputs are familiar.

A companion, a second state-space network trained on other data, runs in parallel with the
surrogate. Statistics of each sample are the difference of both, the companion's states and its
features. From them a small network, the head, computes a local scale of the error. One factor for
each confidence turns the scale into a bound; it is calibrated on trajectories that no training has
used. The domain ends where mean squares of the statistics exceed those of the calibration.
If the surrogate has an error estimator, its estimates belong to the statistics. If not, the head
may also give the RMS error expected at each sample. Over a longer span these form an error
estimate.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import KW_ONLY, dataclass

import numpy as np

from slide_fmu.core.block_means import N_BLOCKS
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import MAX_WINDOW
from slide_fmu.network.feed_forward.network import FeedForward, Layer
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.surrogate.bound_statistics import (
    LOOKED_BACK,
    not_quieter,
    statistics_count,
    statistics_of,
)
from slide_fmu.surrogate.error_estimator import ErrorEstimator
from slide_fmu.surrogate.span_estimate import SpanEstimate

CONFIDENCES = (0.9, 0.95, 0.99)
"""The confidences for which bounds are calibrated, in rising order."""

USUAL_CONFIDENCE = 0.95
"""The confidence of the FMU's bound, unless its parameter is set otherwise."""

MOST_EXPONENT = 60.0
"""A local scale is at most two to this power, relative to the output's scale, also if it is not a
number. It is at least two to the negative power."""

NO_BOUND = 2.0**MOST_EXPONENT
"""The factor for a confidence with too few trajectories for calibration: its bound is infinite."""

MOST_GROWTH = 6.0
"""Outside of the domain, the share of the disagreement that a bound is at least grows with the
novelty, up to so many times."""

ROUNDING = 1e-9
"""Odds that are below a whole number by at most this are rounded up."""

MOST_NOVELTY = 1e9
"""Largest novelty; also used if it is not a number."""


@dataclass(frozen=True, eq=False)
class LocalErrors:
    """LocalErrors are what an error bound evaluates along a sequence of N samples.

    Attributes:
        scales: local scale of the error, relative to the output's scale, shape (N, n_outputs).
        disagreement: difference of surrogate and companion, relative to the output's scale, shape
            (N, n_outputs); or its RMS over the short blocks, if that is larger.
        novelty: 1 at the edge of the domain, shape (N,).
        rms: RMS error expected at each sample, relative to the output's scale, shape (N,
            n_outputs); None if the head does not give it.
    """

    scales: FloatArray
    disagreement: FloatArray
    novelty: FloatArray
    rms: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class ErrorBound:
    """An ErrorBound gives a bound of this step's error, and the novelty of the inputs.

    Statistics of a sample are, in this order: the states of the companion's older state after it
    (n_states), and the features that drive the companion (n_drive). Then come logarithms
    (``logarithms``) of the squared disagreement (n_outputs), of its means over the short and
    over the long blocks (twice n_outputs), of the means of the squared states and features
    over the long blocks (n_states + n_drive), and, if there is an estimator, of the squared
    error that it expects at this sample (n_outputs). The watched means are those of the
    squared disagreement over the short and over the long blocks, and of the squared states and
    features over the long blocks.

    Attributes:
        companion: network with the window, inputs and outputs of the surrogate's network.
        head: maps the statistics, its channels, to the logarithm to base 2 of the local scale of
            every output. With ``span``, logarithms of the RMS errors of every output follow.
        blocks: number of samples in a short and in a long block.
        factors: of the local scale, for each of ``CONFIDENCES`` and each output, shape (3,
            n_outputs).
        limits: of the watched means at the edge of the domain, shape (n_watched,).
        tolerances: largest 95 % bounds that are trusted, relative to the outputs' scales, shape
            (n_outputs,).
        floors: no bound is smaller, relative to the outputs' scales, shape (n_outputs,).
        shares: this share of the disagreement is the surrogate's own error, which no bound is
            smaller than, above 0 and at most 1, shape (n_outputs,).
        doubt: what may be wrong in the samples of inputs, not negative (``doubt_of``). Where held
            inputs change within samples, it is this share of what a polynomial with one mean less
            would change in their effect; where moving ones jump, this part of the jump, which the
            companion sees later (``with_late_jumps``).
        moving: whether inputs move from sample to sample; else they are held.
        quietest: least logarithms that the head gets, shape (n_logarithms,); smaller ones count
            as these.
        estimator: the surrogate's error estimator, whose estimates the head takes, if it has one.
        span: forms an error estimate from the RMS errors of the head, if the surrogate has no
            estimator.
    """

    companion: StateSpace
    head: FeedForward
    blocks: tuple[int, int]
    factors: FloatArray
    limits: FloatArray
    _: KW_ONLY
    tolerances: FloatArray
    floors: FloatArray
    shares: FloatArray
    doubt: float
    moving: bool
    quietest: FloatArray
    estimator: ErrorEstimator | None = None
    span: SpanEstimate | None = None

    def __post_init__(self) -> None:
        short, long = self.blocks
        most = MAX_WINDOW // (N_BLOCKS + 1)
        if not 1 <= short <= long <= most:
            raise ValueError(
                f"error bound with blocks of {short} and {long} samples; expected 1 to {most}, "
                "the shorter ones first"
            )
        if self.span is not None and self.estimator is not None:
            raise ValueError(
                "error bound with an error estimate of its own in addition to an error estimator; "
                "expected one of them"
            )
        n_outputs = self.companion.n_values
        n_watched = self._n_seen + 2 * n_outputs
        n_statistics = statistics_count(self._n_seen, n_outputs, self.estimator is not None)
        head = self.head
        sizes = (head.n_channels, head.n_samples, head.features.n_signals, head.n_values)
        expected = (n_statistics, 1, n_statistics, values_count(n_outputs, self.span is not None))
        if sizes != expected or head.features.features.n_before > 0:
            raise ValueError(
                f"head of an error bound with channels, samples, features and values {sizes}; "
                f"expected {expected}, the statistics themselves"
            )
        self._check_numbers("factors", self.factors, (len(CONFIDENCES), n_outputs))
        self._check_numbers("limits", self.limits, (n_watched,))
        if np.any(np.diff(self.factors, axis=0) < 0):
            raise ValueError(
                f"factors of an error bound that fall: {self.factors.tolist()}; expected them to "
                "rise with the confidence"
            )
        if self.span is not None:
            self._check_numbers("factors of the estimate", self.span.factors, (n_outputs,))
        self._check_numbers("tolerances", self.tolerances, (n_outputs,))
        self._check_floors()

    def _check_floors(self) -> None:
        floors, shares, quietest = self.floors, self.shares, self.quietest
        shape = (self.companion.n_values,)
        if floors.shape != shape or not np.all(np.isfinite(floors) & (floors >= 0)):
            raise ValueError(
                f"floors of an error bound {floors.tolist()}; expected {shape[0]} finite numbers "
                "that are not negative"
            )
        if shares.shape != shape or not np.all((shares > 0) & (shares <= 1)):
            raise ValueError(
                f"shares of the disagreement {shares.tolist()}; expected {shape[0]} numbers above "
                "0 that are at most 1"
            )
        if not 0 <= self.doubt < math.inf:
            raise ValueError(
                f"doubt of an error bound {self.doubt}; expected a finite number that is not "
                "negative"
            )
        shape = (self.n_logarithms,)
        if quietest.shape != shape or not np.all(np.isfinite(quietest)):
            raise ValueError(
                f"quietest logarithms of an error bound of shape {quietest.shape}; expected "
                f"{shape}, all of them finite"
            )

    @staticmethod
    def _check_numbers(name: str, values: FloatArray, shape: tuple[int, ...]) -> None:
        if values.shape != shape or not np.all(np.isfinite(values) & (values > 0)):
            raise ValueError(
                f"{name} of an error bound of shape {values.shape}; expected {shape}, finite and "
                "positive"
            )

    @property
    def confidences(self) -> tuple[float, ...]:
        """The confidences for which the bound is calibrated, in rising order."""
        known = np.all(self.factors < NO_BOUND, axis=1)
        return tuple(c for c, one in zip(CONFIDENCES, known, strict=True) if one)

    @property
    def _n_seen(self) -> int:
        """The number of states and features."""
        return len(self.companion.cell.a) + len(self.companion.roles.drive)

    @property
    def n_logarithms(self) -> int:
        """The number of statistics that are logarithms."""
        return self.head.n_channels - self._n_seen

    @property
    def memory_length(self) -> int:
        """The number of samples of the inputs that a bound depends on."""
        block = self.blocks[1] + (0 if self.span is None else self.span.block)
        estimated = 0 if self.estimator is None else self.estimator.memory_length
        looked_back = LOOKED_BACK if self._late > 0 else 0
        return max(estimated, 2 * self.companion.n_samples + (N_BLOCKS + 1) * block + looked_back)

    @property
    def _late(self) -> float:
        """The part of a jump that the companion sees later."""
        return self.doubt if self.moving else 0.0

    @property
    def filling_length(self) -> int:
        """The number of input samples that must be known before a bound is valid.

        They are the samples that the companion needs, for each sample of the longest mean. Earlier
        inputs have faded. The samples that the estimator needs are included.
        """
        return filling_length(self.companion, self.blocks[1], self.estimator)

    @property
    def estimate_length(self) -> int:
        """The number of input samples that the error estimate of ``span`` needs."""
        assert self.span is not None
        return filling_length(self.companion, self.blocks[1] + self.span.block, None)

    def without_estimate(self) -> ErrorBound:
        """Return the same bound without RMS errors from its head: no error estimate."""
        head, n_outputs = self.head, self.companion.n_values
        *before, last = head.layers
        kept = Layer(last.weights[:n_outputs], last.bias[:n_outputs], last.activation)
        layers = (*before, kept)
        smaller = FeedForward(layers, head.n_samples, head.features, ages=head.ages)
        return dataclasses.replace(self, head=smaller, span=None)

    def along(self, scaled: FloatArray, predicted: FloatArray) -> list[LocalErrors]:
        """Evaluate along B sequences; each counts as constant before its first input.

        Args:
            scaled: scaled inputs, shape (B, N, n_inputs).
            predicted: the surrogate's scaled outputs after each of them, shape (B, N, n_outputs).
        """
        with np.errstate(all="ignore"):  # values that are not finite remain visible in the result
            statistics, watched, disagreement = self.statistics(scaled, predicted)
            statistics = not_quieter(statistics, self.quietest)
            samples = statistics.reshape(-1, 1, statistics.shape[-1])
            exponents = self.head.evaluate(samples).astype(np.float64)
            values = local_scales(exponents).reshape(*predicted.shape[:-1], -1)
            novelty = np.sqrt((watched / self.limits).max(axis=-1))
        novelty = np.where(novelty <= MOST_NOVELTY, novelty, MOST_NOVELTY)
        n_outputs = predicted.shape[-1]
        return [
            LocalErrors(
                both[:, :n_outputs], apart, new, both[:, n_outputs:] if self.span else None
            )
            for both, apart, new in zip(values, disagreement, novelty, strict=True)
        ]

    def statistics(
        self, scaled: FloatArray, predicted: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return statistics, watched means and disagreement of sequences; see ``statistics_of``.

        Scaled inputs (B, N, n_inputs) and scaled outputs (B, N, n_outputs) give the shapes
        (B, N, n_statistics), (B, N, n_watched) and (B, N, n_outputs).
        """
        networks = self.companion, self.estimator
        return statistics_of(networks, self.blocks, scaled, predicted, self._late)

    def estimates(self, scaled: FloatArray, predicted: FloatArray) -> FloatArray:
        """Estimate the RMSE over the samples of ``span``, relative to the outputs' scales.

        Scaled inputs (B, N, n_inputs) and scaled outputs (B, N, n_outputs) give (B, N, n_outputs).
        """
        assert self.span is not None
        rms = [local.rms for local in self.along(scaled, predicted) if local.rms is not None]
        return self.span.along(np.stack(rms) ** 2)

    def factors_at(self, confidence: float) -> FloatArray:
        """Return the factors of the next calibrated confidence, (n_outputs,).

        Raises:
            ValueError: the confidence lies outside the calibrated ones.
        """
        low, *_, high = self.confidences
        if not low <= confidence <= high:
            raise ValueError(
                f"confidence {confidence:g}; expected {low:g} to {high:g}, for which the error "
                "bound is calibrated"
            )
        return np.asarray(self.factors[np.searchsorted(CONFIDENCES, confidence)])

    def bounds(self, local: LocalErrors, confidence: float) -> FloatArray:
        """Return bounds, relative to the outputs' scales, (N, n_outputs).

        They are the scales times the factors, with floors (``floored``). Outside of the domain,
        where the head extrapolates, the share of the disagreement grows with the novelty, up to
        ``MOST_GROWTH`` times.

        Raises:
            ValueError: as for ``factors_at``.
        """
        bounds = self.factors_at(confidence) * local.scales
        largest = local_scales(np.full(bounds.shape, MOST_EXPONENT))
        known = np.where(np.isfinite(local.disagreement), local.disagreement, largest)
        far = np.clip(local.novelty, 1.0, MOST_GROWTH)[:, None]
        return floored(bounds, self.floors, far * self.shares * known)


def floored(bounds: FloatArray, floors: FloatArray, disagreement: FloatArray) -> FloatArray:
    """Return bounds with floors, (..., n_outputs).

    Bound and floor, (n_outputs,), add up like independent errors. The result is at least the
    weighed disagreement. Both repair bounds on kinds of input that the head has never seen: there
    it may expect errors that are far too small.
    """
    with np.errstate(over="ignore"):  # a bound may be infinite
        return np.asarray(np.maximum(np.sqrt(bounds**2 + floors**2), disagreement))


def least_trajectories(confidence: float) -> int:
    """Return the number of trajectories that the calibration for a confidence needs.

    Of N trajectories a share of c (N + 1) / N must be covered (``slide_fmu.bounds.judge``).
    """
    return math.floor(confidence / (1 - confidence) + ROUNDING) + 1


def calibrated(trajectories: int) -> tuple[float, ...]:
    """Return the confidences that this number of trajectories can calibrate, in rising order."""
    return tuple(c for c in CONFIDENCES if least_trajectories(c) <= trajectories)


def local_scales(exponents: FloatArray) -> FloatArray:
    """Return local scales from their logarithms to base 2, which are limited."""
    known = np.where(np.isnan(exponents), MOST_EXPONENT, exponents)
    return np.asarray(2.0 ** np.clip(known, -MOST_EXPONENT, MOST_EXPONENT))


def values_count(n_outputs: int, with_span: bool) -> int:
    """Return the number of values of a head: local scales, and RMS errors if it has a span."""
    return 2 * n_outputs if with_span else n_outputs


def filling_length(companion: StateSpace, block: int, estimator: ErrorEstimator | None) -> int:
    """Return the number of input samples that means over blocks, and an estimator, need."""
    seen = 0 if estimator is None else estimator.network.memory_length
    return max(seen, companion.memory_length + (N_BLOCKS + 1) * block)
