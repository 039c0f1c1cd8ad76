"""The error bound is trained and calibrated while surrogate and companion stay unchanged.

The head learns from trajectories that neither network was trained on. Further trajectories give
the usual size of the watched means, and calibrate the bounds.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np
import torch

from slide_fmu.bounds.calibration import (
    domain_limits,
    factors_of,
    floors_of,
    scales_of,
    shares_of,
    span_factors,
    tolerances_of,
)
from slide_fmu.bounds.head import fit_head
from slide_fmu.bounds.observations import observed, require_finite, samples_of, thinned
from slide_fmu.bounds.plain_call import plain_predictions
from slide_fmu.core.block_means import block_lengths
from slide_fmu.core.progress import Progress
from slide_fmu.data.stored_split import Split
from slide_fmu.fitting.history import History
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.recipe.error_bound import BoundRecipe
from slide_fmu.surrogate.error_bound import CONFIDENCES, USUAL_CONFIDENCE, ErrorBound
from slide_fmu.surrogate.span_estimate import SpanEstimate
from slide_fmu.surrogate.surrogate import Surrogate

PARTS = "data.bound", "data.calibration", "bound.expert.further"
"""The splits for an error bound, by their keys in recipes, in their order."""

FURTHER_SHARE = 0.05
"""Largest share of samples of further kinds, relative to the others that the head learns from.

With this share, bounds in range become hardly wider. Neighbouring samples resemble each other, so
little is lost by leaving some out."""

QUIETEST = 0.001
"""Quantile of the logarithms in the head's training; it sees no smaller ones, since networks
extrapolate badly. An input at rest may have the logarithm of nothing at all."""


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
    see = partial(observed, surrogate, companion, blocks)
    learnt, calibration, *further = (see(*pair) for pair in zip(splits, plain, strict=True))
    for name, mix in zip(PARTS, [learnt, calibration, *further], strict=False):
        require_finite(name, mix)
    mixes, calibrations = [learnt], [calibration]
    if surrogate.forecast is not None and surrogate.forecast.judged:
        known = (see(split, None) for split in splits[:2])
        for mix, mixes_of in zip(known, (mixes, calibrations), strict=True):
            mixes_of.append(mix)
    mixes += [thinned(mix, FURTHER_SHARE * learnt.errors.size) for mix in further]
    n_seen = len(companion.cell.a) + len(companion.roles.drive)
    flat = np.concatenate([samples_of(mix.statistics)[:, 0, n_seen:] for mix in mixes])
    quietest = np.quantile(flat, QUIETEST, axis=0)
    mixes, calibrations = ([mix.heard(quietest) for mix in of] for of in (mixes, calibrations))
    head, history = fit_head(mixes, recipe, checkpoint, device, progress)
    floors, shares = floors_of(calibration), shares_of(calibration)
    calibrations = [mix.weighed(shares) for mix in calibrations]
    kinds = splits[1].kinds
    factors = np.maximum.reduce([factors_of(head, floors, mix, kinds) for mix in calibrations])
    n_outputs = calibration.errors.shape[2]
    limits = domain_limits(learnt.watched, calibration.watched, recipe.domain_alarms)
    usual = factors[CONFIDENCES.index(USUAL_CONFIDENCE)]
    judge = head, usual, floors, limits
    tolerances = tolerances_of(calibrations, judge, recipe.false_alarms)
    block, estimate = recipe.span_block(surrogate.window.step), None
    if block is not None:
        rms = scales_of(head, calibration.afterwards)[..., n_outputs:]
        estimate = SpanEstimate(block, span_factors(calibration.errors, rms, block))
    parts = companion, head, blocks, factors, limits, surrogate.estimator, estimate
    return ErrorBound(*parts, tolerances, floors, shares, quietest), history
