"""GRU and the paper's feed-forward network are trained with Adam within the budget."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import final

import numpy as np
import torch

from slide_fmu.apps.compare.baselines.base import (
    Budget,
    Course,
    FittedBaseline,
    NetworkBaseline,
    SteppedBaseline,
)
from slide_fmu.apps.compare.baselines.lesson import Lesson
from slide_fmu.core.progress import Progress
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import Window
from slide_fmu.fitting.adam import AdamW
from slide_fmu.fitting.errors import TrainingError
from slide_fmu.fitting.feed_forward import FeedForwardModule
from slide_fmu.fitting.training import evaluate
from slide_fmu.fitting.windows import WindowData
from slide_fmu.recipe.learning import FeedForwardRecipe

MOST_STEPS = 20_000
"""Largest number of steps of a training; the budget may end it before."""
VALIDATIONS, SHARE = 20, 0.15
"""Number of validations of a training, and the largest share of the budget for them."""
WARM_UP = 0.05
"""Share of a training in which the learning rate rises."""
LONGEST_GRADIENT = 1.0
"""Longer gradients are shortened to this norm."""


@dataclass(frozen=True, eq=False)
class AdamTraining:
    """An AdamTraining lasts for a given CPU time.

    Attributes:
        module: the network, trained in place to the weights of its best validation.
        loss: draws a batch and returns its loss.
        error: returns the validation error.
        rate: highest learning rate.
    """

    module: torch.nn.Module
    loss: Callable[[], torch.Tensor]
    error: Callable[[], float]
    rate: float

    def run(self, budget: Budget, progress: Progress) -> Course:
        """Train until the budget is spent, or for ``MOST_STEPS`` steps.

        Raises:
            TrainingError: no validation error is finite.
        """
        optimizer = AdamW(self.module.parameters())
        kept: dict[str, torch.Tensor] = {}
        errors: list[tuple[float, float]] = []
        best, step, validation, every = math.inf, 0, 0.0, 1 / VALIDATIONS
        first, due = budget.spent, 0.0
        progress(0, VALIDATIONS)
        while True:
            time = (budget.spent - first) / max(budget.seconds - validation - first, 1e-9)
            part = min(1.0, max(time, step / MOST_STEPS))
            if step and part >= min(due, 1.0):
                begin = budget.spent
                with torch.no_grad():
                    error = self.error()
                validation = budget.spent - begin
                every = max(1 / VALIDATIONS, validation / (SHARE * budget.seconds))
                due = part + every
                if error < best:
                    best = error
                    kept = {k: v.detach().clone() for k, v in self.module.state_dict().items()}
                errors.append((part, best))
                progress(min(VALIDATIONS, int(VALIDATIONS * part)), VALIDATIONS, best)
                if part >= 1.0:
                    break
            self._step(optimizer, self.rate * schedule(part))
            step += 1
        if not kept:
            raise TrainingError("training diverged: no validation error is finite")
        self.module.load_state_dict(kept)
        half = min((error for part, error in errors if part <= 0.5), default=None)
        return Course(step, best, half, cut=step < MOST_STEPS)

    def _step(self, optimizer: AdamW, rate: float) -> None:
        optimizer.forget_gradients()
        torch.autograd.backward(self.loss())
        torch.nn.utils.clip_grad_norm_(self.module.parameters(), LONGEST_GRADIENT)
        optimizer.step(rate)


def schedule(part: float) -> float:
    """Return the share of the highest learning rate at a part of the training, in 0 .. 1.

    It rises linearly and then falls like a cosine.
    """
    if part < WARM_UP:
        return (part + 0.01) / (WARM_UP + 0.01)
    return 0.5 * (1 + math.cos(math.pi * (part - WARM_UP) / (1 - WARM_UP)))


FEED_FORWARD = FeedForwardRecipe(family="feed_forward", hidden=(100, 100), activation="relu")
"""The paper's network of the Duffing oscillator: two layers of 100 ReLU units."""
GRU_UNITS = 32
"""Number of states of a GRU."""
BATCHES = {"feed_forward": 256, "gru": 32}
RATES = {"feed_forward": 1e-3, "gru": 2e-2}
"""Windows per step, and highest learning rate, of both trainings."""
STARTING, SCORED = 0.35, 0.55
"""A GRU learns from parts of trajectories: number of samples in which it starts, and of scored
ones, relative to the memory length. A step takes a time in
proportion to their length, so short parts allow more steps than whole windows do."""
FEWEST = 8
"""Smallest number of samples of either kind."""


def fit_paper_network(lesson: Lesson, budget: Budget, progress: Progress) -> FittedBaseline:
    """Train the paper's feed-forward network on the window of the lesson.

    Raises:
        TrainingError: the training diverged.
    """
    window = lesson.window
    module = FeedForwardModule(
        FEED_FORWARD, window.n_in, lesson.features, window.n_out * lesson.n_outputs
    )
    module.initialise(torch.Generator().manual_seed(lesson.seed))
    course = _trained(module, lesson, window, "feed_forward", budget, progress)
    baseline = NetworkBaseline(module.freeze(), window, lesson.n_outputs)
    words = f"2 x 100 ReLU units, {course.steps} steps"
    return FittedBaseline(baseline, words, course.cut, course)


def fit_gru(lesson: Lesson, budget: Budget, progress: Progress) -> FittedBaseline:
    """Train a GRU on parts of trajectories, from zero state at the beginning of each.

    Raises:
        TrainingError: the training diverged.
    """
    torch.manual_seed(lesson.seed)
    memory, samples = lesson.window.memory_length, lesson.training[0].shape[1]
    starting = min(max(FEWEST, math.ceil(STARTING * memory)), samples // 2)
    scored = min(max(FEWEST, math.ceil(SCORED * memory)), samples - starting)
    module = GruModule(lesson, scored)
    window = Window(lesson.window.step, starting + scored, scored)
    course = _trained(module, lesson, window, "gru", budget, progress)
    words = f"{GRU_UNITS} states, {course.steps} steps"
    return FittedBaseline(Gru(module, lesson), words, course.cut, course)


@final
class GruModule(torch.nn.Module):
    """A GruModule maps parts of features to the outputs at the end of each part."""

    def __init__(self, lesson: Lesson, scored: int) -> None:
        super().__init__()
        self.scored = scored
        self.gru = torch.nn.GRU(lesson.features.n_signals, GRU_UNITS, batch_first=True)
        self.readout = torch.nn.Linear(GRU_UNITS, lesson.n_outputs)

    def forward(self, windows: torch.Tensor) -> torch.Tensor:
        """Map features (B, n_in, n_features) to outputs (B, scored * n_outputs)."""
        states, _ = self.gru(windows)
        outputs: torch.Tensor = self.readout(states[:, -self.scored :]).flatten(1)
        return outputs


@final
class Gru(SteppedBaseline):
    """A Gru runs along a sequence; the first input is held for one window before."""

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


def _trained(
    module: torch.nn.Module,
    lesson: Lesson,
    window: Window,
    kind: str,
    budget: Budget,
    progress: Progress,
) -> Course:
    """Train a network on windows at all phases of the training trajectories."""
    data, judging = (
        WindowData(*_tensors(lesson, which), window) for which in ("training", "validation")
    )
    generator = torch.Generator().manual_seed(lesson.seed)

    def loss() -> torch.Tensor:
        numbers = torch.randint(data.n_windows, (BATCHES[kind],), generator=generator)
        windows, targets = data.cut(numbers)
        errors: torch.Tensor = module(windows) - targets
        return errors.square().mean()

    training = AdamTraining(module, loss, lambda: evaluate(module, judging), RATES[kind])
    return training.run(budget, progress)
