"""The error bound is trained and calibrated while surrogate and companion stay unchanged.

The head learns from trajectories that neither network was trained on. Further trajectories give
the usual size of the watched means, and calibrate the bounds.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import torch

from slide_fmu.bounds.head import fit_head
from slide_fmu.bounds.judge import Judge, fit_judge, tolerances_of
from slide_fmu.bounds.observations import Observations, observed, require_finite
from slide_fmu.bounds.plain_call import plain_predictions
from slide_fmu.core.block_means import block_lengths
from slide_fmu.core.progress import Stages
from slide_fmu.core.signals import FloatArray
from slide_fmu.data.stored_split import Split
from slide_fmu.fitting.history import History
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.recipe.error_bound import BoundRecipe
from slide_fmu.surrogate.error_bound import ErrorBound
from slide_fmu.surrogate.surrogate import Surrogate

PARTS = "data.bound", "data.calibration", "bound.expert.further"
"""The splits for an error bound, by their keys in recipes, in their order."""

BOUND, PLAIN_BOUND = "error bound", "error bound of the plain call"
"""Names of the heads' stages in the progress, and of the first one in the figures."""


def fit_bound(
    surrogate: Surrogate,
    companion: StateSpace,
    splits: Sequence[Split],
    recipe: BoundRecipe,
    checkpoint: Path,
    device: torch.device,
    progress: Stages,
) -> tuple[ErrorBound, History]:
    """Train the head and calibrate the bound of a surrogate; the history is the head's.

    If inputs are forecast, the bound holds both in the plain call and with inputs known up to the
    end of the step. One judge covers both calls, which also helps where inputs of a new kind are
    known, as in a loop. Planned motions are mostly known, and their errors in the plain call are
    far larger: there each call has a judge of its own, and the tolerances, usual errors and
    history are those of known inputs.

    The head takes the estimates of the surrogate's error estimator, if there is one. The splits
    are trajectories to train on, others for calibration, and possibly further ones to train on, of
    kinds outside the domain. No network was trained on any of them. ``checkpoint`` is the file for
    the state of an interrupted training.

    Raises:
        TrainingError: the training diverged, or the checkpoint cannot be read.
        ValueError: the surrogate makes no error at all, a network gives values that are not
            finite, or there are too few trajectories.
    """
    step, spans = surrogate.window.step, (recipe.expert.short_span, recipe.expert.long_span)
    blocks = block_lengths(step, spans)
    with np.errstate(all="ignore"):  # values that are not finite are refused below
        plain = plain_predictions(surrogate, splits)

    def seen(given: Sequence[FloatArray | None]) -> list[Observations]:
        pairs = zip(splits, given, strict=False)
        mixes = [observed(surrogate, companion, blocks, *pair) for pair in pairs]
        for name, mix in zip(PARTS, mixes, strict=False):
            require_finite(name, mix)
        return mixes

    def judge(calls: Sequence[Sequence[Observations]], place: Path, name: str = BOUND) -> Judge:
        terms = splits[1].kinds, recipe.domain_alarms, recipe.span_block(step)
        stage = progress(name)
        return fit_judge(calls, *terms, lambda of: fit_head(of, recipe, place, device, stage))

    in_plain_call = seen(plain)
    shared = companion, blocks, surrogate.estimator
    if surrogate.planned:
        of_known = judge([seen([None] * len(splits))], checkpoint)
        place = checkpoint.with_stem(f"{checkpoint.stem}-plain")
        of_plain = judge([in_plain_call], place, PLAIN_BOUND)
        tolerances = tolerances_of(of_known, recipe.false_alarms)
        other = of_plain.error_bound(*shared, tolerances)
        return of_known.error_bound(*shared, tolerances, other), of_known.history
    known = [] if surrogate.forecast is None else [seen([None, None])]  # no further kinds
    of_both = judge([in_plain_call, *known], checkpoint)
    tolerances = tolerances_of(of_both, recipe.false_alarms)
    return of_both.error_bound(*shared, tolerances), of_both.history
