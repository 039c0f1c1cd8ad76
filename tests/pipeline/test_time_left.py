"""One line says how long a run still takes, at each stage and when half of the time has passed."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest

from slide_fmu.core.progress import Progress, part_of
from slide_fmu.pipeline import time_left
from slide_fmu.pipeline.time_left import MEASURING, TimeLeft, stages_of
from slide_fmu.recipe.recipe import Recipe
from tests.recipes import tiny_state_space_recipe

RECIPE = tiny_state_space_recipe(
    data={"duration": 4.0, "burn_in": 1.0, "bound": 50, "calibration": 100},
    validation={"trajectories": 20, "duration": 30.0},
    bound={},
)
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


def opened(watch: Watch, recipe: Recipe = RECIPE) -> Callable[[str], Progress]:
    """The progress of the stages of a run."""
    return TimeLeft(recipe, False, WORKERS, watch.tell).watched(watch.bar)


def seconds_of(sentence: str) -> float:
    """Return the time in a sentence in s."""
    found = re.match(r"about (?:(\d+) h )?(\d+) (s|min) left", sentence)
    assert found is not None, sentence
    return 3600.0 * float(found[1] or 0) + float(found[2]) * {"s": 1.0, "min": 60.0}[found[3]]


@pytest.mark.parametrize("size", [1.0, 40.0])
def test_time_left_is_right_within_a_factor_from_the_first_line_on(
    watch: Watch, size: float
) -> None:
    """Where companion and measuring take what they usually do."""
    bar, measured = opened(watch), 20 * 30.0
    cost = 0.01 * size  # time in s of a simulated second
    watch.work(bar("trajectories of network and bound"), 154, 154 * 5.0 * cost / WORKERS)
    watch.work(bar("surrogate"), 130, 60.0 * size)
    watch.work(bar("companion"), 110, 45.0 * size)
    watch.work(bar("error bound"), 3000, 12.0 * size)
    for name in ("validation", "smooth inputs", "inputs as users set them"):
        watch.work(bar(name), 20, 3.0 * measured * cost)
    end = watch.now
    assert len(watch.told) == 3
    for now, sentence in watch.told:
        assert seconds_of(sentence) / 1.5 <= end - now <= 1.5 * seconds_of(sentence), sentence
    assert watch.told[0][1].endswith("2 of 5 stages done")
    assert watch.told[-1][1].endswith("4 of 5 stages done")


def test_nothing_is_reported_before_the_time_of_the_training_is_known(watch: Watch) -> None:
    bar = opened(watch)
    watch.work(bar("trajectories"), 10, 50.0)
    search = part_of(bar("surrogate"), "number of states")
    watch.work(search, 10, 50.0)
    assert watch.told == []


def test_resumed_training_is_extrapolated_from_what_is_done_now(watch: Watch) -> None:
    bar = opened(watch)
    watch.work(bar("trajectories"), 1000, 1.0)
    training = bar("surrogate")
    for done in range(70, 95):
        training(done, 100)
        watch.now += 10.0
    now, sentence = watch.told[0]
    # the companion takes as long as the thirty parts of this training; measuring takes little
    assert seconds_of(sentence) == pytest.approx(2 * 300 - (now - 101), rel=0.1)


def test_progress_is_shown_as_before(watch: Watch) -> None:
    opened(watch)("surrogate")(3, 7, 0.5)
    assert watch.shown == [("surrogate", 3, 7)]


def test_few_seconds_are_not_reported(watch: Watch) -> None:
    bar = opened(watch)
    watch.work(bar("trajectories"), 1000, 0.001)
    watch.work(bar("surrogate"), 100, 0.5)
    assert watch.told == []


def test_stages_are_those_of_the_recipe() -> None:
    assert len(stages_of(RECIPE, True)) == 6
    alone = RECIPE.model_copy(update={"bound": None})
    assert stages_of(alone, False)[-1] == MEASURING
    assert len(stages_of(alone, False)) == 4
