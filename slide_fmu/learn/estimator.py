"""The error estimator: a second network, trained with the surrogate fixed."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import torch

from slide_fmu.core.measures import moving_rms
from slide_fmu.core.progress import Stages
from slide_fmu.core.scaling import LogError
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import Window
from slide_fmu.data.store import Split
from slide_fmu.learn.family import seeded_generator
from slide_fmu.learn.feature_choice import feature_map, require_odd
from slide_fmu.learn.feed_forward import FeedForwardModule
from slide_fmu.learn.training import History, Objective, train
from slide_fmu.learn.windows import WindowData
from slide_fmu.network.base import Float32Array
from slide_fmu.recipe.estimator import EstimatorRecipe
from slide_fmu.surrogate.error_estimator import ErrorEstimator
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import System

POSITIONS, BLOCKS = "error at single samples", "error estimator"
"""Names of the stages."""
HEADROOM = 0.1
"""Decades between the largest error seen and the end of the map's range."""


LIMIT = 8.0
"""Largest decimal exponent of a square: keeps single precision finite at the start."""


HUBER = 0.03
"""Deviations of eps below count as their square, larger ones linearly: bursts do not rule all."""
ROUNDING = 1e-6
"""Of a feature, that is of order one: two programs may differ by it in one that never changes."""
MARGIN = 0.05
"""Of the range of a feature in the training, on both sides: what the estimator still knows."""
OUTLIER = 4.0
"""Standard deviations from which the likelihood of an error falls exponentially only."""
AT_RESOLUTION = -1.0 + 1e-6
"""A target eps up to here lies at the resolution: any smaller estimate is right too."""


class EstimatorModule(torch.nn.Module):
    """Evaluates one network along a stretch; gives the log of its moving RMS. Final.

    Args:
        network: gives eps of the features (B, n_samples, n_features) it sees, or mu and eps.
        positions: evaluations that one RMS is made of, each one sample later; 1: the network sees
            the whole window.
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
        """Stretches of features to eps at the ends of all whole windows in them.

        Args:
            windows: shape (B, n_samples + positions - 1 + n, n_features).

        Returns:
            Shape (B, (n + 1) * n_outputs), sample by sample.
        """
        views = windows.unfold(1, self.network.n_samples, 1).transpose(2, 3)
        values = self.network.values_of(self.network.seen(views).flatten(0, 1))
        mean, variance = split_values(values, self.log_error, self.n_outputs)
        squares = (mean.square() + variance).view(len(windows), -1, self.n_outputs)
        # sums of few samples are differences of sums of many: double precision
        sums = torch.nn.functional.pad(squares.double().cumsum(1), (0, 0, 1, 0))
        blocks = (sums[:, self.positions :] - sums[:, : -self.positions]) / self.positions
        logarithms = 0.5 * blocks.clamp_min(10.0 ** (-2 * LIMIT)).log10()
        eps = (logarithms - self.log_error.middle) / self.log_error.half_range
        return eps.to(windows.dtype).flatten(1)


def split_values(
    values: torch.Tensor, log_error: LogError, n_outputs: int
) -> tuple[torch.Tensor, torch.Tensor]:
    """Expected error and variance around it, (B, n_outputs) each, from what the network gives.

    Errors differ by orders of magnitude along a motion: their mean is learnt as a multiple of
    their spread.
    """
    eps = values[:, -n_outputs:]
    exponent = 2 * (log_error.middle + log_error.half_range * eps)
    variance = 10 ** exponent.clamp(-2 * LIMIT, LIMIT)
    if values.shape[1] == n_outputs:
        return torch.zeros_like(eps), variance
    return values[:, :n_outputs] * variance.sqrt(), variance


def _huber(values: torch.Tensor, targets: torch.Tensor) -> torch.Tensor:
    """Huber loss of the deviations of eps, none for estimates below the resolution."""
    deviation = values - targets
    deviation = torch.where(targets <= AT_RESOLUTION, deviation.clamp_min(0), deviation)
    nothing = torch.zeros_like(deviation)
    return torch.nn.functional.huber_loss(deviation, nothing, delta=HUBER) / HUBER


ROBUST = Objective(_huber, lambda value: value, odd=False)
"""About the mean deviation of eps: what counts is how far off estimates are as a rule."""


def likelihood(log_error: LogError, resolution: float, n_outputs: int) -> Objective:
    """Maximum likelihood of single errors, normal with the network's mean and variance.

    Errors further than ``OUTLIER`` standard deviations from the mean count linearly: a surrogate
    that has left its range errs by orders of magnitude more than the network can have learnt yet.
    Reported as exp(loss - 1/2): the geometric mean of the standard deviations, if they are right.
    """

    def loss(values: torch.Tensor, targets: torch.Tensor) -> torch.Tensor:
        mean, spread = split_values(values, log_error, n_outputs)
        variance = spread + (0.1 * resolution) ** 2
        standardized = (targets - mean) / variance.sqrt()
        squares = torch.nn.functional.huber_loss(
            standardized, torch.zeros_like(standardized), delta=OUTLIER, reduction="none"
        )
        return (squares + 0.5 * variance.log()).mean()

    return Objective(loss, lambda value: math.exp(min(value, 80.0) - 0.5))


def fit_estimator(
    surrogate: Surrogate,
    system: System,
    splits: tuple[Split, Split],
    recipe: EstimatorRecipe,
    checkpoint: Path,
    device: torch.device,
    progress: Stages,
) -> tuple[ErrorEstimator, dict[str, History]]:
    """Train the error estimator of a surrogate.

    Args:
        surrogate: stays as it is.
        system: what it stands for.
        splits: trajectories to learn from and to validate by; not those of the surrogate.
        checkpoint: file for the state of an interrupted training; one for the pretraining lies
            beside it.

    Raises:
        TrainingError: the training diverged.
        ValueError: the surrogate makes no error above the resolution, or signs shall be flipped
            of features that do not follow.
    """
    window, n_outputs = surrogate.window, len(surrogate.outputs)
    dtype = getattr(torch, recipe.training.precision)

    def tensor(values: FloatArray) -> torch.Tensor:
        return torch.as_tensor(values, dtype=dtype).to(device)

    time_invariant = recipe.network.time_invariant
    span = recipe.span or window.n_out
    errors = [streamed_errors(surrogate, split) for split in splits]
    blocks = [block_errors(window, error, span) for error in errors]
    single = np.abs(errors[0][:, window.memory_length :])
    log_error = _log_error(single if time_invariant else blocks[0], recipe.resolution)
    scaled = [surrogate.input_scaling.apply(split.inputs) for split in splits]
    features = feature_map(recipe.network, system, surrogate.input_scaling, scaled[0])
    trainings = (recipe.training, recipe.pretraining)
    if any(training is not None and training.flip_signs for training in trainings):
        require_odd(features)
    inputs = [tensor(features.along(values).astype(np.float64)) for values in scaled]
    positions = span if time_invariant else 1
    most = window.memory_length if time_invariant else window.n_in
    ages = tuple(reversed(recipe.lags or ()))
    n_samples = ages[0] + 1 if ages else most
    # no error counts before the surrogate's window is filled
    inputs = [values[:, most - n_samples :].contiguous() for values in inputs]
    errors = [values[:, most - n_samples :] for values in errors]
    blocks = [values[:, most - n_samples :] for values in blocks]
    n_values = 2 * n_outputs if time_invariant else n_outputs
    ranges = _ranges(inputs[0])
    network = FeedForwardModule(recipe.network, n_samples, features, n_values, ages)
    network.to(device, dtype)
    network.initialise(seeded_generator(recipe.training.seed, device))
    histories = {}
    if recipe.pretraining is not None:
        one = Window(window.step, n_samples, 1)
        training, validation = (
            WindowData(u[kept].contiguous(), tensor(e[kept]), one)
            for u, e in zip(inputs, errors, strict=True)
            for kept in [_pretrained(recipe, len(e))]
        )
        histories[POSITIONS] = train(
            network,
            training,
            validation,
            recipe.pretraining,
            checkpoint.with_name(f"positions-{checkpoint.name}"),
            progress(POSITIONS),
            likelihood(log_error, recipe.resolution, n_outputs),
        )
    eps = [tensor(log_error.apply(np.maximum(block, recipe.resolution))) for block in blocks]
    seen = n_samples + positions - 1
    more = min(positions - 1, inputs[0].shape[1] - seen)
    stretch = Window(window.step, seen + more, more + 1)
    training, validation = (WindowData(u, e, stretch) for u, e in zip(inputs, eps, strict=True))
    histories[BLOCKS] = train(
        EstimatorModule(network, positions, log_error, n_outputs),
        training,
        validation,
        recipe.training,
        checkpoint,
        progress(BLOCKS),
        ROBUST,
    )
    return ErrorEstimator(network.freeze(), log_error, positions, ranges), histories


def _ranges(features: torch.Tensor) -> Float32Array:
    """Least and largest value of every feature, (2, n_features), with a margin.

    Args:
        features: of the training, shape (n_trajectories, N, n_features).
    """
    values = features.flatten(0, 1)
    least, largest = values.min(0).values, values.max(0).values
    size = values.abs().max(0).values.clamp_min(1.0)
    margin = MARGIN * (largest - least) + ROUNDING * size
    return torch.stack([least - margin, largest + margin]).to("cpu", torch.float32).numpy()


def _pretrained(recipe: EstimatorRecipe, trajectories: int) -> list[int]:
    """Which of a split's trajectories the pretraining learns from."""
    every = range(trajectories)
    return [i for i in every if recipe.pretrained_beyond or not recipe.draws_beyond(i)]


def streamed_errors(surrogate: Surrogate, split: Split) -> FloatArray:
    """Errors of the newest outputs, relative to the outputs' scale.

    Returns:
        Shape (n_trajectories, N + 1, n_outputs); zero at sample 0, where nothing is predicted.
    """
    result = np.zeros_like(split.outputs)
    result[:, 1:] = surrogate.predict_newest_batch(split.inputs) - split.outputs[:, 1:]
    return np.asarray(result / surrogate.output_scaling.scale)


def block_errors(window: Window, errors: FloatArray, span: int) -> FloatArray:
    """RMSE over the samples up to each one.

    Args:
        window: of the surrogate.
        errors: as from ``streamed_errors``.
        span: number of samples.

    Returns:
        Same shape; entries are zero where the span reaches before the first sample whose error
        counts, that of n_in - n_out + 1 inputs.
    """
    first, result = window.memory_length, np.zeros_like(errors)
    for row, error in zip(result, errors, strict=True):
        row[first + span - 1 :] = moving_rms(error[first:], span)
    return result


def _log_error(errors: FloatArray, resolution: float) -> LogError:
    """Map whose range holds all errors from the resolution on."""
    largest = float(np.max(errors))
    if largest <= resolution:
        raise ValueError(
            f"largest relative error of the surrogate is {largest:.2g}, below "
            f"estimator.resolution = {resolution:.2g}; lower the resolution"
        )
    return LogError(math.log10(resolution), math.log10(largest) + HEADROOM)
