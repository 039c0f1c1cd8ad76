"""Motions on which a system fails are tolerated as long as they are few, and others are drawn."""

from __future__ import annotations

import math

import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray
from slide_fmu.data.draws import Draw
from slide_fmu.data.failing_motions import RunnableDraws, Tolerance, TooManyFailuresError
from slide_fmu.memory import motions
from slide_fmu.memory.lengths import find_lengths
from slide_fmu.memory.sizing import size_window
from slide_fmu.systems.errors import SimulationError
from tests.memory.plain_systems import Fragile, Lag
from tests.memory.test_lengths import of_lag
from tests.refusals import refused

DECAY = 0.5 * math.log(100)


@pytest.fixture(autouse=True)
def few_motions(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(motions, "MOTIONS", 8)


def test_a_motion_that_fails_is_replaced_and_told() -> None:
    recipe = find_lengths(of_lag(), Lag()).recipe.guess
    whole = size_window(recipe, Lag())
    assert whole.failed is None
    system = Fragile(level=0.998)
    sizing = size_window(recipe, system)
    assert system.failed > 0
    assert sizing.failed is not None
    assert "motions could not be simulated, and others took their place" in sizing.failed
    assert sizing.failed.endswith("the force is above 0.998 N")
    assert sizing.remark is not None
    assert sizing.remark.startswith(sizing.failed)
    assert sizing.measured.mean == pytest.approx(DECAY, rel=0.02)
    again = size_window(recipe, Fragile(level=0.998))
    np.testing.assert_array_equal(again.measured.rates, sizing.measured.rates)


@pytest.mark.parametrize("level", [0.7, -1.0])
def test_too_many_motions_that_fail_end_the_sizing_with_the_reason(level: float) -> None:
    expected = (
        r"3 of \d+ motions could not be simulated, 2 may fail \(2 % of all, data.most_failures\): "
        rf"the force is above {level:g} N. Correct the model, narrow"
    )
    with pytest.raises(SimulationError, match=expected) as raised:
        find_lengths(of_lag(), Fragile(level=level))
    assert raised.value.time is not None


def test_share_of_failures_is_that_of_the_data() -> None:
    tolerance = Tolerance(0.1)
    tolerance.tried = 50
    for _ in range(5):
        tolerance.count(SimulationError("no"))
    with refused(TooManyFailuresError, "6 of 50", "5 may fail"):
        tolerance.count(SimulationError("no"))


def drawn(attempt: int) -> Draw:
    return Draw(0, 1.0, None, np.full((9, 1), float(attempt)), 0)


def test_motions_that_fail_only_one_after_another_are_drawn_anew() -> None:
    runnable = RunnableDraws(Lag(), 0.0)

    def work() -> FloatArray:
        inputs = runnable.drawn(0, 4, drawn).inputs
        if inputs[0, 0] < 1.0:
            raise SimulationError("together they fail")
        return inputs

    np.testing.assert_array_equal(runnable.tolerated(work), np.ones((4, 1)))
    assert runnable.tolerance.errors == ["together they fail"]


def test_nothing_is_simulated_twice_where_nothing_fails() -> None:
    system = Fragile(level=-1.0)
    runnable = RunnableDraws(system, 0.0)
    assert runnable.tolerated(lambda: runnable.drawn(0, None, drawn)).inputs.shape == (9, 1)
    assert system.failed == 0
