"""A ledger stores a fit that consists of several runs, so that an interrupted fit can resume."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from typing import Any, TypedDict, TypeVar, final

import torch

from slide_fmu.core.progress import Progress, part_of
from slide_fmu.fitting.checkpoint import read_checkpoint, reading, write_checkpoint
from slide_fmu.fitting.state_space.levenberg_marquardt import Iterate
from slide_fmu.fitting.state_space.preconditioned_descent import Descent

State = TypeVar("State", Iterate, Descent)

STORE_EVERY = 2.0
"""Shortest time in s between two writings of the file, other than at the end of a run."""


class KeptRun(TypedDict):
    """This is a run in the file: its iterations, and the fields of its last state, or None."""

    iterations: int
    state: Any


@final
class Ledger:
    """A Ledger has named runs and the last state of each, in one file.

    A run is a sequence of states, each computed only from the state before. So a fit that resumes
    from the file ends with the same weights as an uninterrupted one.

    The file is read if it exists, with its tensors on the device, and written after iterations.
    The progress is called after each iteration, with the iterations done and planned of a part,
    which consists of one or more runs.

    Raises:
        DamagedFileError: the file is damaged.
        TrainingError: another version has written it.
    """

    def __init__(self, path: Path, device: torch.device, progress: Progress) -> None:
        self._path, self._stage, self._progress = path, progress, progress
        self._planned, self._best = 0, math.inf
        self._named = False
        self._before: set[str] = set()
        self._of_part: set[str] = set()
        self._runs: dict[str, KeptRun] = {}
        self._written = time.monotonic()
        content = read_checkpoint(path, device)
        if content is not None:
            with reading(path):
                self._runs = _checked(content)

    def plan(self, iterations: int, part: str = "") -> None:
        """Begin a part of the fit, with at most ``iterations`` in its runs; end the last part.

        A fit has at most one part without a name, which is the last one.
        """
        self.finish()
        self._planned, self._named = iterations, bool(part)
        self._progress = part_of(self._stage, part, at_most=True)
        self._show()

    def finish(self) -> None:
        """End a part: its runs may have ended before their last iteration."""
        if self._planned:
            self._planned = self._done or self._planned
            self._progress(self._planned, self._planned, self._best)
        self._before |= self._of_part
        self._planned, self._of_part = 0, set()

    @property
    def _done(self) -> int:
        """The number of iterations of the part; the file may have runs of later parts."""
        runs = self._runs.items()
        of_part, before = self._of_part, self._before
        return sum(
            run["iterations"]
            for name, run in runs
            if (name in of_part if self._named else name not in before)
        )

    def _show(self, error: float = math.inf) -> None:
        """Show the progress, with the smallest validation error so far."""
        self._best, done = min(self._best, error), self._done
        self._progress(done, max(done, self._planned), self._best)

    def run(
        self,
        name: str,
        start: State,
        advance: Callable[[State], State],
        iterations: int,
    ) -> State:
        """Do a run, or the rest of it, unless it has been done; return its last state.

        The name is unique in this fit. States are dataclasses of plain values and tensors; an
        iteration depends only on the state. ``iterations`` is their largest number.
        """
        self._of_part.add(name)
        stored = self._runs.get(name, KeptRun(iterations=0, state=None))
        done, state = stored["iterations"], start
        if stored["state"] is not None:
            with reading(self._path):  # another version may have written it
                state = type(start)(**stored["state"])
        while done < iterations and not state.finished:
            state = advance(state)
            done += 1
            values = {field.name: getattr(state, field.name) for field in fields(state)}
            self._runs[name] = KeptRun(iterations=done, state=values)
            if time.monotonic() - self._written > STORE_EVERY:
                self._write()
            self._show(state.best_error)
        self._write()
        self._best = min(self._best, state.best_error)  # also for a run that was done earlier
        return state

    def _write(self) -> None:
        write_checkpoint(self._path, self._runs)
        self._written = time.monotonic()


def _checked(runs: Any) -> dict[str, KeptRun]:
    """Check that a file has runs, and return them.

    Raises:
        ValueError: the file has another content.
    """
    values = runs.values() if isinstance(runs, dict) else [None]
    if not all(isinstance(run, dict) and run.keys() == {"iterations", "state"} for run in values):
        raise ValueError("it holds no runs of a state-space fit")
    return dict(runs)
