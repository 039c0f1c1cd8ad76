"""The time of an FMU is compared with that of a model that errs as much."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.data.draws import TEST, Draw, Stream
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.report.speed import speed_text
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import System
from slide_fmu.systems.errors import LoadError, SimulationError
from slide_fmu.systems.looser import Rung
from slide_fmu.validation import speed
from slide_fmu.validation.error_figures import SolverSetting, SpeedFigures
from slide_fmu.validation.speed import relative_error
from tests.recipes import tiny_recipe
from tests.validation.tiny_validation import FINER, PLAIN, measured


def test_model_is_loosened_until_it_errs_as_much_as_the_fmu(
    fmu: Path, surrogate: Surrogate
) -> None:
    found = measured(fmu, surrogate, FINER)
    figures = found.speed
    assert figures is not None
    assert figures.finest.setting == "steps of 0.651 ms"
    assert figures.loosened.relative_error <= figures.relative_error
    assert figures.loosened.seconds < figures.finest.seconds
    assert figures.ratio == pytest.approx(figures.loosened.seconds / figures.seconds)
    assert figures.can_be_loosened
    assert figures.complete
    errors = np.concatenate([c.error for c in found.comparisons])
    truth = np.concatenate([c.reference for c in found.comparisons])
    assert figures.relative_error == pytest.approx(relative_error(errors, truth))
    assert found.figures().timing.speed == figures


def test_model_that_cannot_be_loosened_is_compared_as_it_is(
    fmu: Path, surrogate: Surrogate
) -> None:
    figures = measured(fmu, surrogate, PLAIN).speed
    assert figures is not None
    assert not figures.can_be_loosened
    assert figures.loosened.setting == figures.finest.setting == "as it is"
    assert "RK67 as it is, takes" in speed_text(figures)


def test_search_that_takes_long_is_stopped_and_says_so(
    fmu: Path, surrogate: Surrogate, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(speed, "LONGEST", 0.0)
    found = measured(fmu, surrogate, FINER).speed
    assert found is not None
    assert not found.complete
    assert "was stopped, since it took long" in speed_text(found)


def test_relative_error_is_the_rms_over_outputs_that_move() -> None:
    truth = np.array([[1.0, 5.0, 10.0], [-1.0, 5.0, 30.0]])
    error = np.array([[0.3, 1.0, 4.0], [-0.3, 1.0, 4.0]])
    assert relative_error(error, truth) == pytest.approx(np.sqrt((0.3**2 + 0.4**2) / 2))
    assert relative_error(error[:, 1:2], truth[:, 1:2]) == 0.0


def test_constant_output_is_left_out_although_its_mean_is_rounded() -> None:
    moving = np.random.default_rng(0).normal(size=1000)
    truth = np.stack([moving, np.full(1000, 0.1)], axis=1)  # of a deviation of 1e-17 in floats
    error = np.full(truth.shape, 0.01)
    assert relative_error(error, truth) == pytest.approx(0.01 / moving.std())


FINEST = SolverSetting(
    model="reference", solver="DOP853", setting="rtol = 1e-06", relative_error=0.0, seconds=0.2
)
LOOSENED = SolverSetting(
    model="reference", solver="RK45", setting="rtol = 1e-4", relative_error=0.01, seconds=0.04
)


def text_of(loosened: SolverSetting) -> str:
    """What is said of an FMU with an error of 2 %, beside its model at this setting."""
    found = SpeedFigures(
        finest=FINEST,
        loosened=loosened,
        relative_error=0.02,
        seconds=0.01,
        ratio=4.0,
        can_be_loosened=True,
        complete=True,
    )
    return speed_text(found)


def test_text_names_solvers_settings_and_errors() -> None:
    assert text_of(LOOSENED) == (
        "At equal accuracy its model takes 4 times as long: RK45 with rtol = 1e-4 has an error of "
        "1 %, the FMU 2 %. The truth is DOP853 with rtol = 1e-06, which takes 20 times as long as "
        "the FMU."
    )


def test_text_says_where_the_model_stays_far_better() -> None:
    """As one that fails with looser settings."""
    text = text_of(replace(LOOSENED, relative_error=1e-4))
    assert text.startswith("The FMU cannot be compared at equal accuracy: its model takes 4 times")
    assert "whose error is 0.01 %, the FMU's 2 %; looser settings fail" in text


def test_text_names_the_model_that_made_the_data() -> None:
    text = text_of(replace(LOOSENED, model="model"))
    assert "At equal accuracy the model that made its data takes 4 times" in text


class Off(System):
    """A reference whose output is 1 and -1 in turns, with an error; None fails."""

    def __init__(self, error: float | None = 0.0) -> None:
        self.step, self.error = 0.5, error
        self.inputs, self.outputs = (Signal("u", "N", -1, 1),), (Signal("y", "m", -1, 1),)

    def simulate(self, inputs: FloatArray) -> FloatArray:
        if self.error is None:
            raise SimulationError("too loose")
        turns = np.where(np.arange(len(inputs) + 1) % 2, 1.0, -1.0)
        return turns[:, None] + self.error


def searched(
    settings: list[float | str | None], allowed: float, seconds: float = 60.0
) -> tuple[list[float], bool]:
    """Search settings with these errors; None cannot be simulated, a text cannot be made.

    Returns:
        The errors of the settings that are good enough, in the order in which they were tried,
        and whether the search was complete.
    """

    def make(setting: float | str | None) -> System:
        if isinstance(setting, str):
            raise LoadError(setting)
        return Off(setting)

    drawn = Draw(kind=0, factor=1.0, initial=None, inputs=np.zeros((40, 1)), burn_in=0)
    truth = Off().simulate(drawn.inputs)
    truth[0] = 99.0  # what comes before the first sample does not count
    motion = speed._Motion(index=0, drawn=drawn, truth=truth, seconds=0.1, first=1)
    rungs = [Rung("RK45", str(one), lambda one=one: make(one)) for one in settings]  # type: ignore[misc]
    nothing: Any = None
    search = speed._Search(nothing, nothing, [motion], time.process_time() + seconds)
    search.bisect("reference", rungs, allowed)
    return [setting.relative_error for setting, _ in search.solved], search.complete


@pytest.mark.parametrize(
    ("settings", "allowed", "loosest"),
    [
        ([0.0, 0.125, 0.25, 0.5, 1.0], 0.25, 0.25),
        ([0.0, 0.125, 0.25, 0.5, 1.0], 0.2, 0.125),
        ([0.0, 0.125, 0.25, 0.5, 1.0], 9.0, 1.0),
        ([0.0, 0.125, 0.25, None, None], 9.0, 0.25),
        ([0.0, 0.125, 0.25, "no such tolerance"], 9.0, 0.25),
        ([0.5], 0.5, 0.5),
    ],
)
def test_loosest_setting_that_errs_no_more_than_is_allowed_is_found(
    settings: list[float | str | None], allowed: float, loosest: float
) -> None:
    """One that fails is too loose."""
    found, complete = searched(settings, allowed)
    assert found[-1] == pytest.approx(loosest)
    assert max(found) == pytest.approx(loosest)
    assert len(found) <= 3  # halved, not tried one by one
    assert complete


def test_no_setting_is_found_where_all_err_more_or_the_time_is_over() -> None:
    assert searched([0.5, 1.0, None], 0.25) == ([], True)
    assert searched([0.0, 0.125], 9.0, seconds=-1.0) == ([], False)
    assert searched([], 9.0) == ([], True)


def compared(
    surrogate: Surrogate, recipe: Recipe, monkeypatch: pytest.MonkeyPatch, allowed: float
) -> SpeedFigures:
    """Compare an FMU that takes 1 ms for a second."""
    monkeypatch.setattr(speed, "TRAJECTORIES", 1)
    monkeypatch.setattr(speed, "_seconds_in_fmpy", lambda *_: 1e-3)
    nothing: Any = None
    stream = Stream(TEST, 3, (1.0, 1.0), 2.0)
    return speed.speed_at_equal_accuracy(nothing, surrogate, case_of(recipe), stream, allowed)


def test_reference_is_loosened_where_no_other_model_made_the_data(
    surrogate: Surrogate, monkeypatch: pytest.MonkeyPatch
) -> None:
    recipe = tiny_recipe(system={"parameters": {"damping": 40.0, "substeps": 8}})
    found = compared(surrogate, recipe, monkeypatch, 0.9)
    assert found.can_be_loosened
    assert found.loosened.model == found.finest.model == "reference"
    assert found.loosened.setting != found.finest.setting
    assert 0.0 < found.loosened.relative_error <= 0.9
    assert found.seconds == 1e-3
    assert found.ratio == pytest.approx(found.loosened.seconds / 1e-3)


def test_model_is_compared_as_it_is_where_every_looser_setting_errs_more_than_the_fmu(
    surrogate: Surrogate, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = compared(surrogate, FINER, monkeypatch, 1e-14)
    assert found.can_be_loosened
    assert (found.loosened.model, found.loosened.relative_error) == ("reference", 0.0)
    assert found.loosened.setting == found.finest.setting


@pytest.mark.parametrize(
    ("longest", "seconds", "complete"), [(0.0, 60.0, True), (60.0, 0.0, True), (0.0, 0.0, False)]
)
def test_search_lasts_as_long_as_the_reference_took_where_that_is_more(
    longest: float,
    seconds: float,
    complete: bool,
    surrogate: Surrogate,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    timed = speed.timed
    monkeypatch.setattr(speed, "LONGEST", longest)
    monkeypatch.setattr(speed, "timed", lambda *given: (timed(*given)[0], seconds))
    recipe = tiny_recipe(system={"parameters": {"damping": 40.0, "substeps": 8}})
    assert compared(surrogate, recipe, monkeypatch, 0.9).complete == complete


@pytest.mark.parametrize(("seconds", "count"), [(0.01, 4), (0.2, 2), (1.0, 1)])
def test_few_motions_are_compared_where_the_reference_takes_long(
    seconds: float, count: int, surrogate: Surrogate, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(speed, "SCORED", 20)
    taken: list[Draw] = []

    def timed(system: System, drawn: Draw) -> tuple[FloatArray, float]:
        taken.append(drawn)
        return np.zeros((len(drawn.inputs) + 1, 1)), seconds

    monkeypatch.setattr(speed, "timed", timed)
    motions = list(speed._motions(surrogate, case_of(PLAIN), Stream(TEST, 3, (1.0, 1.0), 2.0)))
    assert [motion.index for motion in motions] == list(range(count))
    burn_in = round(PLAIN.data.burn_in / PLAIN.window.step)
    for motion in motions:
        assert motion.first == max(burn_in + 1, 8)  # the window has 8 samples
        assert len(motion.drawn.inputs) == motion.first + 20
        assert motion.seconds == seconds
    assert len({motion.drawn.inputs.tobytes() for motion in motions}) == count


def test_fmu_is_timed_over_repeated_inputs_by_a_simulated_second(
    surrogate: Surrogate, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = iter([10.0, 12.5])
    given: dict[str, Any] = {}
    monkeypatch.setattr(speed.time, "process_time", lambda: next(clock))
    monkeypatch.setattr("fmpy.simulate_fmu", lambda _, **options: given.update(options))
    monkeypatch.setattr(speed, "start_time", lambda _: 1.0)
    fmu: Any = SimpleNamespace(folder="", description=None)
    drawn = Draw(0, 1.0, None, np.arange(3.0)[:, None], 0)
    found = speed._seconds_in_fmpy(fmu, surrogate, drawn)
    step = surrogate.window.step
    length = step * (speed.LEAST_STEPS - 1)
    assert found == pytest.approx(2.5 / length)
    assert (given["start_time"], given["output_interval"]) == (1.0, step)
    assert given["stop_time"] == pytest.approx(1.0 + length)
    table = given["input"]
    assert table["time"] == pytest.approx(1.0 + step * np.arange(speed.LEAST_STEPS))
    name = surrogate.inputs[0].name
    assert table[name].tolist() == [float(k % 3) for k in range(speed.LEAST_STEPS)]
