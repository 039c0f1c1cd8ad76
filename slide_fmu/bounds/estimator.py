"""The error estimator is a second network, trained while the surrogate stays unchanged.

The method is in the paper's section "Error Estimation Network": the network learns the logarithm
of the RMSE over an output window from the surrogate's inputs. A time-invariant estimator is an
addition: one network gives mean and variance of the error at single samples, and the estimate is
their moving RMS.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import final

import numpy as np
import torch

from slide_fmu.bounds.estimate_use import known_predictions
from slide_fmu.core.measures import moving_rms
from slide_fmu.core.progress import Stages
from slide_fmu.core.scaling import LogError
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import Window
from slide_fmu.data.trajectories import Split
from slide_fmu.features.base import BEFORE, FeatureOffer
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.fitting.feature_choice import choose_features, require_odd
from slide_fmu.fitting.feed_forward import FeedForwardModule
from slide_fmu.fitting.history import History
from slide_fmu.fitting.training import Objective, train
from slide_fmu.fitting.windows import WindowData
from slide_fmu.network.base import Float32Array
from slide_fmu.recipe.estimator import EstimatorRecipe
from slide_fmu.surrogate.error_estimator import ErrorEstimator
from slide_fmu.surrogate.surrogate import Surrogate

POSITIONS, BLOCKS = "error at single samples", "error estimator"
"""Names of the stages in the progress and in the figures."""
HEADROOM = 0.1
"""The map's range ends by this number of decades above the largest error found."""

LARGEST_EXPONENT = 8.0
"""Largest decimal exponent of a squared error: it keeps single precision finite at first."""

HUBER = 0.03
"""Deviations of eps count squared below this, linearly above it: bursts do not dominate the
fit."""
ROUNDING = 1e-6
"""Two programs may differ by this fraction of a feature's size (of 1, at least) by rounding."""
RANGE_MARGIN = 0.05
"""The estimator counts as trained up to this fraction of a feature's range beyond either end."""
OUTLIER = 4.0
"""The likelihood of an error falls only exponentially beyond this number of standard
deviations."""
AT_RESOLUTION = -1.0 + 1e-6
"""A target eps up to this value lies at the resolution: any smaller estimate is right too."""


@final
class EstimatorModule(torch.nn.Module):
    """An EstimatorModule evaluates one network along a sequence and gives its moving RMS.

    Args:
        network: gives eps, or the mean and eps, from features (B, n_samples, n_features).
        positions: number of evaluations in one RMS, each one sample later; with 1 the network
            takes the whole window.
        log_error: map between eps and relative errors.
        n_outputs: number of outputs.
    """

    def __init__(
        self, network: FeedForwardModule, positions: int, log_error: LogError, n_outputs: int
    ) -> None:
        super().__init__()
        self.network, self.positions, self.log_error = network, positions, log_error
        self.n_outputs = n_outputs

    def forward(self, windows: torch.Tensor) -> torch.Tensor:
        """Map sequences of features to eps at the ends of all whole windows in them.

        Features (B, n_samples + positions - 1 + n, n_features) give eps (B, (n + 1) * n_outputs),
        flattened sample by sample.
        """
        views = windows.unfold(1, self.network.n_samples, 1).transpose(2, 3)
        values = self.network.values_of(self.network.picked(views).flatten(0, 1))
        mean, variance = split_values(values, self.log_error, self.n_outputs)
        squares = (mean.square() + variance).view(len(windows), -1, self.n_outputs)
        # double precision: sums of few samples are differences of sums of many
        sums = torch.nn.functional.pad(squares.double().cumsum(1), (0, 0, 1, 0))
        blocks = (sums[:, self.positions :] - sums[:, : -self.positions]) / self.positions
        logarithms = 0.5 * blocks.clamp_min(10.0 ** (-2 * LARGEST_EXPONENT)).log10()
        eps = (logarithms - self.log_error.middle) / self.log_error.half_range
        return eps.to(windows.dtype).flatten(1)


def split_values(
    values: torch.Tensor, log_error: LogError, n_outputs: int
) -> tuple[torch.Tensor, torch.Tensor]:
    """Split the values of the network into the mean and the variance of the relative error.

    The values are eps only, shape (B, n_outputs), for the mean 0; or the mean in standard
    deviations, then eps, (B, 2 * n_outputs). Errors vary by orders of magnitude along a motion, so
    the mean is learnt as a multiple of the standard deviation. Both results have the shape (B,
    n_outputs).
    """
    eps = values[:, -n_outputs:]
    exponent = 2 * (log_error.middle + log_error.half_range * eps)
    variance = 10 ** exponent.clamp(-2 * LARGEST_EXPONENT, LARGEST_EXPONENT)
    if values.shape[1] == n_outputs:
        return torch.zeros_like(eps), variance
    return values[:, :n_outputs] * variance.sqrt(), variance


def _huber(values: torch.Tensor, targets: torch.Tensor) -> torch.Tensor:
    """Return the Huber loss of the deviations of eps; zero for estimates below resolution."""
    deviation = values - targets
    deviation = torch.where(targets <= AT_RESOLUTION, deviation.clamp_min(0), deviation)
    nothing = torch.zeros_like(deviation)
    return torch.nn.functional.huber_loss(deviation, nothing, delta=HUBER) / HUBER


ROBUST = Objective(_huber, lambda value: value, odd=False)
"""Objective near the mean absolute deviation of eps: the usual deviation counts."""


def likelihood(log_error: LogError, resolution: float, n_outputs: int) -> Objective:
    """Return the objective of maximum likelihood for normally distributed errors.

    Errors further than ``OUTLIER`` standard deviations from the mean count linearly: outside its
    range a surrogate has errors that are orders of magnitude larger than the network can have
    learnt so far. The loss is reported as exp(loss - 1/2), the geometric mean of the standard
    deviations if these are right. ``resolution`` is the smallest relative error of interest.
    """

    def loss(values: torch.Tensor, targets: torch.Tensor) -> torch.Tensor:
        mean, learnt = split_values(values, log_error, n_outputs)
        # a floor below the resolution: no gain in likelihood from ever smaller variances
        variance = learnt + (0.1 * resolution) ** 2
        standardized = (targets - mean) / variance.sqrt()
        squares = torch.nn.functional.huber_loss(
            standardized, torch.zeros_like(standardized), delta=OUTLIER, reduction="none"
        )
        return (squares + 0.5 * variance.log()).mean()

    return Objective(loss, lambda value: math.exp(min(value, 80.0) - 0.5))


class NothingToEstimateError(ValueError):
    """A surrogate makes no error above the resolution of its error estimator."""


def fit_estimator(
    surrogate: Surrogate,
    offered: FeatureOffer,
    splits: tuple[Split, Split],
    recipe: EstimatorRecipe,
    checkpoint: Path,
    device: torch.device,
    progress: Stages,
) -> tuple[ErrorEstimator, dict[str, History]]:
    """Train the error estimator of a surrogate, which stays unchanged.

    It is returned with the history of each stage by its name. The splits are trajectories for
    training and validation; they differ from the surrogate's training trajectories, on which its
    errors are small (paper, "Error Estimation Network"). ``checkpoint`` is the file for the state
    of an interrupted training; the pretraining's file is next to it.

    Raises:
        TrainingError: the training diverged, or a checkpoint cannot be read.
        NothingToEstimateError: the surrogate makes no error above the resolution.
        ValueError: signs are to be flipped of features that do not change their sign with the
            inputs.
    """
    errors = _errors_along(surrogate, offered, splits, recipe, device)
    log_error, step, n_outputs = errors.log_error, surrogate.window.step, len(surrogate.outputs)
    n_values = 2 * n_outputs if recipe.network.time_invariant else n_outputs
    network = FeedForwardModule(
        recipe.network, errors.n_samples, errors.features, n_values, errors.ages
    )
    network.to(device, errors.inputs[0].dtype)
    network.initialise(torch.Generator(device).manual_seed(recipe.training.seed))
    histories = {}
    if recipe.expert.pretraining is not None:
        training, validation = errors.single_samples(step, recipe)
        histories[POSITIONS] = train(
            network,
            training,
            validation,
            recipe.expert.pretraining,
            checkpoint.with_name(f"positions-{checkpoint.name}"),
            progress(POSITIONS),
            likelihood(log_error, recipe.expert.resolution, n_outputs),
        )
    module = EstimatorModule(network, errors.positions, log_error, n_outputs)
    training, validation = errors.windows(step, recipe.expert.resolution)
    histories[BLOCKS] = train(
        module, training, validation, recipe.training, checkpoint, progress(BLOCKS), ROBUST
    )
    # the changes of the first samples are wrong: the inputs before them are not stored
    ranges = _ranges(errors.inputs[0][:, BEFORE:])
    return ErrorEstimator(network.freeze(), log_error, errors.positions, ranges), histories


@dataclass(frozen=True, eq=False)
class _Errors:
    """_Errors has features and errors along trajectories, for training and for validation.

    Attributes:
        features: the features of the network.
        log_error: map between eps and relative errors.
        inputs: features, shape (n_trajectories, N, n_features) each.
        errors: relative errors of the newest outputs, shape (n_trajectories, N + 1, n_outputs).
        blocks: RMSE over the span that ends at each sample, of the same shape.
        n_samples: number of samples from the oldest to the newest that the network takes.
        ages: ages of the samples that it takes, falling; empty if it takes all.
        positions: number of evaluations in one estimate.
    """

    features: FeatureMap
    log_error: LogError
    inputs: list[torch.Tensor]
    errors: list[FloatArray]
    blocks: list[FloatArray]
    n_samples: int
    ages: tuple[int, ...]
    positions: int

    def single_samples(self, step: float, recipe: EstimatorRecipe) -> Iterator[WindowData]:
        """Return windows whose target is the error at their last sample, for the pretraining."""
        window = Window(step, self.n_samples, 1)
        for inputs, errors in zip(self.inputs, self.errors, strict=True):
            every = range(len(errors))
            kept = [
                i for i in every if recipe.expert.pretrained_beyond or not recipe.draws_beyond(i)
            ]
            yield WindowData(inputs[kept], torch.as_tensor(errors[kept]).to(inputs), window)

    def windows(self, step: float, resolution: float) -> Iterator[WindowData]:
        """Return windows whose targets are eps of the RMSE at all ends of spans in them.

        Windows are longer than one estimate needs, so that evaluations are used again:
            neighbouring estimates share all positions but one.
        """
        seen = self.n_samples + self.positions - 1
        more = min(self.positions - 1, self.inputs[0].shape[1] - seen)
        window = Window(step, seen + more, more + 1)
        for inputs, blocks in zip(self.inputs, self.blocks, strict=True):
            eps = self.log_error.apply(np.maximum(blocks, resolution))
            yield WindowData(inputs, torch.as_tensor(eps).to(inputs), window)


def _errors_along(
    surrogate: Surrogate,
    offered: FeatureOffer,
    splits: tuple[Split, Split],
    recipe: EstimatorRecipe,
    device: torch.device,
) -> _Errors:
    """Run the surrogate along trajectories and return its errors with its features."""
    window, time_invariant = surrogate.window, recipe.network.time_invariant
    span = recipe.span or window.n_out
    errors = [streamed_errors(surrogate, split) for split in splits]
    blocks = [block_errors(window, error, span) for error in errors]
    single = np.abs(errors[0][:, window.memory_length :])
    log_error = _log_error(single if time_invariant else blocks[0], recipe.expert.resolution)
    scaled = [surrogate.input_scaling.apply(split.inputs) for split in splits]
    names = recipe.network.feature_names()
    features = choose_features(names, offered, scaled[0])
    trainings = (recipe.training, recipe.expert.pretraining)
    if any(training is not None and training.flips_signs for training in trainings):
        require_odd(features)
    most = window.memory_length if time_invariant else window.n_in
    ages = tuple(reversed(recipe.expert.lags or ()))
    n_samples = ages[0] + 1 if ages else most
    first = most - n_samples  # errors count once the surrogate's window is filled
    dtype = getattr(torch, recipe.training.expert.precision)
    inputs = [torch.as_tensor(features.along(v)).to(device, dtype) for v in scaled]
    return _Errors(
        features,
        log_error,
        [values[:, first:].contiguous() for values in inputs],
        [values[:, first:] for values in errors],
        [values[:, first:] for values in blocks],
        n_samples,
        ages,
        span if time_invariant else 1,
    )


def _ranges(features: torch.Tensor) -> Float32Array:
    """Return the least and largest value of every feature with a margin, (2, n_features)."""
    values = features.flatten(0, 1)
    least, largest = values.min(0).values, values.max(0).values
    size = values.abs().max(0).values.clamp_min(1.0)
    margin = RANGE_MARGIN * (largest - least) + ROUNDING * size
    return torch.stack([least - margin, largest + margin]).to("cpu", torch.float32).numpy()


def streamed_errors(surrogate: Surrogate, split: Split) -> FloatArray:
    """Return errors of the newest outputs, relative to the outputs' scale, with known inputs.

    The shape is (n_trajectories, N + 1, n_outputs). Sample 0 is zero, since nothing is predicted
    there.
    """
    result = np.zeros_like(split.outputs)
    predicted = known_predictions(surrogate, split)
    result[:, 1:] = predicted - split.outputs[:, 1:]
    return np.asarray(result / surrogate.output_scaling.scale)


def block_errors(window: Window, errors: FloatArray, span: int) -> FloatArray:
    """Return the RMSE over the span that ends at each sample (paper).

    Errors and result have the shape (n_trajectories, N + 1, n_outputs). Entries are zero where the
    span begins before the first valid error, after n_in - n_out + 1 inputs.
    """
    first, result = window.memory_length, np.zeros_like(errors)
    for row, error in zip(result, errors, strict=True):
        row[first + span - 1 :] = moving_rms(error[first:], span)
    return result


def _log_error(errors: FloatArray, resolution: float) -> LogError:
    """Return the map whose range covers all errors above the resolution."""
    largest = float(np.max(errors))
    if largest <= resolution:
        raise NothingToEstimateError(
            f"the FMU has no error estimate, since the largest relative error of the surrogate is "
            f"{largest:.2g}, below estimator.expert.resolution = {resolution:.2g}: lower the "
            "resolution, if such small errors matter"
        )
    return LogError(math.log10(resolution), math.log10(largest) + HEADROOM)
