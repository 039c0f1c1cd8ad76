"""The error estimator: a second network, trained with the surrogate fixed."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import torch

from slide_fmu.data.store import Split
from slide_fmu.errors import moving_rms
from slide_fmu.learn.family import seeded_generator
from slide_fmu.learn.feed_forward import FeedForwardModule
from slide_fmu.learn.training import History, TrainingProgress, train
from slide_fmu.learn.windows import WindowData
from slide_fmu.recipe import EstimatorRecipe
from slide_fmu.scaling import LogError
from slide_fmu.signals import FloatArray
from slide_fmu.surrogate import ErrorEstimator, Surrogate
from slide_fmu.window import Window

HEADROOM = 0.1
"""Decades between the largest error seen and the end of the map's range."""


class EstimatorModule(torch.nn.Module):
    """Evaluates one network at several positions of the window; gives the log of the RMS. Final.

    Args:
        network: gives eps of the samples (B, n_samples, n_inputs) it sees.
        positions: evaluations, each one sample later; 1: the network sees the whole window.
        log_error: map between eps and relative errors.
    """

    def __init__(self, network: FeedForwardModule, positions: int, log_error: LogError) -> None:
        super().__init__()
        self.network, self.positions, self.log_error = network, positions, log_error

    def forward(self, windows: torch.Tensor) -> torch.Tensor:
        """Input windows (B, n_samples + positions - 1, n_inputs) to eps (B, n_outputs)."""
        if self.positions == 1:
            return torch.as_tensor(self.network(windows))
        views = windows.unfold(1, self.network.n_samples, 1).transpose(2, 3)
        eps = self.network(views.flatten(0, 1)).unflatten(0, (len(windows), self.positions))
        middle, half_range = self.log_error.middle, self.log_error.half_range
        squares = 2 * math.log(10) * (middle + half_range * eps)
        mean = torch.logsumexp(squares, dim=1) - math.log(self.positions)
        return (mean / (2 * math.log(10)) - middle) / half_range


def fit_estimator(
    surrogate: Surrogate,
    splits: tuple[Split, Split],
    recipe: EstimatorRecipe,
    checkpoint: Path,
    device: torch.device,
    progress: TrainingProgress,
) -> tuple[ErrorEstimator, History]:
    """Train the error estimator of a surrogate.

    Args:
        surrogate: stays as it is.
        splits: trajectories to learn from and to validate by; not those of the surrogate.

    Raises:
        TrainingError: the training diverged.
        ValueError: the surrogate makes no error above the resolution.
    """
    window, n_outputs = surrogate.window, len(surrogate.outputs)
    errors = [block_errors(surrogate, split) for split in splits]
    largest = float(np.max(errors[0][:, window.n_in :]))
    if largest <= recipe.resolution:
        raise ValueError(
            f"largest relative error of the surrogate is {largest:.2g}, below "
            f"estimator.resolution = {recipe.resolution:.2g}; lower the resolution"
        )
    log_error = LogError(math.log10(recipe.resolution), math.log10(largest) + HEADROOM)
    positions = window.n_out if recipe.network.time_invariant else 1
    n_samples = window.n_in - positions + 1
    dtype = getattr(torch, recipe.training.precision)
    data = [
        WindowData(
            torch.as_tensor(surrogate.input_scaling.apply(split.inputs), dtype=dtype).to(device),
            torch.as_tensor(log_error.apply(np.maximum(error, recipe.resolution)), dtype=dtype).to(
                device
            ),
            Window(window.step, window.n_in, 1),
        )
        for split, error in zip(splits, errors, strict=True)
    ]
    network = FeedForwardModule(recipe.network, n_samples, len(surrogate.inputs), n_outputs)
    network.to(device, dtype)
    network.initialise(seeded_generator(recipe.training.seed, device))
    module = EstimatorModule(network, positions, log_error)
    history = train(module, data[0], data[1], recipe.training, checkpoint, progress)
    return ErrorEstimator(network.freeze(), log_error, positions), history


def block_errors(surrogate: Surrogate, split: Split) -> FloatArray:
    """RMSE of the streamed outputs over the output window that ends at each sample.

    Returns:
        Relative to the outputs' scale, shape (n_trajectories, N + 1, n_outputs); entries
        before sample n_in, where no whole window is there, are zero.
    """
    window = surrogate.window
    result = np.zeros_like(split.outputs)
    for row, inputs, outputs in zip(result, split.inputs, split.outputs, strict=True):
        errors = surrogate.predict_newest(inputs) - outputs[1:]
        row[window.n_in :] = moving_rms(errors[window.n_truncated :], window.n_out)
    return result / surrogate.output_scaling.scale
