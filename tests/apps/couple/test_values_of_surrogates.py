"""Start values of a surrogate: its past, the ranges that it declares, and its own step."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import slide_fmu as slide
from slide_fmu.apps.couple.result import CoupledRun
from tests.refusals import refused

FMUS = Path(__file__).parents[3] / "fmus"
CRANK, CRANK_STEP = FMUS / "slider_crank" / "slider_crank.fmu", 0.03125
SPRING = {"spring": FMUS / "duffing" / "duffing.fmu"}


def ride(step: float = 0.03, force: float = 200.0) -> CoupledRun:
    given = {"spring.force": force}
    found: CoupledRun = slide.couple(SPRING, [], step=step, stop=0.3, parameters=given)
    return found


@pytest.mark.parametrize("known", [{}, {"crank.prehistory_known": 1.0}])
def test_input_that_nothing_sets_has_always_had_its_start_value(known: dict[str, float]) -> None:
    given = {"crank.director_x": 0.0, "crank.director_y": 1.0, **known}
    run = slide.couple({"crank": CRANK}, [], step=CRANK_STEP, stop=1.0, parameters=given)
    np.testing.assert_allclose(run["crank.deflection"], 0.0, atol=1e-4)  # a jump gives 0.1 m


def test_past_that_is_known_is_that_of_the_first_inputs_unless_users_say_more() -> None:
    def position(**past: float) -> float:
        given = {"spring.force": 200.0, "spring.prehistory_known": 1.0}
        more = {f"spring.{name}": value for name, value in past.items()}
        run = slide.couple(SPRING, [], step=0.03, stop=0.3, parameters=given | more)
        assert run["spring.position"][0] == pytest.approx(run["spring.position"][-1], rel=0.02)
        return float(run["spring.position"][0])

    assert position() == pytest.approx(position(initial_force=200.0), rel=1e-6)
    assert abs(position()) > 1e-3


def test_start_value_out_of_the_range_of_an_input_gets_a_remark() -> None:
    assert not any("leaves its range" in text for text in ride().figures.remarks)
    (remark,) = [t for t in ride(force=5000.0).figures.remarks if "leaves its range" in t]
    assert remark.startswith("spring.force leaves its range -1000 .. 1000 at 0 s")


def test_parameter_out_of_its_range_is_refused() -> None:
    given = {"spring.confidence": 0.5}
    with refused(ValueError, "spring.confidence = 0.5", "expected 0.9 .. 0.99", "choose"):
        slide.couple(SPRING, [], step=0.03, stop=0.3, parameters=given)


def test_longer_step_gets_a_remark_where_inputs_move() -> None:
    assert not any("is longer than" in text for text in ride(0.06).figures.remarks)
    run = slide.couple({"crank": CRANK}, [], step=2 * CRANK_STEP, stop=1.0)
    (remark,) = [text for text in run.figures.remarks if "is longer than" in text]
    assert remark.startswith("step = 0.0625 s is longer than 0.03125 s, the step of 'crank'")
