"""FMUs of slide-fmu in coupled runs answer as they do alone, in both standards."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import slide_fmu as slide

ROOT = Path(__file__).parents[3]
DUFFING = ROOT / "fmus" / "duffing" / "duffing.fmu"
CRANK = ROOT / "fmus" / "slider_crank" / "slider_crank.fmu"
STEPS = 40
ROUNDING = 1e-6
"""Part of an output's size: times are sums of steps."""


@pytest.mark.parametrize("fmi", [2, 3])
def test_held_input_is_given_as_in_a_run_of_the_fmu_alone(fmi: int, tmp_path: Path) -> None:
    h = 0.03
    fmu = DUFFING
    if fmi == 3:
        fmu = slide.export_fmu(slide.load(DUFFING), tmp_path / "three.fmu", fmi=3)
    force = 300 * np.sin(np.arange(STEPS + 1))
    run = slide.couple(
        {"car": fmu},
        [],
        step=h,
        stop=h * STEPS,
        inputs={"car.force": lambda t: force[int(t / h + 1e-6)]},
    )
    alone = slide.simulate(DUFFING, h * np.arange(STEPS + 1), force)[:, 0]
    assert run["car.position"] == pytest.approx(alone, abs=ROUNDING * np.ptp(alone))
    assert list(run.values) == ["car.force", "car.position"]
    assert run.figures.inputs == {"car": "held"}


def test_moving_input_is_given_at_the_end_of_each_step() -> None:
    h = 0.03125
    t = h * np.arange(STEPS + 1)
    angle = 2 * np.sin(t)
    run = slide.couple(
        {"crank": CRANK},
        [],
        step=h,
        stop=h * STEPS,
        inputs={
            "crank.director_x": lambda t: np.cos(2 * np.sin(t)),
            "crank.director_y": lambda t: np.sin(2 * np.sin(t)),
        },
    )
    alone = slide.simulate(CRANK, t, np.stack([np.cos(angle), np.sin(angle)], axis=1))[:, 0]
    # a single call does not know how inputs bend within a step, as simulate does
    assert run["crank.deflection"] == pytest.approx(alone, abs=0.02 * np.ptp(alone))
    assert run.figures.inputs == {"crank": "reached"}


@pytest.mark.parametrize(("part", "count"), [(1.0, 0), (0.5, 1)])
def test_steps_shorter_than_those_of_a_surrogate_get_a_remark(part: float, count: int) -> None:
    step = 0.03125 * part
    given = {"crank.director_x": 1.0, "crank.director_y": 0.0}
    run = slide.couple({"crank": CRANK}, [], step=step, stop=4 * step, inputs=given)
    assert len(run.figures.remarks) == count
    for remark in run.figures.remarks:
        assert "is shorter than 0.03125 s, the step of 'crank'" in remark


def test_plain_explicit_steps_leave_the_forecast_to_the_fmu() -> None:
    run = slide.couple(
        {"crank": CRANK},
        [],
        step=0.03125,
        stop=0.3125,
        method="jacobi",
        extrapolation="zero",
        inputs={"crank.director_x": 1.0, "crank.director_y": 0.0},
    )
    assert run.figures.inputs == {"crank": "forecast"}


def test_derivatives_of_an_fmu_replace_differences(tmp_path: Path) -> None:
    """Two oscillators, each of which is pushed by a gain of the other's position."""
    from tests.apps.couple.test_refusals import write_gain

    gain = write_gain(tmp_path)
    run = slide.couple(
        {"one": DUFFING, "gain": gain},
        [("one.position", "gain.u"), ("gain.y", "one.force")],
        step=0.03,
        stop=1.2,
    )
    assert run["one.force"][1:] == pytest.approx(
        1 + 0.5 * run["one.position"][1:], rel=1e-3, abs=1e-6
    )
    assert run.figures.iterations <= 3
