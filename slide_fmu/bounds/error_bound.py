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
from slide_fmu.bounds.observations import observed, require_finite
from slide_fmu.bounds.plain_call import plain_predictions
from slide_fmu.core.block_means import block_lengths
from slide_fmu.core.progress import Progress
from slide_fmu.core.signals import FloatArray
from slide_fmu.data.stored_split import Split
from slide_fmu.fitting.history import History
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.recipe.error_bound import BoundRecipe
from slide_fmu.surrogate.error_bound import ErrorBound
from slide_fmu.surrogate.surrogate import Surrogate

PARTS = "data.bound", "data.calibration", "bound.expert.further"
"""The splits for an error bound, by their keys in recipes, in their order."""


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

    If inputs are forecast, there are two judges: one of the plain call, and one of inputs known up
    to the end of the step. Usual errors and the history are those of the call in which the FMU is
    mostly run: planned motions are known.

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

    def judge(given: Sequence[FloatArray | None], place: Path) -> Judge:
        pairs = zip(splits, given, strict=True)
        mixes = [observed(surrogate, companion, blocks, *pair) for pair in pairs]
        for name, mix in zip(PARTS, mixes, strict=False):
            require_finite(name, mix)
        terms = splits[1].kinds, recipe.domain_alarms, recipe.span_block(step)
        return fit_judge(mixes, *terms, lambda of: fit_head(of, recipe, place, device, progress))

    of_plain_call = judge(plain, checkpoint)
    shared = companion, blocks, surrogate.estimator
    if surrogate.forecast is None:
        tolerances = tolerances_of([of_plain_call], recipe.false_alarms)
        return of_plain_call.error_bound(*shared, tolerances), of_plain_call.history
    place = checkpoint.with_stem(f"{checkpoint.stem}-known")
    of_known = judge([None] * len(splits), place)
    judges = [of_known] if surrogate.planned else [of_plain_call, of_known]
    tolerances = tolerances_of(judges, recipe.false_alarms)
    bound = of_plain_call.error_bound(*shared, tolerances)
    return of_known.error_bound(*shared, tolerances, bound), judges[0].history
