"""The training loop runs Adam with a schedule of rates and keeps the best validation weights.

Loss, optimizer and the selection of weights follow the paper (section "Training loss and
validation error"); warm-up, cosine decay and decoupled weight decay (AdamW: Loshchilov and Hutter,
2019) are additions.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch

from slide_fmu.core.progress import Progress, ProgressListener
from slide_fmu.fitting.adam import AdamW
from slide_fmu.fitting.checkpoint import read_checkpoint, reading, write_checkpoint
from slide_fmu.fitting.errors import TrainingError
from slide_fmu.fitting.history import History
from slide_fmu.fitting.windows import WindowData
from slide_fmu.recipe.learning import TrainingRecipe

VALIDATION_TARGETS, VALIDATION_LEAST = 16_384, 512
"""Number of output samples in a validation, and its smallest number of windows: its figures are
stable and cost little."""

VALIDATION_BATCH = 512
"""Number of windows that a validation evaluates at once, which limits its memory."""

SEED_STRIDE = 1_000_003
"""Distance of two seeds in their random numbers; torch's generator uses 32 bits."""

ADAM_EPSILON = {"float32": 1e-8, "float64": 1e-16}
"""Guard of Adam's denominator: far below the smallest significant gradients of each precision."""


@dataclass(frozen=True)
class Objective:
    """An Objective defines what a training minimises and how the loss is reported.

    Attributes:
        loss: returns the mean loss of a batch from the model's values (B, n) and the targets (B,
            m).
        error: returns the reported figure for a mean loss; it rises with the loss.
        relative: whether the figure is a relative RMSE if outputs are scaled by their standard
            deviation.
        odd: whether the targets change their sign with the inputs, as the outputs of an odd system
            do.
    """

    loss: Callable[[torch.Tensor, torch.Tensor], torch.Tensor]
    error: Callable[[float], float]
    odd: bool = True
    relative: bool = False


MEAN_SQUARE = Objective(
    lambda values, targets: (values - targets).square().mean(), math.sqrt, relative=True
)
"""The mean squared error, reported as RMSE (paper)."""


def train(
    model: torch.nn.Module,
    training: WindowData,
    validation: WindowData,
    recipe: TrainingRecipe,
    checkpoint: Path,
    progress: Progress,
    objective: Objective = MEAN_SQUARE,
) -> History:
    """Train a model in place to the weights of the best validation, and return the whole course.

    A training that was killed resumes from its checkpoint and ends with the same weights as an
        uninterrupted one: the order of the windows depends only on the seed and the number of the
        step.

    Args:
        model: maps features of input windows (B, n_in, n_features) to values that the objective
            compares with the targets (B, n_out * n_targets).
        training: training windows.
        validation: windows that select the weights.
        recipe: optimizer, schedule of rates and number of steps.
        checkpoint: file for the state between validations.
        progress: called at the start and after every validation.
        objective: defines what is minimised.

    Raises:
        TrainingError: the loss or the validation error is not finite, or the checkpoint cannot be
            read.
    """
    optimizer = AdamW(
        model.parameters(),
        weight_decay=recipe.expert.weight_decay,
        epsilon=ADAM_EPSILON[recipe.expert.precision],
    )
    state = _restore(checkpoint, model, optimizer)
    generator = torch.Generator(device=training.inputs.device)
    loss_sum = 0.0
    shown = ProgressListener(progress, with_error=objective.relative)
    shown(state["step"], recipe.steps, state["best_error"])
    for step in range(state["step"], recipe.steps):
        # every step has its own seed, so its batch is the same after a restart
        generator.manual_seed((recipe.seed * SEED_STRIDE + step) % 2**32)
        windows, targets = _batch(training, recipe, objective, generator)
        optimizer.forget_gradients()
        loss = objective.loss(model(windows), targets)
        torch.autograd.backward(loss)
        if recipe.expert.gradient_clip is not None:
            torch.nn.utils.clip_grad_norm_(model.parameters(), recipe.expert.gradient_clip)
        optimizer.step(learning_rate(recipe, step))
        loss_sum += float(loss.detach())
        if not math.isfinite(loss_sum):
            raise TrainingError(_divergence(f"loss at step {step}"))
        if (step + 1) % recipe.expert.validate_every == 0 or step + 1 == recipe.steps:
            steps_since = step + 1 - (state["history"][-1][0] if state["history"] else 0)
            error = evaluate(model, validation, objective)
            training_error = objective.error(loss_sum / steps_since)
            state["history"].append((step + 1, training_error, error))
            if error < state["best_error"]:
                state["best_error"] = error
                state["best"] = {k: v.detach().clone() for k, v in model.state_dict().items()}
            state["step"], loss_sum = step + 1, 0.0
            both = {"model": model.state_dict(), "optimizer": optimizer.state_dict()}
            write_checkpoint(checkpoint, {**state, **both})
            shown(step + 1, recipe.steps, state["best_error"])
    model.load_state_dict(state["best"])
    steps, losses, errors = zip(*state["history"], strict=True)
    return History(steps, losses, errors)


def evaluate(
    model: torch.nn.Module, data: WindowData, objective: Objective = MEAN_SQUARE
) -> float:
    """Return the error over windows in equal distances, as the objective reports it.

    The same windows are used every time, so that two validations differ only by the weights.

    Raises:
        TrainingError: the model gives values that are not finite.
    """
    total, least = 0.0, max(VALIDATION_LEAST, VALIDATION_TARGETS // data.window.n_out)
    numbers = data.evenly_chosen(least)
    with torch.no_grad():
        for part in torch.split(numbers, VALIDATION_BATCH):
            windows, targets = data.cut(part)
            total += float(objective.loss(model(windows), targets)) * len(part)
    if not math.isfinite(total):
        raise TrainingError(_divergence("validation error"))
    return objective.error(total / len(numbers))


def learning_rate(recipe: TrainingRecipe, step: int) -> float:
    """Return the learning rate at a step from 0: linear warm-up, then a cosine down."""
    warm_up = recipe.expert.warm_up * recipe.steps
    if step < warm_up:
        return recipe.learning_rate * (step + 1) / (warm_up + 1)
    progress = (step - warm_up) / max(1.0, recipe.steps - warm_up)
    cosine = 0.5 * (1 + math.cos(math.pi * progress))
    last = recipe.expert.final_learning_rate
    return recipe.learning_rate * (last + (1 - last) * cosine)


def _batch(
    data: WindowData, recipe: TrainingRecipe, objective: Objective, generator: torch.Generator
) -> tuple[torch.Tensor, torch.Tensor]:
    """Draw a batch: windows (B, n_in, n_features) and their targets (B, n_out * n_targets)."""
    device = data.inputs.device
    numbers = torch.randint(data.n_windows, (recipe.batch,), generator=generator, device=device)
    windows, targets = data.cut(numbers)
    if recipe.expert.input_jitter > 0:
        noise = torch.randn(windows.shape, generator=generator, device=device, dtype=windows.dtype)
        windows = windows + recipe.expert.input_jitter * noise
    if recipe.expert.flip_signs:
        signs = torch.randint(2, (recipe.batch,), generator=generator, device=device) * 2 - 1
        windows = windows * signs[:, None, None]
        targets = targets * signs[:, None] if objective.odd else targets
    return windows, targets


def _divergence(value: str) -> str:
    return f"training diverged: {value} is not finite; lower training.learning_rate"


def _restore(checkpoint: Path, model: torch.nn.Module, optimizer: AdamW) -> dict[str, Any]:
    """Load a checkpoint into model and optimizer and return the course so far, or a new one."""
    saved: dict[str, Any] | None = read_checkpoint(checkpoint, next(model.parameters()).device)
    if saved is None:
        return {"step": 0, "history": [], "best_error": math.inf, "best": None}
    with reading(checkpoint):  # another version may have written it
        model.load_state_dict(saved["model"])
        optimizer.load_state_dict(saved["optimizer"])
        return {key: saved[key] for key in ("step", "history", "best_error", "best")}
