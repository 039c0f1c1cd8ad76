"""FMUs of slide-fmu in coupled runs answer as they do alone, in both standards."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import slide_fmu as slide
from slide_fmu.apps.couple.result import CoupledFigures, CoupledRun
from slide_fmu.apps.couple.ssp import read_inputs
from tests.figures import filled

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


def test_both_standards_give_the_same_coupled_motion(
    halves: dict[str, Path], tmp_path: Path
) -> None:
    """Without its derivatives, Newton's method would look inside of the surrogate's samples."""
    three = slide.export_fmu(slide.load(DUFFING), tmp_path / "three.fmu", fmi=3)
    links = [("one.position", "mass.force"), ("mass.position", "one.force")]
    found = []
    for fmu in (DUFFING, three):
        run = slide.couple(
            {"one": fmu, "mass": halves["upper"]},
            links,
            step=0.03,
            stop=3.0,
            parameters={"mass.mass": 0.001, "mass.start": 0.5},
        )
        found.append(run["one.position"])
    np.testing.assert_allclose(found[1], found[0], rtol=0, atol=1e-9 * np.ptp(found[0]))


@pytest.mark.parametrize("method", ["jacobi", "gauss_seidel", "fixed_point", "newton"])
def test_components_without_connections_run_side_by_side(method: str) -> None:
    names = ["one.position", "two.position"]
    run = slide.couple(
        {"one": DUFFING, "two": DUFFING},
        [],
        step=0.03,
        stop=1.2,
        method=method,
        inputs={"one.force": 200.0, "two.force": -200.0},
        record=[*names, names[0]],  # twice the same is once
    )
    one, two = (run[name] for name in names)
    assert one == pytest.approx(0.124, abs=1e-3)  # a held force: no motion
    np.testing.assert_allclose(two, -one, atol=1e-3)


def test_names_with_commas_are_written_so_that_they_can_be_read(tmp_path: Path) -> None:
    names = ["body.R[1,2]", "body.v"]
    table = {name: np.array([1.0, 2.0]) for name in names}
    figures = filled(CoupledFigures)
    written = CoupledRun(np.array([0.0, 0.5]), table, {}, figures).write(tmp_path / "out.csv")
    found = read_inputs(written)
    assert list(found) == names
    np.testing.assert_array_equal(found["body.R[1,2]"], [[0.0, 0.5], [1.0, 2.0]])


@pytest.mark.parametrize("extrapolation", ["zero", "linear"])
def test_held_inputs_are_held_where_they_move_smoothly(extrapolation: str) -> None:
    """What is set is the value in the middle of the step, from which an FMU need not go on."""
    h = 0.03

    def force(t: float) -> float:
        return float(300 * np.sin(2 * t))

    run = slide.couple(
        {"car": DUFFING},
        [],
        step=h,
        stop=h * STEPS,
        method="jacobi",
        extrapolation=extrapolation,
        inputs={"car.force": force},
    )
    middle = np.array([force((k + 0.5) * h) for k in range(STEPS)])
    expected = slide.load(DUFFING).predict_newest(middle[:, None])[:, 0]
    assert run["car.position"][1:] == pytest.approx(expected, abs=1e-5 * np.ptp(expected))
