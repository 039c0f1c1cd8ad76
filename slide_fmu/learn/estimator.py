"""The error estimator: a second network, trained with the surrogate fixed."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import torch

from slide_fmu.data.store import Split
from slide_fmu.errors import moving_rms
from slide_fmu.learn.family import seeded_generator
from slide_fmu.learn.feature_choice import feature_map, require_odd
from slide_fmu.learn.feed_forward import FeedForwardModule
from slide_fmu.learn.training import History, Objective, ProgressOf, train
from slide_fmu.learn.windows import WindowData
from slide_fmu.recipe import EstimatorRecipe
from slide_fmu.scaling import LogError
from slide_fmu.signals import FloatArray
from slide_fmu.surrogate import ErrorEstimator, Surrogate
from slide_fmu.systems.base import System
from slide_fmu.window import Window

POSITIONS, BLOCKS = "error at single samples", "error estimator"
"""Names of the stages."""
HEADROOM = 0.1
"""Decades between the largest error seen and the end of the map's range."""


LIMIT = 8.0
"""Largest decimal exponent of a square: keeps single precision finite at the start."""


HUBER = 0.03
"""Deviations of eps below count as their square, larger ones linearly: bursts do not rule all."""
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
        values = self.network(views.flatten(0, 1))
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
    """Expected error and variance around it, (B, n_outputs) each, from what the network gives."""
    eps = values[:, -n_outputs:]
    exponent = 2 * (log_error.middle + log_error.half_range * eps)
    variance = 10 ** exponent.clamp(-2 * LIMIT, LIMIT)
    with_mean = values.shape[1] == 2 * n_outputs
    return values[:, :n_outputs] if with_mean else torch.zeros_like(eps), variance


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

    Reported as exp(loss - 1/2): the geometric mean of the standard deviations, if they are right.
    """

    def loss(values: torch.Tensor, targets: torch.Tensor) -> torch.Tensor:
        mean, spread = split_values(values, log_error, n_outputs)
        variance = spread + (0.1 * resolution) ** 2
        return 0.5 * ((targets - mean).square() / variance + variance.log()).mean()

    return Objective(loss, lambda value: math.exp(min(value, 80.0) - 0.5))


def fit_estimator(
    surrogate: Surrogate,
    system: System,
    splits: tuple[Split, Split],
    recipe: EstimatorRecipe,
    checkpoint: Path,
    device: torch.device,
    progress: ProgressOf,
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

    errors = [streamed_errors(surrogate, split) for split in splits]
    blocks = [block_errors(surrogate, error) for error in errors]
    log_error = _log_error(blocks[0][:, window.n_in :], recipe.resolution)
    scaled = [surrogate.input_scaling.apply(split.inputs) for split in splits]
    features = feature_map(recipe.network, system, surrogate.input_scaling, scaled[0])
    trainings = (recipe.training, recipe.pretraining)
    if any(training is not None and training.flip_signs for training in trainings):
        require_odd(features)
    inputs = [tensor(features.along(values).astype(np.float64)) for values in scaled]
    positions = window.n_out if recipe.network.time_invariant else 1
    most = window.n_in - positions + 1
    n_samples = _samples_seen(recipe, most)
    # no error counts before the surrogate's window is filled
    inputs = [values[:, most - n_samples :] for values in inputs]
    errors = [values[:, most - n_samples :] for values in errors]
    blocks = [values[:, most - n_samples :] for values in blocks]
    n_values = 2 * n_outputs if recipe.network.time_invariant else n_outputs
    network = FeedForwardModule(recipe.network, n_samples, features, n_values)
    network.to(device, dtype)
    network.initialise(seeded_generator(recipe.training.seed, device))
    histories = {}
    if recipe.pretraining is not None:
        single = Window(window.step, n_samples, 1)
        training, validation = (
            WindowData(u, tensor(e), single) for u, e in zip(inputs, errors, strict=True)
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
    return ErrorEstimator(network.freeze(), log_error, positions), histories


def _samples_seen(recipe: EstimatorRecipe, most: int) -> int:
    """Newest inputs that the network sees at each position.

    Raises:
        ValueError: more than the window holds, or less for a network that sees all of it.
    """
    samples = most if recipe.samples is None else recipe.samples
    if samples > most or (samples < most and not recipe.network.time_invariant):
        expected = f"at most {most}" if recipe.network.time_invariant else str(most)
        raise ValueError(
            f"estimator.samples = {samples}; expected {expected}, what the window leaves behind "
            "each position of the error estimate"
        )
    return samples


def streamed_errors(surrogate: Surrogate, split: Split) -> FloatArray:
    """Errors of the newest outputs, relative to the outputs' scale.

    Returns:
        Shape (n_trajectories, N + 1, n_outputs); zero at sample 0, where nothing is predicted.
    """
    result = np.zeros_like(split.outputs)
    result[:, 1:] = surrogate.predict_newest_batch(split.inputs) - split.outputs[:, 1:]
    return np.asarray(result / surrogate.output_scaling.scale)


def block_errors(surrogate: Surrogate, errors: FloatArray) -> FloatArray:
    """RMSE over the output window that ends at each sample.

    Args:
        errors: as from ``streamed_errors``.

    Returns:
        Same shape; entries before sample n_in, where no whole window is there, are zero.
    """
    window, result = surrogate.window, np.zeros_like(errors)
    for row, error in zip(result, errors, strict=True):
        row[window.n_in :] = moving_rms(error[window.receptive_field :], window.n_out)
    return result


def _log_error(blocks: FloatArray, resolution: float) -> LogError:
    """Map whose range holds all errors from the resolution on."""
    largest = float(np.max(blocks))
    if largest <= resolution:
        raise ValueError(
            f"largest relative error of the surrogate is {largest:.2g}, below "
            f"estimator.resolution = {resolution:.2g}; lower the resolution"
        )
    return LogError(math.log10(resolution), math.log10(largest) + HEADROOM)
