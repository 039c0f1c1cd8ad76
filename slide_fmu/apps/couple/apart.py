"""Foreign FMUs run in a program of its own: one that ends it, or blocks it, is named.

A beacon shows which call of which FMU the program is in. All FMUs share the program, so that a
step costs no messages between programs.
"""

from __future__ import annotations

import math
import mmap
import pickle
import signal
import time as clock
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import final

from slide_fmu.apps.couple.component import is_ours
from slide_fmu.apps.couple.options import CouplingOptions
from slide_fmu.apps.couple.result import CoupledRun, StoppedRunError
from slide_fmu.apps.couple.rows import RowKeeper, read_rows
from slide_fmu.apps.couple.run import run_here, stopped_values, widths_of
from slide_fmu.apps.couple.structure import CoupledSystem
from slide_fmu.core.progress import Progress, Stages
from slide_fmu.data.isolated_process import EndedError, IsolatedCall

LOOKED = 0.1
"""The beacon is looked at every so many seconds."""
NOBODY = 0
"""What the beacon shows between calls."""
CALLS, COUNT = 1 << 16, 1 << 32
"""What is shown of a call: its component, its number times the first of these, and the number of
calls so far times the second."""


@final
class Beacon:
    """A Beacon is a number in a file that two programs share: it shows who is in which call.

    Args:
        folder: where it lies, with the names of the calls by their numbers.
    """

    def __init__(self, folder: Path) -> None:
        path = folder / "beacon"
        if not path.exists():
            path.write_bytes(bytes(8))
        with path.open("r+b") as file:
            self._map = mmap.mmap(file.fileno(), 8)
        self.words = memoryview(self._map).cast("q")
        self._names = folder / "calls"

    def named(self, call: str) -> int:
        """Return the number of a call that is made for the first time."""
        with self._names.open("a", encoding="utf-8") as file:
            file.write(f"{call}\n")
        return len(self._names.read_text(encoding="utf-8").splitlines()) - 1

    def seen(self) -> int:
        """Return what is shown: another number for every call, ``NOBODY`` between calls."""
        return self.words[0]

    def meaning(self, seen: int) -> tuple[int, str]:
        """Return the component that is in a call, and the name of the call."""
        names = self._names.read_text(encoding="utf-8").splitlines()
        return seen % CALLS, names[seen % COUNT // CALLS]

    def close(self) -> None:
        """Close the file."""
        self.words.release()
        self._map.close()


@final
class BeaconWitness:
    """A BeaconWitness lets a beacon show the calls of a component."""

    def __init__(self, beacon: Beacon, component: int) -> None:
        self._beacon, self._words, self._component = beacon, beacon.words, component
        self._shown: dict[str, int] = {}
        self._count = 0

    def begin(self, call: str) -> None:
        """Show that a call of this name begins."""
        if (shown := self._shown.get(call)) is None:
            shown = self._shown[call] = CALLS * self._beacon.named(call) + self._component
        self._count += COUNT
        self._words[0] = self._count + shown

    def end(self) -> None:
        """Show that it has returned."""
        self._words[0] = NOBODY


def is_foreign(system: CoupledSystem) -> bool:
    """Tell whether an FMU of another tool takes part."""
    return not all(map(is_ours, system.descriptions.values()))


def can_go_apart(system: CoupledSystem) -> bool:
    """Tell whether a program of its own can be given the system: functions of a session cannot."""
    try:
        return b"__main__" not in pickle.dumps(system)
    except Exception:  # pickling a user's function may raise anything
        return False


def run_apart(system: CoupledSystem, options: CouplingOptions, progress: Progress) -> CoupledRun:
    """Run a system in a program of its own; errors are as for ``run_here``.

    Raises:
        StoppedRunError: an FMU ended the program, or did not return within the deadline, too.
    """
    with TemporaryDirectory(prefix="slide_fmu_") as name:
        folder = Path(name)
        beacon = Beacon(folder)
        try:
            with IsolatedCall(
                _run, system, options, folder, stages=lambda _: progress, printed=True
            ) as call:
                why = _watched(call, beacon, system, options.deadline)
                if why is None:
                    try:
                        return call.result()
                    except EndedError as ended:
                        why = _ending(beacon, system, ended.code)
        finally:
            beacon.close()
        values = stopped_values(
            system, options, read_rows(folder / "rows", widths_of(system, options))
        )
        raise StoppedRunError(why, values)


def _run(
    stages: Stages, system: CoupledSystem, options: CouplingOptions, folder: Path
) -> CoupledRun:
    """Run a system in this program, which another one watches by the files in a folder."""
    beacon, shown = Beacon(folder), stages("couple")
    sent = -math.inf

    def seldom(done: int, total: int, error: float | None = None) -> None:
        nonlocal sent
        if done in (0, total) or clock.monotonic() - sent > LOOKED:
            sent = clock.monotonic()
            shown(done, total, error)

    witnesses = partial(BeaconWitness, beacon)
    return run_here(system, options, seldom, RowKeeper(folder / "rows"), witnesses)


def _watched(
    call: IsolatedCall[CoupledRun], beacon: Beacon, system: CoupledSystem, deadline: float
) -> str | None:
    """Wait for a run; return why it is given up, or None if its program has answered or ended."""
    last, since = beacon.seen(), clock.monotonic()
    while not call.wait(LOOKED):
        seen = beacon.seen()
        if seen != last or seen == NOBODY:
            last, since = seen, clock.monotonic()
        elif clock.monotonic() - since > deadline:
            component, name = beacon.meaning(seen)
            return (
                f"{_named(system, component)}: {name} has not returned for "
                f"{deadline:g} s, the deadline of one call; expected it to end: ask who made the "
                "FMU, choose a shorter step, or give it more time (deadline)"
            )
    return None


def _ending(beacon: Beacon, system: CoupledSystem, code: int) -> str:
    """Say in which call of which FMU the program ended, with an exit code."""
    seen = beacon.seen()
    how = f"with the exit code {code}"
    if code < 0:
        known = {one.value: one.name for one in signal.Signals}
        how = f"by {known.get(-code, f'signal {-code}')}"
    if seen == NOBODY:
        return (
            f"the program that runs the FMUs ended {how}, in no call of an FMU; expected it to "
            "go on: the memory may be full, or a thread of an FMU ended it"
        )
    component, name = beacon.meaning(seen)
    return (
        f"{_named(system, component)} ended the program that runs it {how}, in {name}; "
        f"expected a status: its library crashed, ended the program itself, "
        "or the memory is full: ask who made the FMU, or change its inputs or the step"
    )


def _named(system: CoupledSystem, component: int) -> str:
    name = list(system.paths)[component]
    return f"component {name!r} ({system.paths[name].name})"
