"""Stages say how far they are, of what, for how long yet, and with which error."""

from __future__ import annotations

import io
import math
import os
import pty
import re
from collections.abc import Iterator
from contextlib import AbstractContextManager
from typing import TextIO

import pytest

from slide_fmu.core.progress import Progress, ProgressListener, Stages, part_of, quiet, show_whole
from slide_fmu.report import progress_display
from slide_fmu.report.progress_display import Messages, progress_on


class Clock:
    """Seconds that pass when a test says so."""

    now = 0.0

    def monotonic(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr(progress_display, "time", clock)
    return clock


def stages_on(file: TextIO) -> AbstractContextManager[Stages]:
    """Stages whose progress is shown in a file."""
    return progress_on(Messages(file=file, markup=False, highlight=False))


@pytest.fixture
def pipe() -> io.StringIO:
    """A file that is no terminal."""
    return io.StringIO()


class Terminal(io.StringIO):
    """A terminal that keeps what is written, however much that is."""

    def isatty(self) -> bool:
        return True


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> Terminal:
    """A narrow terminal of few lines."""
    for name, value in {"COLUMNS": "60", "LINES": "12", "TERM": "xterm"}.items():
        monkeypatch.setenv(name, value)
    return Terminal()


def plain(shown: str) -> list[str]:
    """The lines that a terminal has shown one after the other, without colours."""
    return re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", shown).replace("\r", "\n").splitlines()


def fit(progress: Progress, clock: Clock) -> None:
    """Two seconds an iteration, of which there are at most 40, but only 30."""
    progress = part_of(progress, "4 states", at_most=True)
    progress(0, 40, math.inf)
    for done in range(1, 31):
        clock.now += 2.0
        progress(done, 40, 0.1 / done)
    progress(30, 30, 0.00287)


def test_lines_say_the_total_the_time_left_and_the_relative_error(
    clock: Clock, pipe: io.StringIO
) -> None:
    with stages_on(pipe) as stages:
        fit(stages("surrogate"), clock)
    lines = pipe.getvalue().splitlines()
    assert lines[0] == "surrogate, 4 states: 0 of at most 40"
    assert (
        lines[1]
        == "surrogate, 4 states: 6 of at most 40, at most 1 min left, validation error 1.67 %"
    )
    assert len(lines) == 6
    assert lines[-1] == "surrogate, 4 states: 30 of 30, took 1 min, validation error 0.287 %"


def test_long_stage_says_its_time_before_its_first_fifth(clock: Clock, pipe: io.StringIO) -> None:
    with stages_on(pipe) as stages:
        progress = stages("trajectories")
        for done in range(20):
            progress(done, 1000)
            clock.now += 6.0
    lines = pipe.getvalue().splitlines()
    assert lines == [
        "trajectories: 0 of 1000",
        "trajectories: 2 of 1000, 1 h 40 min left",
    ]


def test_short_stage_has_two_lines_and_a_long_one_at_most_seven(
    clock: Clock, pipe: io.StringIO
) -> None:
    with stages_on(pipe) as stages:
        short, long = stages("recipe"), stages("trajectories")
        for done in range(5):
            clock.now += 0.1
            short(done, 4)
        for done in range(101):
            clock.now += 3.0
            long(done, 100)
    lines = pipe.getvalue().splitlines()
    assert lines[:2] == ["recipe: 0 of 4", "recipe: 4 of 4, took 0 s"]
    assert len(lines[2:]) == 7
    assert lines[-1] == "trajectories: 100 of 100, took 5 min"


@pytest.mark.parametrize(("left", "lines"), [(0, 1), (2, 3)])
def test_stage_that_was_finished_before_has_one_line(
    clock: Clock, pipe: io.StringIO, left: int, lines: int
) -> None:
    with stages_on(pipe) as stages:
        progress = part_of(stages("surrogate"), at_most=True)
        progress(30, 40, 0.00287)
        for done in range(31, 31 + left):
            clock.now += 6.0
            progress(done, 40, 0.00287)
        progress(30 + left, 30 + left, 0.00287)
    found = pipe.getvalue().splitlines()
    assert len(set(found)) == len(found) == lines
    assert found[-1].startswith(f"surrogate: {30 + left} of {30 + left}, ")


def _all_of(terminal: int) -> Iterator[bytes]:
    """Read what a terminal shows, whose other end is closed: it comes in pieces."""
    try:
        while piece := os.read(terminal, 1 << 16):
            yield piece
    except OSError:  # nothing is left
        pass
    finally:
        os.close(terminal)


@pytest.mark.parametrize("columns", [60, 100])
def test_bars_fit_the_terminal_and_end_with_the_work(
    monkeypatch: pytest.MonkeyPatch, columns: int
) -> None:
    monkeypatch.setenv("COLUMNS", str(columns))
    monkeypatch.setenv("TERM", "xterm")
    master, terminal = pty.openpty()
    with os.fdopen(terminal, "w") as file, stages_on(file) as stages:
        progress = part_of(stages("companion, attempt 2"), at_most=True)
        progress(0, 183, math.inf)
        progress(97, 183, 0.00287)
        progress(180, 180, 0.00287)
    shown = plain(b"".join(_all_of(master)).decode())
    assert max(map(len, shown)) <= columns
    last = [line for line in shown if line.strip()][-1]
    assert "180 of 180" in last
    assert last.rstrip().endswith("0.287 %")
    assert "inf" not in "".join(shown)


def test_narrow_terminal_shows_whole_times_and_the_newest_stages(terminal: Terminal) -> None:
    with stages_on(terminal) as stages:
        for number in range(20):
            progress = part_of(stages(f"data of curve point {number} (128 to train)"))
            progress(0, 1520)
            progress(1520, 1520, 0.00287)
    lines = plain(terminal.getvalue())
    assert max(map(len, lines)) <= 60
    shown = "\n".join(lines)
    assert "..." not in shown  # which rich writes where stages have no place
    assert "…" not in shown
    for number in range(20):
        assert re.search(rf"point {number}\b.*1520 of 1520 +took 0 s +0.287 %", shown), number


def test_line_of_the_whole_run_is_below_the_stages_and_goes_with_the_work(
    terminal: Terminal,
) -> None:
    with stages_on(terminal) as stages:
        stages("window")(1, 1)
        assert show_whole(stages, "about 3 to 9 min left, 1 of 6 stages done")
        stages("surrogate")(3, 10)
    lines = [line.strip() for line in plain(terminal.getvalue()) if line.strip()]
    places = [k for k, line in enumerate(lines) if line.startswith("about 3 to 9 min left")]
    assert places
    assert lines[places[-1] - 1].startswith(("surrogate", "window"))
    assert lines[-1].startswith("surrogate")  # nothing is left of it at the end
    assert not show_whole(lambda name: quiet, "about 3 min left")


def test_error_that_is_no_relative_one_is_not_shown() -> None:
    seen: list[float | None] = []
    heard = ProgressListener(lambda done, total, error=None: seen.append(error), with_error=False)
    heard(1, 2, 0.5)
    part_of(heard, "part")(1, 2, 0.5)
    assert seen == [None, None]
    assert part_of(quiet, "part") is quiet
