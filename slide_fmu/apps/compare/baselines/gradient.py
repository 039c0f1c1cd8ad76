"""GRU and the paper's feed-forward network are trained with Adam within the budget."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import torch

from slide_fmu.apps.compare.baselines.base import Baseline, Budget, FittedBaseline, Frozen, Stepped
from slide_fmu.apps.compare.baselines.lesson import Lesson
from slide_fmu.core.progress import Progress
from slide_fmu.core.signals import FloatArray
from slide_fmu.fitting.feed_forward import fit_feed_forward
from slide_fmu.fitting.problem import Problem
from slide_fmu.fitting.training import train
from slide_fmu.fitting.windows import WindowData
from slide_fmu.recipe.learning import FeedForwardRecipe, TrainingRecipe

MOST_STEPS = 20_000
"""Largest number of optimizer steps in a training; the budget may end it before."""
PROBE = 9
"""Number of steps over which the time of a step is measured."""
VALIDATIONS, SHARE = 20, 0.2
"""Number of validations of a training, and the largest share of the budget for them."""
FEED_FORWARD = FeedForwardRecipe(family="feed_forward", hidden=(100, 100), activation="relu")
"""The paper's network of the Duffing oscillator: two layers of 100 ReLU units."""
GRU_UNITS = 32
"""Number of states of a GRU."""
BATCHES = {"feed_forward": 256, "gru": 64}
RATES = {"feed_forward": 1e-3, "gru": 5e-3}
"""Windows per step, and highest learning rate, of both trainings."""

Fit = Callable[[TrainingRecipe, Path, Progress], Baseline]
"""Trains a network by the recipe's table, with a path for its checkpoint."""


def fit_paper_network(lesson: Lesson, budget: Budget, progress: Progress) -> FittedBaseline:
    """Train the paper's feed-forward network on the window of the lesson.

    Raises:
        TrainingError: the training diverged.
    """
    n_outputs = lesson.n_outputs

    def fit(recipe: TrainingRecipe, place: Path, progress: Progress) -> Baseline:
        training, validation = (_tensors(lesson, which) for which in ("training", "validation"))
        problem = Problem(lesson.window, lesson.features, training, validation, place)
        network = fit_feed_forward(problem, FEED_FORWARD, recipe, progress).network
        return Frozen(network, lesson.window, n_outputs)

    return _within(budget, "feed_forward", fit, lesson.seed, progress, "2 x 100 ReLU units")


def fit_gru(lesson: Lesson, budget: Budget, progress: Progress) -> FittedBaseline:
    """Train a GRU, from zero state at the beginning of each window of the lesson.

    Raises:
        TrainingError: the training diverged.
    """

    def fit(recipe: TrainingRecipe, place: Path, progress: Progress) -> Baseline:
        torch.manual_seed(recipe.seed)
        module = GruModule(lesson)
        data = [
            WindowData(*_tensors(lesson, which), lesson.window)
            for which in ("training", "validation")
        ]
        train(module, data[0], data[1], recipe, place, progress)
        return Gru(module, lesson)

    return _within(budget, "gru", fit, lesson.seed, progress, f"{GRU_UNITS} states")


class GruModule(torch.nn.Module):
    """A GruModule maps windows of features to the outputs at the end of each window. Final."""

    def __init__(self, lesson: Lesson) -> None:
        super().__init__()
        n_outputs = lesson.n_outputs
        self.n_out = lesson.window.n_out
        self.gru = torch.nn.GRU(lesson.features.n_signals, GRU_UNITS, batch_first=True)
        self.readout = torch.nn.Linear(GRU_UNITS, n_outputs)

    def forward(self, windows: torch.Tensor) -> torch.Tensor:
        """Map features (B, n_in, n_features) to outputs (B, n_out * n_outputs)."""
        states, _ = self.gru(windows)
        found: torch.Tensor = self.readout(states[:, -self.n_out :]).flatten(1)
        return found


class Gru(Stepped):
    """A Gru runs along a sequence; the first input is held for one window before. Final."""

    def __init__(self, module: GruModule, lesson: Lesson) -> None:
        self._module, self._features = module, lesson.features
        self._lead = lesson.window.n_in
        self.parameters = sum(weights.numel() for weights in module.parameters())
        self.start_length = 0

    def simulate(self, inputs: FloatArray, start: FloatArray) -> FloatArray:
        with torch.inference_mode():
            states, _ = self._module.gru(self._seen(inputs))
            values = self._module.readout(states[0, self._lead :])
        return np.asarray(values.numpy(), dtype=np.float64)

    def step_along(self, inputs: FloatArray, start: FloatArray) -> FloatArray:
        rows = self._seen(inputs)
        values = []
        with torch.inference_mode():
            _, state = self._module.gru(rows[:, : self._lead])
            for k in range(self._lead, rows.shape[1]):
                out, state = self._module.gru(rows[:, k : k + 1], state)
                values.append(self._module.readout(out[0, 0]).numpy())
        return np.array(values, dtype=np.float64)

    def _seen(self, inputs: FloatArray) -> torch.Tensor:
        led_in = np.pad(inputs, ((self._lead, 0), (0, 0)), mode="edge")
        return torch.as_tensor(self._features.along(led_in[None]), dtype=torch.float32)


def _tensors(lesson: Lesson, which: str) -> tuple[torch.Tensor, torch.Tensor]:
    """Return features and outputs of a part of the lesson, in single precision."""
    inputs, outputs = getattr(lesson, which)
    seen = lesson.features.along(inputs)
    one, other = (torch.as_tensor(part, dtype=torch.float32) for part in (seen, outputs))
    return one, other


def _within(
    budget: Budget, kind: str, fit: Fit, seed: int, progress: Progress, words: str
) -> FittedBaseline:
    """Train for the number of steps that the budget allows; the schedule of rates ends with it."""

    def recipe(steps: int, validations: int) -> TrainingRecipe:
        values = {
            "seed": seed,
            "steps": steps,
            "batch": BATCHES[kind],
            "learning_rate": RATES[kind],
            "expert": {
                "gradient_clip": 1.0,
                "validate_every": math.ceil(steps / validations),
            },
        }
        return TrainingRecipe.model_validate(values)

    def seconds(steps: int, folder: Path) -> float:
        begin = time.process_time()
        fit(recipe(steps, 1), folder / f"{steps}.pt", lambda *_: None)
        (folder / f"{steps}.pt").unlink()
        return time.process_time() - begin

    with TemporaryDirectory() as name:
        folder = Path(name)
        seconds(1, folder)  # the first step loads libraries
        once = seconds(1, folder)
        step = max((seconds(PROBE, folder) - once) / (PROBE - 1), 1e-6)
        steps, validations = _affordable(budget.left, step, max(once - step, 1e-6))
        baseline = fit(recipe(steps, validations), folder / "training.pt", progress)
    return FittedBaseline(baseline, f"{words}, {steps} steps", cut=steps < MOST_STEPS)


def _affordable(left: float, step: float, validation: float) -> tuple[int, int]:
    """Return numbers of steps and validations that take at most the time left, in s."""
    validations = min(VALIDATIONS, max(1, int(SHARE * left / validation)))
    steps = int((left - validations * validation) / step)
    return min(MOST_STEPS, max(1, steps)), validations
