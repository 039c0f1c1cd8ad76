"""A small regression with a known answer; as a program, a training that tests can kill.

Usage: regression.py CHECKPOINT WEIGHTS
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

import torch

from slide_fmu.core.progress import Progress
from slide_fmu.core.window import Window
from slide_fmu.fitting.history import History
from slide_fmu.fitting.training import train
from slide_fmu.fitting.windows import WindowData
from slide_fmu.recipe.learning import AdamExpert, TrainingRecipe
from tests.progress import silent

WINDOW = Window(0.1, 4, 2)
EXACT = torch.tensor([[0.5, -1.0, 2.0, 0.25], [0.0, 1.5, -0.5, 1.0]], dtype=torch.float64)
"""Two outputs by four inputs: y[s+3] and y[s+4] of inputs u[s .. s+3]."""

RECIPE = TrainingRecipe(
    seed=3, steps=200, batch=16, learning_rate=0.02,
    expert=AdamExpert(
        validate_every=20, flip_signs=True, input_jitter=0.1, weight_decay=0.01,
        precision="float64",
    ),
)  # fmt: skip
"""Everything that draws random numbers in the loop is switched on."""


def regression_data(seed: int, noise: float = 0.0) -> WindowData:
    """Trajectories of one window each, whose outputs are EXACT times inputs."""
    generator = torch.Generator().manual_seed(seed)
    inputs = torch.randn(64, 4, 1, generator=generator, dtype=torch.float64)
    targets = torch.zeros(64, 5, 1, dtype=torch.float64)
    targets[:, 3:, 0] = inputs[:, :, 0] @ EXACT.T
    targets += noise * torch.randn(targets.shape, generator=generator, dtype=torch.float64)
    return WindowData(inputs, targets, WINDOW)


class Slow(torch.nn.Module):
    """A linear map, slow enough to be killed between two checkpoints."""

    def __init__(self, delay: float = 0.0) -> None:
        super().__init__()
        self.linear = torch.nn.Linear(4, 2, dtype=torch.float64)
        self.delay = delay
        with torch.no_grad():
            self.linear.weight.fill_(0.1)
            self.linear.bias.fill_(0.3)

    def forward(self, windows: torch.Tensor) -> torch.Tensor:
        time.sleep(self.delay)
        return self.linear(windows.flatten(1))


def fit(
    checkpoint: Path, progress: Progress = silent, delay: float = 0.0
) -> tuple[dict[str, Any], History]:
    """Train; gives the weights and the history."""
    model = Slow(delay)
    history = train(
        model, regression_data(1, 0.1), regression_data(2, 0.1), RECIPE, checkpoint, progress
    )
    return model.state_dict(), history


def say(done: int, total: int, best: float) -> None:
    """Tell the parent how far the training is."""
    print(done, flush=True)


if __name__ == "__main__":
    weights, _ = fit(Path(sys.argv[1]), say, delay=0.01)
    torch.save(weights, sys.argv[2])
