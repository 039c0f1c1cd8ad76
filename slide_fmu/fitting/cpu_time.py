"""The CPU time of a training is summed over its interruptions, so that others get the same."""

from __future__ import annotations

import time
from pathlib import Path

from slide_fmu.core.files import write_whole
from slide_fmu.core.kept import damage_named
from slide_fmu.core.progress import Heard, Stages

WRITE_EVERY = 1.0
"""The time is written after so many further seconds of it."""


class CpuTime:
    """A CPU time counts the seconds of this process, on all its cores, from where a file stands.

    The file lies beside the checkpoint of the training that it belongs to. A damaged one raises a
    DamagedFileError. Final.
    """

    def __init__(self, place: Path) -> None:
        self._place = place
        self._before = 0.0
        if place.exists():
            with damage_named(place, "a number of seconds", "remove it, and time counts from now"):
                self._before = float(place.read_bytes().decode("ascii"))
        self._begin = time.process_time()
        self._written = self._before

    @property
    def seconds(self) -> float:
        """The CPU time until now, in s."""
        return self._before + time.process_time() - self._begin

    def counted(self, stages: Stages) -> Stages:
        """Return the stages of a training; whenever their progress is called, the time is kept."""

        def keep_at_times() -> None:
            if self.seconds - self._written > WRITE_EVERY:
                self.keep()

        return lambda name: Heard(stages(name), keep_at_times)

    def keep(self) -> float:
        """Write the time to the file, and return it in s."""
        self._written = self.seconds
        write_whole(self._place, f"{self._written:.3f}\n".encode("ascii"))
        return self._written
