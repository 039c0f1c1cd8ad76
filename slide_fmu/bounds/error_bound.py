"""The error bound is trained and calibrated while surrogate and companion stay unchanged.

The head learns from trajectories that neither network was trained on. Further trajectories give
the usual size of the watched means, and calibrate the bounds.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import torch

from slide_fmu.bounds.judge import fit_judge, tolerances_of
from slide_fmu.bounds.observations import Observations, observed, require_finite, samples_of
from slide_fmu.core.block_means import block_lengths
from slide_fmu.core.progress import Progress, Stages
from slide_fmu.core.scaling import Affine
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import Window
from slide_fmu.data.trajectories import Split
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
from slide_fmu.surrogate.bound_statistics import SMALLEST
from slide_fmu.surrogate.error_bound import USUAL_CONFIDENCE, ErrorBound, values_count
from slide_fmu.surrogate.surrogate import Surrogate

PARTS = "data.bound", "data.calibration", "bound.expert.further"
"""The splits for an error bound, by their keys in recipes, in their order."""

BOUND = "error bound"
"""Name of the head's stage in the progress and in the figures."""

DOUBT_MARGIN = 1.25
"""Doubt over the sum of the series in ``doubt_of``, r / (1 - r). With it, bounds of Duffing
oscillators of 10 and 30 ms cover 94 % and more under forces that change between samples
(``tests/benchmarks/held_between.py``)."""

AT_END_OF_STEP = 0.5
"""Part of a jump that comes later, where it is at the end of its step and not a straight line
over the step."""

MOST_DOUBT = 8.0
"""Largest doubt, also where the series has no sum."""

PULSE_HEIGHT = 0.2
"""Height of the pulse, of an input's range to one side: large beside rounding, still linear."""

VALIDATION_SHARE = 0.1
"""Share of the trajectories that selects the head's weights."""

WEIGHT_OF_RMS = 0.1
"""Weight of the likelihood of RMS errors, relative to the pinball loss of local scales."""

SMALL_ERROR = 0.05
"""An error is small below this fraction of the usual one, the 95 % quantile of all: its bound need
not be close."""

OUTLYING = 3.0
"""Logarithm of a squared error over the expected one, above which the error is an outlier."""

SINGLE_ROUNDING = 1e-6
"""Relative changes of numbers in single precision below this are rounding."""


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
        late = late_jumps_of(surrogate)
        mixes = [observed(surrogate, companion, blocks, split, late) for split in splits]
    for name, mix in zip(PARTS, mixes, strict=False):
        require_finite(name, mix)
    stage = progress(BOUND)
    terms = splits[1].kinds, recipe.domain_alarms, recipe.span_block(step)
    judge = fit_judge(mixes, *terms, lambda of: fit_head(of, recipe, checkpoint, device, stage))
    tolerances = tolerances_of(judge, recipe.false_alarms)
    moving = surrogate.hold == "first_order"
    doubt = late if moving else doubt_of(companion)
    bound = judge.error_bound(companion, blocks, surrogate.estimator, tolerances, doubt, moving)
    return bound, judge.history


def late_jumps_of(surrogate: Surrogate) -> float:
    """Return the part of each jump that the companion of a surrogate sees later.

    It is that of a jump at the end of its step, where inputs of the training jumped at any time.
    """
    jumped = surrogate.forecast is not None and surrogate.forecast.jumps
    return AT_END_OF_STEP if jumped else 0.0


def doubt_of(companion: StateSpace) -> float:
    """Return the doubt about held inputs between samples, from a network's response to a pulse.

    An input that changes within a sample counts by the polynomial through the effects of five
    samples (``slide_fmu/fmu/runtime/window/sampling.h``). Its error is the rest of a series: the
    next term is what the polynomial of one order less would change, times the ratio r of the next
    two differences of the response, and each further one has a factor of about r again.

    The doubt is that of the input and output with the largest one, at least 0 and at most
    ``MOST_DOUBT``. Without any response it is 0.
    """
    n_inputs, length = companion.n_channels, companion.n_samples
    rest = np.zeros((1, 2 * length, n_inputs))
    ratio = 0.0
    for i in range(n_inputs):
        pulsed = rest.copy()
        pulsed[:, length, i] = PULSE_HEIGHT
        response = (companion.stream(pulsed) - companion.stream(rest))[0, length:].astype(float)
        fourth, fifth = (np.sqrt(np.sum(np.diff(response, n, axis=0) ** 2, 0)) for n in (4, 5))
        ratio = max(ratio, *(fifth[fourth > 0] / fourth[fourth > 0]).tolist(), 0.0)
    return MOST_DOUBT if ratio >= 1 else min(DOUBT_MARGIN * ratio / (1 - ratio), MOST_DOUBT)


def fit_head(
    learnt: Sequence[Observations],
    recipe: BoundRecipe,
    checkpoint: Path,
    device: torch.device,
    progress: Progress,
) -> tuple[FeedForward, History]:
    """Train the head on the logarithm of the local scale, near the quantile of all errors.

    It learns the 95 % quantile of the absolute error with the pinball loss (Koenker and Bassett,
    1978). If an error estimate is made of it, it also learns the expected RMS error, by the
    likelihood of normally distributed errors (Nix and Weigend, 1994).

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
        errors_of_part = np.concatenate([samples_of(mix.errors[part]) for mix, part in pairs])
        relative = np.pad(errors_of_part / usual, ((0, 0), (1, 0), (0, 0)))
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
    below = (errors / SMALL_ERROR).log1p() - (exponents.exp2() / SMALL_ERROR).log1p()
    return torch.maximum(USUAL_CONFIDENCE * below, (USUAL_CONFIDENCE - 1) * below).mean()


def _likelihood(exponents: torch.Tensor, errors: torch.Tensor) -> torch.Tensor:
    """Return the mean negative logarithm of the likelihood of errors, without its constant.

    The errors are normally distributed with these RMS values. An outlier counts by its logarithm:
    otherwise a few outliers would decide alone.
    """
    levels = math.log(4) * exponents  # of squares
    apart = errors.square().clamp(min=SMALLEST).log() - levels
    near = apart.clamp(max=OUTLYING).exp()
    return (near * (1 + (apart - OUTLYING).clamp(min=0.0)) + levels).mean()


def scaling_of_statistics(statistics: FloatArray) -> Affine:
    """Return the scaling of statistics, (N, n_statistics), by mean and standard deviation.

    A statistic that never changes, except by rounding of itself or of others (``STILL``), is not
    scaled: otherwise rounding would change the values of the head.
    """
    deviation = statistics.std(axis=0)
    rounding = np.maximum(
        SINGLE_ROUNDING * np.abs(statistics).max(axis=0), STILL * deviation.max()
    )
    moves = deviation > rounding
    return Affine(statistics.mean(axis=0), np.where(moves, deviation, 1.0))
