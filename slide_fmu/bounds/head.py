"""The head of an error bound is fitted to observed errors.

It learns the 95 % quantile of the absolute error with the pinball loss (Koenker and Bassett,
1978). If an error estimate is made of it, it also learns the expected RMS error, by the likelihood
of normally distributed errors (Nix and Weigend, 1994).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import torch

from slide_fmu.bounds.observations import Observations, samples_of
from slide_fmu.core.progress import Progress
from slide_fmu.core.scaling import Affine
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import Window
from slide_fmu.features.differences import Differences
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.fitting.feature_choice import STILL
from slide_fmu.fitting.feed_forward import FeedForwardModule
from slide_fmu.fitting.history import History
from slide_fmu.fitting.training import Objective, train
from slide_fmu.fitting.windows import WindowData
from slide_fmu.network.feed_forward.network import FeedForward
from slide_fmu.recipe.error_bound import BoundRecipe
from slide_fmu.recipe.learning import AdamExpert, FeedForwardRecipe, TrainingRecipe
from slide_fmu.surrogate.bound_statistics import SMALLEST
from slide_fmu.surrogate.error_bound import USUAL_CONFIDENCE, values_count

VALIDATION_SHARE = 0.1
"""Share of the trajectories that selects the head's weights."""

WEIGHT_OF_RMS = 0.1
"""Weight of the likelihood of RMS errors, relative to the pinball loss of local scales."""

SMALL = 0.05
"""An error is small below this fraction of the usual one, the 95 % quantile of all: its bound need
not be close."""

FAR = 3.0
"""Logarithm of a squared error over the expected one, above which the error is an outlier."""

SINGLE = 1e-6
"""Relative changes of numbers in single precision below this are rounding."""


def fit_head(
    learnt: Sequence[Observations],
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
    flat = np.concatenate([samples_of(mix.statistics)[:, 0] for mix in learnt])
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
        statistics = np.concatenate([samples_of(mix.statistics[part]) for mix, part in pairs])
        inputs = torch.as_tensor(features.along(statistics)).to(device)
        found = np.concatenate([samples_of(mix.errors[part]) for mix, part in pairs])
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


def scaling_of_statistics(statistics: FloatArray) -> Affine:
    """Return the scaling of statistics, (N, n_statistics), by mean and standard deviation.

    A statistic that never changes, except by rounding of itself or of others (``STILL``), is not
    scaled: otherwise rounding would change the values of the head.
    """
    deviation = statistics.std(axis=0)
    rounding = np.maximum(SINGLE * np.abs(statistics).max(axis=0), STILL * deviation.max())
    moves = deviation > rounding
    return Affine(statistics.mean(axis=0), np.where(moves, deviation, 1.0))
