"""The companion of an error bound is a second network, which is trained next to the surrogate.

It is the same network again, or a larger one, trained on other trajectories. It shows the scale of
the surrogate's error only if it is about as accurate; otherwise the difference of both is its own
error. If it is more accurate, the difference is the surrogate's error. So a recipe may give it
more hidden units and a longer training (``bound.expert.companion``). Sizes that the recipe leaves
open are those found for the surrogate. A training may end in a worse minimum, so there are several
attempts (``bound.expert.attempts``). Where the training begins with an FMU, the companion begins
with that FMU's, once.

The first attempt needs nothing of the surrogate but its sizes. So it begins as soon as these are
known, in a program of its own, where there is a core for it; the result is the same.
"""

from __future__ import annotations

import os
from contextlib import ExitStack
from dataclasses import dataclass, replace
from types import TracebackType
from typing import final

import torch

from slide_fmu.bounds.known_start import companion_start
from slide_fmu.core.progress import ProgressListener, Stages, quiet_stages
from slide_fmu.core.scaling import Affine
from slide_fmu.data.isolated_process import EndedError, IsolatedCall, crosses
from slide_fmu.fitting.errors import TrainingError
from slide_fmu.fitting.history import History
from slide_fmu.fitting.network import SURROGATE, Fit, Part, fit_network
from slide_fmu.fitting.preparation import Work
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import System

COMPANION = "companion"
"""Name of the companion's stage in the progress and in the figures."""

ACCURATE = 1.3
"""Largest ratio of the validation errors of companion and surrogate. A less accurate companion
makes bounds wider, since its own error is most of the disagreement."""
SMALL, OF_SMALL = 2e-3, 2.0
"""Up to the first validation error, relative to the outputs' deviation, the second ratio is small
enough. On two masses that are fitted from known states, further attempts found none that was
better: 0.16 %, 0.30 % and 0.18 % beside the surrogate's 0.094 %."""


@dataclass(frozen=True, eq=False)
class Attempt:
    """An Attempt is a companion, with the course of its training."""

    companion: Surrogate
    history: History

    @property
    def error(self) -> float:
        """The best validation error, an RMS in scaled units."""
        return min(self.history.validation_error)


def is_accurate(error: float, beside: float) -> bool:
    """Return whether a companion is accurate enough beside the validation error of a surrogate."""
    return error <= ACCURATE * beside or error <= min(SMALL, OF_SMALL * beside)


@final
class Companion:
    """A Companion is trained next to its surrogate, within a ``with`` block.

    Args:
        work: the fit of the surrogate, whose recipe has an error bound.
        side_by_side: whether the first attempt may be a program of its own.

    Attributes:
        work: the same fit, whose progress raises an error of that program soon.
    """

    def __init__(self, work: Work, side_by_side: bool) -> None:
        self._own = replace(
            work, known=None if work.known is None else companion_start(work.known)
        )
        self._side_by_side = side_by_side and has_a_core(work)
        self._stack = ExitStack()
        self._given: tuple[Recipe, Affine] | None = None
        self._first: IsolatedCall[Attempt] | None = None
        self.work = replace(work, progress=self._watched(work.progress))

    def __enter__(self) -> Companion:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._stack.close()

    def begin(self, recipe: Recipe, outputs: Affine) -> None:
        """Begin the first attempt, with the sizes of a recipe and the scaling of the outputs."""
        self._given = recipe, outputs
        if self._side_by_side:
            sent = replace(self._own, progress=quiet_stages)
            call = IsolatedCall(
                _attempt_alone,
                (sent, recipe, outputs, 0),
                torch.get_num_threads(),
                stages=self._own.progress,
            )
            self._first = self._stack.enter_context(call)

    def of(self, fit: Fit) -> Attempt:
        """Return the most accurate companion of all attempts for a surrogate.

        Raises:
            TrainingError: a training diverged, or its program was ended.
        """
        recipe = self._own.recipe
        assert recipe.bound is not None
        beside = min(fit.histories[SURROGATE].validation_error)
        attempts: list[Attempt] = []
        for number in range(1 if self._own.known else recipe.bound.expert.attempts):
            attempts.append(self._attempt(fit, number))
            if is_accurate(attempts[-1].error, beside):
                break
        return min(attempts, key=lambda one: one.error)

    def _attempt(self, fit: Fit, number: int) -> Attempt:
        if number > 0 or self._first is None:
            given = self._given or (fit.recipe, fit.surrogate.output_scaling)
            return attempt(self._own, *given, number)
        try:
            return self._first.result()
        except EndedError as error:
            raise TrainingError(
                f"the companion of the error bound was trained in a program of its own: {error}. "
                "The memory may be full, or somebody ended it: the same command goes on from here"
            ) from error

    def _watched(self, stages: Stages) -> Stages:
        """Return stages whose progress raises an error of the other program, if there is one."""

        def require_no_error() -> None:
            if self._first is not None and self._first.failed:
                self._first.result()

        return lambda name: ProgressListener(stages(name), require_no_error)


def has_a_core(work: Work) -> bool:
    """Tell whether another program can train next to this one.

    It needs cores for the same number of threads, no GPU, which one training keeps busy, and a
    system that can be copied.
    """
    source = work.case.source
    threads = 2 * torch.get_num_threads()
    copied = not isinstance(source, System) or crosses(source)
    return work.device.type == "cpu" and usable_cores() >= threads and copied


def usable_cores() -> int:
    """Return the number of processor cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def attempt(work: Work, recipe: Recipe, outputs: Affine, number: int) -> Attempt:
    """Train a companion.

    Args:
        work: the fit, with the network that it begins with, if any.
        recipe: the recipe, with the sizes of the surrogate if the companion has the same.
        outputs: scaling of the outputs.
        number: number of the attempt, from 0.

    Raises:
        TrainingError: the training diverged.
    """
    split = "train" if recipe.data.companion == "train" else "companion"
    stage = COMPANION if number == 0 else f"{COMPANION}, attempt {number + 1}"
    case = work.case.with_recipe(recipe.of_companion(number))
    fit = fit_network(replace(work, case=case), Part(stage, split, "validation", outputs))
    return Attempt(fit.surrogate, fit.histories[stage])


def _attempt_alone(
    stages: Stages, task: tuple[Work, Recipe, Affine, int], threads: int
) -> Attempt:
    """Train a companion in a program of its own."""
    torch.set_num_threads(threads)
    work, recipe, outputs, number = task
    return attempt(replace(work, progress=stages), recipe, outputs, number)
