"""The error bound is trained and calibrated while surrogate and companion stay unchanged.

The head learns the 95 % quantile of the absolute error with the pinball loss (Koenker and Bassett,
1978), from trajectories that neither network was trained on. If an error estimate is made of it,
it also learns the expected RMS error, by the likelihood of normally distributed errors (Nix and
Weigend, 1994). Further trajectories give the usual size of the watched means, and calibrate the
bounds by conformal prediction: a factor turns a scale of the error into a bound.

Samples of one trajectory resemble each other, so a trajectory counts as one observation. A factor
is the smallest one for which the share of covered samples per trajectory, averaged over N
trajectories, is at least c (N + 1) / N. (A sample whose error is at most its floor, or at most the
disagreement, is covered by any factor.) For a new trajectory that is exchangeable with these, the
expected share is then at least c (pooled-CDF split conformal prediction: Dunn, Wasserman, Ramdas,
2023, "Distribution-free prediction sets for two-layer hierarchical models").
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from slide_fmu.bounds.plain_call import plain_predictions
from slide_fmu.core.block_means import N_BLOCKS, block_lengths, block_means
from slide_fmu.core.progress import Progress
from slide_fmu.core.scaling import Affine
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import Window
from slide_fmu.data.stored_split import Split
from slide_fmu.features.differences import Differences
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.fitting.feature_choice import STILL
from slide_fmu.fitting.feed_forward import FeedForwardModule
from slide_fmu.fitting.history import History
from slide_fmu.fitting.training import Objective, train
from slide_fmu.fitting.windows import WindowData
from slide_fmu.network.feed_forward.network import FeedForward
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.recipe.error_bound import BoundRecipe
from slide_fmu.recipe.learning import AdamExpert, FeedForwardRecipe, TrainingRecipe
from slide_fmu.surrogate.error_bound import (
    CONFIDENCES,
    MOST_EXPONENT,
    NO_BOUND,
    SMALLEST,
    USUAL_CONFIDENCE,
    ErrorBound,
    calibrated,
    filling_length,
    floored,
    least_trajectories,
    local_scales,
    not_quieter,
    statistics_of,
    values_count,
)
from slide_fmu.surrogate.span_estimate import SpanEstimate
from slide_fmu.surrogate.surrogate import Surrogate

PARTS = "data.bound", "data.calibration", "bound.expert.further"
"""The splits for an error bound, by their keys in recipes, in their order."""

VALIDATION_SHARE = 0.1
"""Share of the trajectories that selects the head's weights."""

WEIGHT_OF_RMS = 0.1
"""Weight of the likelihood of RMS errors, relative to the pinball loss of local scales."""

SMALL = 0.05
"""An error is small below this fraction of the usual one, the 95 % quantile of all: its bound need
not be close."""

FAR = 3.0
"""Logarithm of a squared error over the expected one, above which the error is an outlier."""

FURTHER_SHARE = 0.05
"""Largest share of samples of further kinds, relative to the others that the head learns from.

With this share, bounds in range become hardly wider. Neighbouring samples resemble each other, so
little is lost by leaving some out."""

FLOOR, FLOOR_OF_MEDIAN = 0.15, 0.45
"""The floor of an output's bounds is this part of its usual error, and at most that part of the
usual error in the median trajectory. It covers small errors on kinds of input that the head has
never seen. Where few kinds have far larger errors than the others, the first alone would make all
other bounds wide."""

LEAST_FACTOR = 0.5
"""Least factor over the factor without floors and disagreement. Where both cover enough samples of
the calibration, the head must still count: other kinds of input have larger errors."""

QUIETEST = 0.001
"""Quantile of the logarithms in the head's training; it sees no smaller ones, since networks
extrapolate badly. An input at rest may have the logarithm of nothing at all."""

USUAL = 0.999
"""Quantile of the watched means that gives the shape of the domain, a box."""


@dataclass(frozen=True, eq=False)
class _Seen:
    """A _Seen has results of surrogate and companion along a split, once the window is filled.

    Attributes:
        statistics: computed while a sample is the newest, shape (n_trajectories, N, n_statistics).
        afterwards: computed when its inputs are known, for an error estimate over a span.
        watched: shape (n_trajectories, N, n_watched).
        disagreement: of ``Trust``, shape (n_trajectories, N, n_outputs).
        errors: absolute errors, relative to the outputs' scales,
            (n_trajectories, N, n_outputs).
    """

    statistics: FloatArray
    afterwards: FloatArray
    watched: FloatArray
    disagreement: FloatArray
    errors: FloatArray

    def heard(self, quietest: FloatArray) -> _Seen:
        """Return the same with the statistics that the head gets."""
        statistics, afterwards = (
            not_quieter(part, quietest) for part in (self.statistics, self.afterwards)
        )
        return replace(self, statistics=statistics, afterwards=afterwards)

    def usual_errors(self) -> FloatArray:
        """Return the 95 % quantile of every output's errors, (n_outputs,), which is positive."""
        usual = np.quantile(_samples(self.errors)[:, 0], USUAL_CONFIDENCE, axis=0)
        # an output without any error, but in a few samples, must have a tolerance too
        return np.asarray(np.maximum(usual, 2.0**-MOST_EXPONENT))


def fit_bound(
    surrogate: Surrogate,
    companion: StateSpace,
    splits: Sequence[Split],
    recipe: BoundRecipe,
    checkpoint: Path,
    device: torch.device,
    progress: Progress,
) -> tuple[ErrorBound, History]:
    """Train the head and calibrate the bound of a surrogate; the history is the head's.

    If inputs are forecast, the bound holds both in the plain call and with inputs known up to the
        end of the step: the head learns from both, and the larger factor counts.

    The head takes the estimates of the surrogate's error estimator, if there is one. The splits
    are trajectories to train on, others for calibration, and possibly further ones to train on, of
    kinds outside the domain. No network was trained on any of them. ``checkpoint`` is the file for
    the state of an interrupted training.

    Raises:
        TrainingError: the training diverged, or the checkpoint cannot be read.
        ValueError: the surrogate makes no error at all, a network gives values that are not
            finite, or there are too few trajectories.
    """
    blocks = block_lengths(
        surrogate.window.step, (recipe.expert.short_span, recipe.expert.long_span)
    )
    with np.errstate(all="ignore"):  # values that are not finite are refused below
        plain = plain_predictions(surrogate, splits)
    see = partial(_seen, surrogate, companion, blocks)
    learnt, calibration, *further = (see(*pair) for pair in zip(splits, plain, strict=True))
    for name, mix in zip(PARTS, [learnt, calibration, *further], strict=False):
        _require_finite(name, mix)
    mixes, calibrations = [learnt], [calibration]
    if surrogate.forecast is not None and surrogate.forecast.judged:
        known = (see(split, None) for split in splits[:2])
        for mix, mixes_of in zip(known, (mixes, calibrations), strict=True):
            mixes_of.append(mix)
    mixes += [_thinned(mix, FURTHER_SHARE * learnt.errors.size) for mix in further]
    n_seen = len(companion.cell.a) + len(companion.roles.drive)
    flat = np.concatenate([_samples(mix.statistics)[:, 0, n_seen:] for mix in mixes])
    quietest = np.quantile(flat, QUIETEST, axis=0)
    mixes, calibrations = ([mix.heard(quietest) for mix in of] for of in (mixes, calibrations))
    head, history = _fit_head(mixes, recipe, checkpoint, device, progress)
    floors = _floors(calibration)
    factors = np.maximum.reduce([_factors_of(head, floors, mix) for mix in calibrations])
    n_outputs = calibration.errors.shape[2]
    limits = _limits(learnt.watched, calibration.watched, recipe.domain_alarms)
    usual = factors[CONFIDENCES.index(USUAL_CONFIDENCE)]
    judge = head, usual, floors, limits
    tolerances = _tolerances(calibrations, judge, recipe.false_alarms)
    block, estimate = recipe.span_block(surrogate.window.step), None
    if block is not None:
        rms = _scales(head, calibration.afterwards)[..., n_outputs:]
        estimate = SpanEstimate(block, _span_factors(calibration.errors, rms, block))
    parts = companion, head, blocks, factors, limits, surrogate.estimator, estimate
    return ErrorBound(*parts, tolerances, floors, quietest), history


def _scales(head: FeedForward, statistics: FloatArray) -> FloatArray:
    """Return the head's local scales, and RMS errors if any, (n_trajectories, N, n_values)."""
    exponents = head.evaluate(_samples(statistics)).astype(np.float64)
    return local_scales(exponents).reshape(*statistics.shape[:2], head.n_values)


def _floors(calibration: _Seen) -> FloatArray:
    """Return what no bound is smaller than, relative to the outputs' scales, (n_outputs,)."""
    of_trajectories = np.quantile(calibration.errors, USUAL_CONFIDENCE, axis=1)
    median = np.median(of_trajectories, axis=0)
    return np.asarray(np.minimum(FLOOR * calibration.usual_errors(), FLOOR_OF_MEDIAN * median))


def _factors_of(head: FeedForward, floors: FloatArray, calibration: _Seen) -> FloatArray:
    """Return the factors for all confidences, (3, n_outputs).

    The floors have the shape (n_outputs,). Each sample is covered from some factor on
    (``floored``), and these factors are the ratios for ``conformal_factors``. See
    ``LEAST_FACTOR`` too.

    If there are too few trajectories for a confidence above the usual one, its bound is infinite.
    """
    n_outputs = calibration.errors.shape[2]
    found = _scales(head, calibration.statistics)[..., :n_outputs]
    errors = calibration.errors
    left = np.sqrt(np.maximum(errors**2 - floors**2, 0.0))
    ratios = np.where(errors <= calibration.disagreement, 0.0, left / found)
    without = np.maximum(errors / found, 2.0**-MOST_EXPONENT)  # factors must be positive
    enough = calibrated(len(ratios))
    return np.stack(
        [
            np.full(n_outputs, NO_BOUND)
            if confidence > USUAL_CONFIDENCE and confidence not in enough
            else np.maximum(
                conformal_factors(ratios, confidence),
                LEAST_FACTOR * conformal_factors(without, confidence),
            )
            for confidence in CONFIDENCES
        ]
    )


def conformal_factors(ratios: FloatArray, confidence: float) -> FloatArray:
    """Return the factor of every output, (n_outputs,).

    Args:
        ratios: absolute errors over the scale of the error, shape (n_trajectories, N, n_outputs).
        confidence: expected share of covered samples in a new trajectory.

    Raises:
        ValueError: there are too few trajectories for the confidence.
    """
    count, least = len(ratios), least_trajectories(confidence)
    if count < least:
        raise ValueError(
            f"calibration for a confidence of {confidence:g} with {count} trajectories; expected "
            f"at least {least}: raise data.calibration"
        )
    share = confidence * (count + 1) / count
    pooled = np.sort(ratios.reshape(-1, ratios.shape[-1]), axis=0)
    place = math.ceil(share * len(pooled)) - 1
    return np.asarray(pooled[place])


def _require_finite(name: str, mix: _Seen) -> None:
    both = np.concatenate([mix.statistics, mix.errors], axis=2)
    known: NDArray[np.bool_] = np.asarray(np.isfinite(both).all(axis=(1, 2)))
    if not known.all():
        raise ValueError(
            "the outputs of the surrogate, or of its companion, are not finite on "
            f"{np.sum(~known)} of {len(known)} trajectories of {name}; expected networks that "
            "stay bounded there: excite it less (bound.excitation), or let both learn from "
            "trajectories beyond the range (data.beyond)"
        )


def _thinned(mix: _Seen, most: float) -> _Seen:
    """Take every n-th sample of each trajectory, so that at most ``most`` errors remain."""
    every = max(1, math.ceil(mix.errors.size / most))
    return _Seen(*(values[:, ::every] for values in vars(mix).values()))


def _span_factors(errors: FloatArray, rms: FloatArray, block: int) -> FloatArray:
    """Return the factors from expected errors of samples to errors over a span, (n_outputs,).

    Both arrays have the shape (n_trajectories, N, n_outputs). On the calibration, estimates are
    too large as often as too small.
    """
    known = slice((N_BLOCKS + 1) * block, None)
    true, found = (block_means(values**2, block)[:, known] for values in (errors, rms))
    ratios = np.log(np.maximum(true, SMALLEST) / found)
    return np.asarray(np.exp(0.5 * np.median(ratios.reshape(-1, ratios.shape[2]), axis=0)))


def _seen(
    surrogate: Surrogate,
    companion: StateSpace,
    blocks: tuple[int, int],
    split: Split,
    plain: FloatArray | None,
) -> _Seen:
    """Run both networks along trajectories; values that are not finite are refused later.

    Errors are those of ``given``, outputs in a plain call, (n_trajectories, N, n_outputs), if it
    is not None; otherwise of the outputs with all inputs known up to the end of the step.
    """
    scaled = surrogate.input_scaling.apply(split.inputs)
    networks, forecast, ahead = (companion, surrogate.estimator), surrogate.forecast, None
    if plain is None:
        plain = surrogate.predict_newest_batch(split.inputs)
    elif forecast is not None and forecast.judged:
        found = forecast.along(split.inputs, surrogate.inputs, surrogate.input_scaling)
        ahead = surrogate.input_scaling.apply(found)
    predicted = surrogate.output_scaling.apply(plain)
    with np.errstate(all="ignore"):
        errors = np.abs(plain - split.outputs[:, 1:]) / surrogate.output_scaling.scale
        seen = statistics_of(networks, blocks, scaled, predicted, ahead)
        statistics, watched, disagreement = seen
        afterwards = statistics
        if ahead is not None:
            afterwards = statistics_of(networks, blocks, scaled, predicted)[0]
    filling = filling_length(companion, blocks[1], surrogate.estimator)
    filled = slice(max(surrogate.window.n_in, filling), None)
    parts = statistics, afterwards, watched, disagreement, errors
    return _Seen(*(part[:, filled] for part in parts))


def _fit_head(
    learnt: Sequence[_Seen],
    recipe: BoundRecipe,
    checkpoint: Path,
    device: torch.device,
    progress: Progress,
) -> tuple[FeedForward, History]:
    """Train the head on the logarithm of the local scale, near the quantile of all errors.

    With ``estimate_span``, the logarithm of the RMS error follows. In each mix of kinds, some of
    the trajectories select the weights. Errors are relative to the quantile of the first mix.
    """
    errors = learnt[0].errors.reshape(-1, learnt[0].errors.shape[2])
    usual = np.quantile(errors, USUAL_CONFIDENCE, axis=0)
    if not np.all(usual > 0):
        raise ValueError(
            f"the surrogate makes no error in output {int(np.argmin(usual))} (counted from 0) on "
            "95 % of the samples of data.bound; expected errors, of which a bound can be learnt: "
            "remove the table [bound]"
        )
    counts = [max(1, round(VALIDATION_SHARE * len(mix.errors))) for mix in learnt]
    flat = np.concatenate([_samples(mix.statistics)[:, 0] for mix in learnt])
    features = FeatureMap(Differences(flat.shape[1]), scaling=scaling_of_statistics(flat))
    table = FeedForwardRecipe(
        family="feed_forward", hidden=recipe.expert.hidden, activation="tanh"
    )
    n_values = values_count(len(usual), recipe.estimate_span is not None)
    module = FeedForwardModule(table, 1, features, n_values)
    module.to(device, torch.float32)
    module.initialise(torch.Generator(device).manual_seed(recipe.expert.seed))
    known = np.concatenate([usual, np.sqrt(np.mean(errors**2, axis=0))])[:n_values]
    begin = torch.as_tensor(np.log2(known), dtype=torch.float32).to(device)
    with torch.no_grad():
        module.state_dict()[f"linear.{len(recipe.expert.hidden)}.bias"].copy_(begin)

    def windows(parts: Sequence[slice]) -> WindowData:
        pairs = list(zip(learnt, parts, strict=True))
        statistics = np.concatenate([_samples(mix.statistics[part]) for mix, part in pairs])
        inputs = torch.as_tensor(features.along(statistics)).to(device)
        found = np.concatenate([_samples(mix.errors[part]) for mix, part in pairs])
        relative = np.pad(found / usual, ((0, 0), (1, 0), (0, 0)))
        return WindowData(inputs, torch.as_tensor(relative).to(inputs), Window(1.0, 1, 1))

    training = TrainingRecipe(
        steps=recipe.expert.steps,
        batch=recipe.expert.batch,
        learning_rate=recipe.expert.learning_rate,
        seed=recipe.expert.seed,
        expert=AdamExpert(
            warm_up=0.05,
            final_learning_rate=0.0,
            input_jitter=0.0,
            weight_decay=1e-4,
            gradient_clip=1.0,
        ),
    )
    chosen_by = windows([slice(0, count) for count in counts])
    learnt_from = windows([slice(count, None) for count in counts])
    objective = _objective(begin[: len(usual)])
    history = train(module, learnt_from, chosen_by, training, checkpoint, progress, objective)
    return module.freeze(), history


def _samples(values: FloatArray) -> FloatArray:
    """Split trajectories into samples, (n_trajectories, N, n) to (n_trajectories * N, 1, n)."""
    return values.reshape(-1, 1, values.shape[2])


def _objective(usual: torch.Tensor) -> Objective:
    """Return the loss of exponents, (B, n_values), for errors relative to the usual ones.

    The errors have the shape (B, n_outputs), the exponents of the usual ones (n_outputs,). The
    first n_outputs exponents are local scales, the others are RMS errors.
    """
    n_outputs = len(usual)

    def loss(exponents: torch.Tensor, errors: torch.Tensor) -> torch.Tensor:
        of_scales = _pinball(exponents[:, :n_outputs] - usual, errors)
        if exponents.shape[1] == n_outputs:
            return of_scales
        of_rms = _likelihood(exponents[:, n_outputs:] - usual, errors)
        return of_scales + WEIGHT_OF_RMS * of_rms

    return Objective(loss, lambda value: value, odd=False)


def _pinball(exponents: torch.Tensor, errors: torch.Tensor) -> torch.Tensor:
    """Return the mean pinball loss at ``USUAL_CONFIDENCE``, relative to the usual errors.

    Errors are on a logarithmic scale, down to a small fraction of the usual error. Otherwise kinds
    of inputs with errors a hundred times larger would decide alone, and small errors would get
    loose bounds. A quantile is the same on any such scale.
    """
    below = (errors / SMALL).log1p() - (exponents.exp2() / SMALL).log1p()
    return torch.maximum(USUAL_CONFIDENCE * below, (USUAL_CONFIDENCE - 1) * below).mean()


def _likelihood(exponents: torch.Tensor, errors: torch.Tensor) -> torch.Tensor:
    """Return the mean negative logarithm of the likelihood of errors, without its constant.

    The errors are normally distributed with these RMS values. An outlier counts by its logarithm:
    otherwise a few outliers would decide alone.
    """
    levels = math.log(4) * exponents  # of squares
    apart = errors.square().clamp(min=SMALLEST).log() - levels
    near = apart.clamp(max=FAR).exp()
    return (near * (1 + (apart - FAR).clamp(min=0.0)) + levels).mean()


SINGLE = 1e-6
"""Relative changes of numbers in single precision below this are rounding."""


def scaling_of_statistics(statistics: FloatArray) -> Affine:
    """Return the scaling of statistics, (N, n_statistics), by mean and standard deviation.

    A statistic that never changes, except by rounding of itself or of others (``STILL``), is not
    scaled: otherwise rounding would change the values of the head.
    """
    deviation = statistics.std(axis=0)
    rounding = np.maximum(SINGLE * np.abs(statistics).max(axis=0), STILL * deviation.max())
    moves = deviation > rounding
    return Affine(statistics.mean(axis=0), np.where(moves, deviation, 1.0))


def _limits(learnt: FloatArray, calibration: FloatArray, false_alarms: float) -> FloatArray:
    """Return the watched means at the edge of the domain, (n_watched,).

    The box of the usual means, (n_trajectories, N, n_watched), is enlarged in all directions until
    the share of calibration samples outside equals the share of false alarms.
    """
    usual = np.quantile(learnt.reshape(-1, learnt.shape[2]), USUAL, axis=0)
    usual = np.maximum(usual, SMALLEST)
    outermost = (calibration / usual).max(axis=2)
    return np.asarray(usual * np.quantile(outermost, 1 - false_alarms))


def _tolerances(
    calibrations: Sequence[_Seen],
    judge: tuple[FeedForward, FloatArray, FloatArray, FloatArray],
    false_alarms: float,
) -> FloatArray:
    """Return the largest bounds that are trusted, relative to the outputs' scales, (n_outputs,).

    They are the same multiple of the usual error of every output, which is the 95 % quantile in
    the first calibration. In each calibration, at most the share of false alarms of the samples
    has a larger bound or lies outside of the domain.

    Args:
        calibrations: the plain call first, then possibly inputs known to the end of the step.
        judge: the head, its factors of the usual confidence (n_outputs,), the floors
            (n_outputs,), the domain's limits.
        false_alarms: the share.
    """
    head, factors, floors, limits = judge
    n_outputs = len(factors)
    usual = calibrations[0].usual_errors()
    multiples = []
    for mix in calibrations:
        scaled = factors * _scales(head, mix.statistics)[..., :n_outputs]
        bounds = floored(scaled, floors, mix.disagreement)
        ratios = (bounds / usual).max(axis=2)
        outside = (mix.watched / limits).max(axis=2) > 1
        ratios[outside] = ratios.max()  # they are alarms anyway
        multiples.append(np.quantile(ratios, 1 - false_alarms, method="higher"))
    return np.asarray(usual * max(multiples))
