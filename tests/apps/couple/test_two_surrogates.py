"""A machine is cut in two such that surrogates may replace both halves."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import slide_fmu as slide
from tests.apps.couple.test_own_fmus import DUFFING
from tests.apps.couple.test_refusals import CRANK, write_gain
from tests.own_models.systems.car_in_two import CAR_IN_TWO
from tests.own_models.systems.cut_machine import relative_error
from tests.refusals import refused


def test_halves_of_a_car_follow_the_whole_car(tmp_path: Path) -> None:
    step, stop = CAR_IN_TWO.step, 2.0
    road = CAR_IN_TWO.drive({}, 1, stop)
    true = CAR_IN_TWO.whole({}, road, step, stop)
    run = CAR_IN_TWO.run(tmp_path, {}, {}, road, step, stop)
    assert relative_error(run["partner.wheel"], true["wheel"]) < 0.005
    assert relative_error(run["half.force"], true["half.force"]) < 0.01


def test_derivatives_of_two_surrogates_in_a_circle_meet_in_few_iterations(tmp_path: Path) -> None:
    """Two oscillators, each of which is pushed by a gain of the other's position."""
    gain = write_gain(tmp_path)
    names = ("one", "two")
    links = [
        link
        for a, b in (names, names[::-1])
        for link in ((f"{a}.position", f"{a}_gain.u"), (f"{a}_gain.y", f"{b}.force"))
    ]
    gains = {f"{name}_gain": gain for name in names}
    run = slide.couple({**dict.fromkeys(names, DUFFING), **gains}, links, step=0.03, stop=1.2)
    for a, b in (names, names[::-1]):
        expected = 1 + 0.5 * run[f"{a}.position"][1:]
        assert run[f"{b}.force"][1:] == pytest.approx(expected, rel=1e-3, abs=1e-6)
    assert run.figures.iterations <= 3


def test_bound_and_flags_are_recorded_with_derivatives(tmp_path: Path) -> None:
    """They are read behind steps that are taken, and derivatives are those of links alone."""
    known = ("position_error_bound", "trusted", "in_domain", "position", "force")
    names = [f"osc.{name}" for name in known]
    links = [("osc.position", "gain.u"), ("gain.y", "osc.force")]
    fmus = {"osc": DUFFING, "gain": write_gain(tmp_path)}
    run = slide.couple(fmus, links, step=0.03, stop=6.0, record=names)
    assert list(run.values) == names
    assert run.figures.iterations <= 3
    assert set(run["osc.trusted"]) | set(run["osc.in_domain"]) <= {0.0, 1.0}
    assert run["osc.trusted"][-1] == run["osc.in_domain"][-1] == 1.0
    assert np.all(run["osc.position_error_bound"][1:] > 0)


def test_input_that_leaves_its_range_is_remarked(tmp_path: Path) -> None:
    links = [("gain.y", "osc.force")]
    fmus = {"gain": write_gain(tmp_path), "osc": DUFFING}
    run = slide.couple(fmus, links, step=0.03, stop=0.3, inputs={"gain.u": lambda t: 1e5 * t})
    (remark,) = [one for one in run.figures.remarks if "leaves its range" in one]
    assert remark.startswith("osc.force leaves its range -1000 .. 1000 at 0.03 s, and reaches 1.")
    near = slide.couple(fmus, links, step=0.03, stop=0.3, inputs={"gain.u": lambda t: 1e3 * t})
    assert not [one for one in near.figures.remarks if "leaves its range" in one]


def test_surrogate_that_does_not_know_its_past_or_is_not_trusted_is_remarked(
    tmp_path: Path,
) -> None:
    links, fmus = [("gain.y", "osc.force")], {"gain": write_gain(tmp_path), "osc": DUFFING}
    short = slide.couple(fmus, links, step=0.03, stop=0.3)
    (remark,) = [one for one in short.figures.remarks if "osc" in one]
    assert remark.startswith("osc.error_bound_filled is 0.0")
    known = {"osc.prehistory_known": 1.0}
    for stop, parameters in ((0.3, known), (6.0, {})):
        run = slide.couple(fmus, links, step=0.03, stop=stop, parameters=parameters)
        assert not [one for one in run.figures.remarks if "osc" in one]
    strict = {**known, "osc.position_error_tolerance": 0.0}
    run = slide.couple(fmus, links, step=0.03, stop=0.3, parameters=strict)
    (remark,) = [one for one in run.figures.remarks if "osc" in one]
    assert remark.startswith("osc.trusted is false at 100 % of the communication points at which")


def test_past_that_users_give_is_kept() -> None:
    """Else the first inputs of an FMU whose inputs move count as held for ever."""
    usual = {
        "step": 0.03125,
        "stop": 0.0625,
        "inputs": {"crank.director_x": 1.0, "crank.director_y": 0.0},
        "record": ["crank.error_bound_filled"],
    }
    for given, filled in (({}, 1.0), ({"crank.prehistory_known": 0.0}, 0.0)):
        run = slide.couple({"crank": CRANK}, [], parameters=given, **usual)
        assert run["crank.error_bound_filled"][0] == filled
    with refused(ValueError, "'crank' is a component", "such as 'crank.VARIABLE'"):
        slide.couple({"crank": CRANK}, [], parameters={"crank": {}}, **usual)
