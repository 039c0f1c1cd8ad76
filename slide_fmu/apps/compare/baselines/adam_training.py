"""Adam trains a network for a given CPU time: its learning rate follows the time that is spent."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import torch

from slide_fmu.apps.compare.baselines.base import Budget, Course
from slide_fmu.core.progress import Progress
from slide_fmu.fitting.adam import AdamW
from slide_fmu.fitting.errors import TrainingError

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
