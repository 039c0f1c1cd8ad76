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
from slide_fmu.bounds.held_doubt import doubt_of
from slide_fmu.bounds.judge import fit_judge, tolerances_of
from slide_fmu.bounds.observations import observed, require_finite
from slide_fmu.core.block_means import block_lengths
from slide_fmu.core.progress import Stages
from slide_fmu.data.stored_split import Split
from slide_fmu.fitting.history import History
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.recipe.error_bound import BoundRecipe
from slide_fmu.surrogate.error_bound import ErrorBound
from slide_fmu.surrogate.surrogate import Surrogate

PARTS = "data.bound", "data.calibration", "bound.expert.further"
"""The splits for an error bound, by their keys in recipes, in their order."""

BOUND = "error bound"
"""Name of the head's stage in the progress and in the figures."""


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

    Inputs are known to the end of each step. Where the FMU forecasts them, it measures what that
    changed in the outputs lately, and adds it to the bound.

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
        mixes = [observed(surrogate, companion, blocks, split) for split in splits]
    for name, mix in zip(PARTS, mixes, strict=False):
        require_finite(name, mix)
    stage = progress(BOUND)
    terms = splits[1].kinds, recipe.domain_alarms, recipe.span_block(step)
    judge = fit_judge(mixes, *terms, lambda of: fit_head(of, recipe, checkpoint, device, stage))
    tolerances = tolerances_of(judge, recipe.false_alarms)
    doubt = doubt_of(companion) if surrogate.hold == "zero_order" else 0.0
    bound = judge.error_bound(companion, blocks, surrogate.estimator, tolerances, doubt)
    return bound, judge.history
