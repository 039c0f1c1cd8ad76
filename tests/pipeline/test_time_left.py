"""One line says how long a run still takes, at each stage and when half of the time has passed."""

from __future__ import annotations

import re

import pytest

from slide_fmu.core.progress import Progress, part_of
from slide_fmu.pipeline import time_left
from slide_fmu.pipeline.time_left import TimeLeft
from slide_fmu.pipeline.work_estimate import (
    COMPANION,
    CURVE,
    DATA,
    HEAD,
    MEASURING,
    TRAINING,
    WINDOW,
    Span,
)

WORK = {
    WINDOW: Span(),
    DATA: Span(40.0, 40.0),
    TRAINING: Span(60.0, 240.0),
    COMPANION: Span(50.0, 200.0),
    HEAD: Span(10.0, 10.0),
    MEASURING: Span(20.0, 45.0),
}
WORKERS = 2


class Watch:
    """A clock that goes on as the test says, and what is reported meanwhile."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now = 100.0
        self.told: list[tuple[float, str]] = []
        self.shown: list[tuple[str, int, int]] = []
        monkeypatch.setattr(time_left.time, "monotonic", lambda: self.now)

    def bar(self, name: str) -> Progress:
        return lambda done, total, error=None: self.shown.append((name, done, total))

    def tell(self, sentence: str) -> None:
        self.told.append((self.now, sentence))

    def work(self, progress: Progress, total: int, seconds: float) -> None:
        """Take a time for the parts of a stage, one after the other."""
        for done in range(total + 1):
            progress(done, total)
            self.now += seconds / total if done < total else 0.0


@pytest.fixture
def watch(monkeypatch: pytest.MonkeyPatch) -> Watch:
    return Watch(monkeypatch)


def range_of(sentence: str) -> tuple[float, float]:
    """Return the least and the largest time in a sentence in s."""
    found = re.match(r"about ([\d.]+)(?: to ([\d.]+))? (s|min|h) left", sentence)
    assert found is not None, sentence
    size = {"s": 1.0, "min": 60.0, "h": 3600.0}[found[3]]
    return size * float(found[1]), size * float(found[2] or found[1])


@pytest.mark.parametrize("slow", [0.5, 1.0, 4.0])
def test_time_left_is_right_within_a_factor_on_fast_and_on_slow_machines(
    watch: Watch, slow: float
) -> None:
    """The first line counts on this machine; those behind know what the stages took."""
    bar = TimeLeft(WORK, WORKERS, False, watch.tell).watched(watch.bar)
    watch.work(bar("trajectories of network and bound"), 154, slow * 40.0 / WORKERS)
    surrogate = bar("surrogate")
    watch.work(part_of(surrogate, "3 states and 16 units"), 60, slow * 40.0)
    watch.work(part_of(surrogate), 60, slow * 60.0)
    watch.work(bar("companion"), 110, slow * 80.0)
    watch.work(bar("error bound"), 3000, slow * 10.0)
    for name in ("validation", "smooth inputs", "inputs as users set them"):
        watch.work(bar(name), 20, slow * 30.0 / WORKERS / 3)
    end = watch.now
    assert len(watch.told) >= 4
    for now, sentence in watch.told[1:]:
        least, largest = range_of(sentence)
        assert least / 2 <= end - now <= 2 * largest, sentence
    half = [told for told in watch.told if told[0] <= 100.0 + (end - 100.0) / 2][-1]
    assert sum(range_of(half[1])) / 2 / 2.5 <= end - half[0] <= 2.5 * sum(range_of(half[1])) / 2


def test_search_has_a_range_until_its_last_run_is_on_its_way(watch: Watch) -> None:
    bar = TimeLeft(WORK, WORKERS, False, watch.tell).watched(watch.bar)
    watch.work(bar("trajectories"), 10, 20.0)
    surrogate = bar("surrogate")
    watch.work(part_of(surrogate, "number of states"), 10, 5.0)
    least, largest = range_of(watch.told[-1][1])
    assert largest > 2 * least
    watch.work(part_of(surrogate), 10, 60.0)
    watch.work(bar("companion"), 10, 60.0)
    assert " to " not in watch.told[-1][1]


def test_companion_next_to_the_surrogate_takes_no_time_of_its_own(watch: Watch) -> None:
    clocks = {}
    for side_by_side in (False, True):
        clock = TimeLeft(WORK, WORKERS, side_by_side, watch.tell)
        bar = clock.watched(watch.bar)
        surrogate, companion = bar("surrogate"), bar("companion")
        surrogate(0, 100)
        surrogate(1, 100)
        if side_by_side:
            companion(0, 100)
            companion(1, 100)
        watch.now += 10.0
        surrogate(11, 100)
        clocks[side_by_side] = clock.left()
    assert clocks[False].low == pytest.approx(90.0 + 50.0 + 10.0 + 10.0, abs=2.0)
    assert clocks[True].high < clocks[False].high
    assert clocks[True].low >= 89.0 + 10.0 + 10.0


def test_resumed_training_is_extrapolated_from_what_is_done_now(watch: Watch) -> None:
    alone = {TRAINING: WORK[TRAINING], MEASURING: Span(1.0, 1.0)}
    clock = TimeLeft(alone, WORKERS, False, watch.tell)
    training = clock.watched(watch.bar)("surrogate")
    for done in range(70, 90):
        training(done, 100)
        watch.now += 10.0
    assert clock.left().low == pytest.approx(100.0, abs=12.0)


def test_more_knowledge_of_the_work_narrows_the_range(watch: Watch) -> None:
    clock = TimeLeft({CURVE: Span(10.0, 90.0), **WORK}, WORKERS, False, watch.tell)
    bar = clock.watched(watch.bar)
    watch.work(bar("fit of curve point 1"), 10, 30.0)
    before = clock.left()
    clock.count({**WORK, TRAINING: Span(60.0, 70.0)})
    assert clock.left().high < before.high - 100.0


def test_terminal_has_one_line_instead_of_many(watch: Watch) -> None:
    class Terminal:
        def __init__(self) -> None:
            self.texts: list[str] = []

        def __call__(self, name: str) -> Progress:
            return watch.bar(name)

        def show_whole(self, text: str) -> None:
            self.texts.append(text)

    terminal = Terminal()
    bar = TimeLeft(WORK, WORKERS, False, watch.tell).watched(terminal)
    watch.work(bar("trajectories"), 10, 20.0)
    assert len(terminal.texts) == 11
    assert watch.told == []
    assert terminal.texts[0].endswith(f"left, 1 of {len(WORK)} stages done")


def test_progress_is_shown_as_before(watch: Watch) -> None:
    TimeLeft(WORK, WORKERS, False, watch.tell).watched(watch.bar)("surrogate")(3, 7, 0.5)
    assert watch.shown == [("surrogate", 3, 7)]


def test_few_seconds_are_not_reported(watch: Watch) -> None:
    little = {stage: span.times(0.01) for stage, span in WORK.items()}
    bar = TimeLeft(little, WORKERS, False, watch.tell).watched(watch.bar)
    watch.work(bar("trajectories"), 1000, 0.001)
    watch.work(bar("surrogate"), 100, 0.5)
    assert watch.told == []
