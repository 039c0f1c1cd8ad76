"""A run says in one line how long it still takes, whatever its stages show of themselves.

Before anything is done, the time of each stage is counted work (``work_estimate`` next to this
module). What the stages so far really took corrects those behind them, and a part of a stage that
is done says how long the rest of it takes. A search has a least and a largest time, until it has
ended.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import final

from slide_fmu.core.progress import Progress, Stages, part_of, show_whole
from slide_fmu.data.answers import asked_of_sources
from slide_fmu.pipeline.job import Job, Tell
from slide_fmu.pipeline.numbers import states_at_start, trajectory_time
from slide_fmu.pipeline.run_folder import RunFolder
from slide_fmu.pipeline.work_estimate import (
    COMPANION,
    CPU_MINUTES,
    CURVE,
    DATA,
    ESTIMATE,
    HEAD,
    MEASURING,
    ORDER,
    TRAINING,
    WINDOW,
    Span,
    estimated_work,
    in_words,
)
from slide_fmu.recipe.case import Case
from slide_fmu.systems.base import System

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
    "companion": COMPANION,
    "error bound": HEAD,
}
"""Stages of a run by the first words of the progress that they open; all others measure."""

SIMULATES = DATA, MEASURING
"""Stages whose time is that of simulations; all others train."""
EARLY = 0.1
"""The time of a stage is extrapolated from this part of it on."""
SOON = 5.0
"""Less than this time in s is not worth a line."""
SLOWEST = 30.0
"""No stage is expected to take longer than this multiple of its counted work: then it is another
work than was counted."""


@final
class TimeLeft:
    """A TimeLeft listens to the progress of a run, and reports how long the run still takes.

    It shows that in the line of the whole run, where a terminal has one. Elsewhere it says so
    where a stage begins, and when the time has halved before the last stage. Progress may come
    from several threads.

    Args:
        work: computing time of each stage in s, in the order of the stages.
        workers: number of processes that simulate.
        side_by_side: whether the companion of a bound is trained next to the surrogate.
        tell: shows a sentence.
    """

    def __init__(
        self, work: Mapping[str, Span], workers: int, side_by_side: bool, tell: Tell
    ) -> None:
        self._workers, self._side_by_side = workers, side_by_side
        self._tell, self._lock = tell, threading.RLock()
        self._begun: dict[str, float] = {}
        self._done: set[str] = set()
        self._took: dict[str, float] = {}
        self._ends: dict[str, float] = {}
        self._last = math.inf
        self._shows: Stages | None = None
        self.count(work)

    def count(self, work: Mapping[str, Span]) -> None:
        """Take other computing times of the stages, when more is known of the work."""
        self._work = {
            stage: work[stage].times(1 / self._workers if stage in SIMULATES else 1.0)
            for stage in ORDER
            if stage in work
        }

    def watched(self, bar: Stages) -> Stages:
        """Return the same progress of stages, to which this object listens."""
        self._shows = bar

        def opened(name: str) -> Progress:
            stage = next((s for words, s in STAGES.items() if name.startswith(words)), MEASURING)
            shown = bar(name)
            return _WatchedProgress(shown, stage, self) if stage in self._work else shown

        return opened

    def begin(self, stage: str) -> bool:
        """Take note of a stage's beginning, which ends those before; False where it had begun."""
        with self._lock:
            if stage in self._begun:
                return False
            now = time.monotonic()
            for before in list(self._work)[: list(self._work).index(stage)]:
                goes_on = self._side_by_side and (before, stage) == (TRAINING, COMPANION)
                if not goes_on and before not in self._done:
                    self._done.add(before)
                    if before in self._begun:  # otherwise it was done by an earlier run
                        self._took[before] = now - self._begun[before]
            self._begun[stage] = now
            return True

    def hear(self, stage: str, begins: bool, course: _Course | None) -> None:
        """Take note of the course of a stage, and show the time that is left."""
        with self._lock:
            told = course is not None and course.made >= max(1.0, EARLY * course.total)
            # a part of a curve, or of what is measured, says nothing about the others
            if course is not None and told and stage not in (CURVE, MEASURING):
                each = course.passed / course.made
                self._ends[stage] = time.monotonic() + each * (course.total - course.done)
            left = self.left()
            text = f"{in_words(left)} left, {len(self._done)} of {len(self._work)} stages done"
            if self._shows is not None and show_whole(self._shows, text):
                return
            middle = math.sqrt(max(left.low, 1.0) * max(left.high, 1.0))
            halved = stage != MEASURING and middle < self._last / 2
            if left.high > SOON and (begins or halved):
                self._last = middle
                self._tell(text)

    def left(self) -> Span:
        """Return the time that the run still takes in s."""
        rests = {stage: self._rest(stage) for stage in self._work if stage not in self._done}
        if self._side_by_side and TRAINING in rests and COMPANION in rests:
            pair = rests.pop(TRAINING), rests.pop(COMPANION)
            longer = Span(max(one.low for one in pair), max(one.high for one in pair))
            return sum(rests.values(), longer)
        return sum(rests.values(), Span())

    def _rest(self, stage: str) -> Span:
        """Return the time that a stage still takes in s."""
        now = time.monotonic()
        if stage in self._ends:
            return Span(*(max(0.0, self._ends[stage] - now),) * 2)
        whole, passed = self._expected(stage), now - self._begun.get(stage, now)
        return Span(max(0.0, whole.low - passed), max(0.0, whole.high - passed))

    def _expected(self, stage: str) -> Span:
        """Return the time of a stage in s, as the others have taken it so far.

        Those of its kind count, if enough of their work is done.
        """
        kind = stage in SIMULATES
        ended = [one for one in self._took if self._work.get(one, Span()).high > 0.0]
        if not ended:
            return self._work[stage]
        taken = [one for one in ended if (one in SIMULATES) == kind]
        counted = sum((self._work[one] for one in taken), Span())
        if counted.high < SOON:  # what little work really took says little about much of it
            taken = ended
            counted = sum((self._work[one] for one in taken), Span())
        took = max(sum(self._took[one] for one in taken), SOON / SLOWEST)
        # what it took lies in the range that was counted, or beyond one of its ends
        factor = took / min(max(took, counted.low), counted.high)
        return self._work[stage].times(min(max(factor, 1 / SLOWEST), SLOWEST))


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


@final
@dataclass
class _WatchedProgress:
    """A progress that is shown as before, and heard; named parts of it tell no time."""

    shown: Progress
    stage: str
    clock: TimeLeft
    named: bool = False
    course: _Course = field(init=False)
    reports: int = 0

    def __call__(self, done: int, total: int, error: float | None = None) -> None:
        self.shown(done, total, error)
        begins = self.clock.begin(self.stage)
        if self.reports < 2:  # the first part includes the start of processes
            self.course = _Course(time.monotonic(), done, done, total)
        self.reports += 1
        self.course.done, self.course.total = done, total
        self.clock.hear(self.stage, begins, None if self.named else self.course)

    def part(self, name: str, at_most: bool) -> Progress:
        shown = part_of(self.shown, name, at_most)
        return _WatchedProgress(shown, self.stage, self.clock, named=bool(name))


def counted_work(job: Job) -> dict[str, Span]:
    """Return the computing time of each stage of a job in s, before it is done."""
    recipe, source = job.recipe, job.case.source
    cost = cost_of_second(source, job.case, job.folder, job.bar)
    signals = len(source.inputs), len(source.outputs)
    states = None if job.sizing is None else job.sizing.states
    known = states_at_start(recipe, source)
    return estimated_work(recipe, job.open_keys, cost, signals, states, known)


@asked_of_sources
def cost_of_second(system: System, case: Case, folder: RunFolder, bar: Stages) -> float:
    """Return the time in s in which one process simulates a second; it is measured once."""
    data = case.recipe.data
    return trajectory_time(case, folder, bar) / (data.duration + data.burn_in)


def time_left(job: Job, workers: int | None, threads: int) -> TimeLeft:
    """Say what a job will take, and return what goes on to say it.

    Args:
        job: the job.
        workers: number of processes that simulate; one per core if None, 0 for this one alone.
        threads: threads of a training.
    """
    from slide_fmu.bounds.companion import usable_cores  # this takes the time to import torch

    work = counted_work(job)
    job.tell(f"{in_words(work, CPU_MINUTES)} in all, most of it for {_largest(work)}")
    side_by_side = usable_cores() >= 2 * threads
    count = usable_cores() if workers is None else max(1, workers)
    return TimeLeft(work, count, side_by_side, job.tell)


def _largest(work: Mapping[str, Span]) -> str:
    """Name the stage with the most work."""
    return max(work, key=lambda stage: math.sqrt(work[stage].low * work[stage].high))
