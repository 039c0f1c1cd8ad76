"""A run says in one line how long it still takes, whatever its stages show of themselves.

How long a training takes is known once a part of it is done. The stages behind it are estimated by
those before: companion and error bound by the training of the surrogate, measuring by the time of
a simulation. So nothing is measured for this, and no stage waits for it. A search for sizes may
end at any size: nothing is reported before it has ended.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import final

from slide_fmu.core.progress import Progress, Stages, part_of
from slide_fmu.pipeline.job import Tell
from slide_fmu.recipe.recipe import Recipe

WINDOW, CURVE, DATA, TRAINING = "window", "learning curve", "trajectories", "training"
ESTIMATE, BOUND, MEASURING = "error estimate", "error bound", "measuring"
STAGES = {
    "recipe": WINDOW,
    "window": WINDOW,
    "data of curve point": CURVE,
    "fit of curve point": CURVE,
    "time of a simulation": CURVE,
    "trajectories": DATA,
    "choice of features": TRAINING,
    "surrogate": TRAINING,
    "error estimator": ESTIMATE,
    "companion": BOUND,
    "error bound": BOUND,
}
"""Stages of a run by the first words of the progress that they open; all others measure."""

OF_TRAINING = {ESTIMATE: 0.5, BOUND: 1.0}
OF_SEARCH = {ESTIMATE: 0.2, BOUND: 0.4}
"""Time of a stage over that of the training of the surrogate, where that is a training alone, and
where it begins with a search for sizes or features. A companion has about the same size."""
OF_SIMULATION, WRITING = 10.0, 3.0
"""Measuring takes about OF_SIMULATION times as long as one process simulates the trajectories in
range: with finer steps, and under inputs of further kinds. Documents and FMU take WRITING s."""
EARLY = 0.1
"""The time of a stage is extrapolated from this part of it on."""
SOON = 5.0
"""Less than this time in s is not worth a line."""


@final
class TimeLeft:
    """A TimeLeft listens to the progress of a run, and reports how long the run still takes.

    It does so when it first knows, where a stage begins, and when the time has halved before the
    last stage.

    Args:
        recipe: the recipe; its numbers may still be first guesses.
        finds_numbers: whether numbers are found from a learning curve.
        workers: number of processes that simulate; one per core if None.
        tell: shows a sentence.
    """

    def __init__(
        self, recipe: Recipe, finds_numbers: bool, workers: int | None, tell: Tell
    ) -> None:
        self._recipe, self._tell = recipe, tell
        self._workers = max(1, (os.cpu_count() or 1) if workers is None else workers)
        self._stages = stages_of(recipe, finds_numbers)
        self._begun: dict[str, float] = {}
        self._expected: dict[str, float] = {}
        self._of_training = OF_TRAINING
        self._last = math.inf

    def watched(self, bar: Stages) -> Stages:
        """Return the same progress of stages, to which this object listens."""

        def opened(name: str) -> Progress:
            stage = next((s for words, s in STAGES.items() if name.startswith(words)), MEASURING)
            shown = bar(name)
            return _WatchedProgress(shown, stage, self) if stage in self._stages else shown

        return opened

    def begin(self, stage: str, searches: bool = False) -> bool:
        """Take note of a stage's beginning, perhaps with a search; False where it had begun."""
        begins = stage not in self._begun
        self._begun.setdefault(stage, time.monotonic())
        if searches and stage == TRAINING:
            self._of_training = OF_SEARCH
        return begins

    def hear(self, stage: str, begins: bool, course: _Course) -> None:
        """Take note of the course of a stage, and report the time left if there is news of it."""
        before = course.begin - self._begun[stage]
        if course.made >= max(1.0, EARLY * course.total):
            each = course.passed / course.made
            self._expect(stage, before + each * (course.total - course.first), each)
        left = self._left(stage, before + course.passed)
        news = begins or (stage != MEASURING and left is not None and left < self._last / 2)
        if left is not None and left > SOON and news:
            self._last = left
            count = self._stages.index(stage)
            self._tell(f"about {_rounded(left)} left, {count} of {len(self._stages)} stages done")

    def _expect(self, stage: str, seconds: float, each: float) -> None:
        """Expect a time of a stage in s, of which each part takes ``each``, and of later ones."""
        if stage == DATA:
            data, validation = self._recipe.data, self._recipe.validation
            count = self._recipe.unseen(None, self._workers * each)
            measured = count * (validation.duration or data.duration)
            cost = self._workers * each / (data.duration + data.burn_in)
            self._expected[MEASURING] = OF_SIMULATION * cost * measured + WRITING
        elif stage == TRAINING:
            self._expected |= {one: part * seconds for one, part in self._of_training.items()}
        if stage in (DATA, TRAINING):
            self._expected[stage] = seconds

    def _left(self, stage: str, passed: float) -> float | None:
        """Return the time that the run still takes in s; None if it is not known yet."""
        others = self._stages[self._stages.index(stage) + 1 :]
        if any(one not in self._expected for one in (stage, *others)):
            return None
        return max(0.0, self._expected[stage] - passed) + sum(self._expected[s] for s in others)


@dataclass
class _Course:
    """How far a progress is: its beginning in s, and the parts done then, now, and in all."""

    begin: float
    first: int
    done: int
    total: int

    @property
    def passed(self) -> float:
        """The time since the beginning in s."""
        return time.monotonic() - self.begin

    @property
    def made(self) -> int:
        """The parts done since the beginning."""
        return self.done - self.first


def stages_of(recipe: Recipe, finds_numbers: bool) -> Sequence[str]:
    """Return the stages of the run of a recipe, in their order."""
    return [
        WINDOW,
        *([CURVE] if finds_numbers else []),
        DATA,
        TRAINING,
        *([ESTIMATE] if recipe.estimator is not None else []),
        *([BOUND] if recipe.bound is not None else []),
        MEASURING,
    ]


@final
@dataclass
class _WatchedProgress:
    """A progress that is shown as before, and heard; named parts of it are shown alone."""

    shown: Progress
    stage: str
    clock: TimeLeft
    course: _Course = field(init=False)
    reports: int = 0

    def __call__(self, done: int, total: int, error: float | None = None) -> None:
        self.shown(done, total, error)
        begins = self.clock.begin(self.stage)
        if self.reports < 2:  # the first part includes the start of processes
            self.course = _Course(time.monotonic(), done, done, total)
        self.reports += 1
        self.course.done, self.course.total = done, total
        self.clock.hear(self.stage, begins, self.course)

    def part(self, name: str, at_most: bool) -> Progress:
        shown = part_of(self.shown, name, at_most)
        if name:
            self.clock.begin(self.stage, searches=True)
            return shown
        return _WatchedProgress(shown, self.stage, self.clock)


def _rounded(seconds: float) -> str:
    """Write a time in s, min or h, to about a tenth."""
    if seconds < 90:
        return f"{max(5, 5 * round(seconds / 5))} s"
    minutes = round(seconds / 60)
    if minutes < 90:
        return f"{minutes} min"
    hours, tens = divmod(round(minutes / 10), 6)
    return f"{hours} h {10 * tens:02d} min"
