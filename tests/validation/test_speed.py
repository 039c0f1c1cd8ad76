"""The time of an FMU is compared with that of a model that errs as much."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slide_fmu.report.speed import speed_text
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation import speed
from slide_fmu.validation.error_figures import SolverSetting, SpeedFigures
from slide_fmu.validation.speed import relative_error
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
