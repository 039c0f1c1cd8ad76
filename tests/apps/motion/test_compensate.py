"""Corrected paths go where they should, keep their limits, and say where nothing can be done."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import slide_fmu as slide
from slide_fmu.apps.motion import Limits, MotionError, compensate, coordinates_of
from slide_fmu.apps.motion.compensation import chain_of_surrogate
from slide_fmu.apps.motion.path_correction import read_path
from slide_fmu.core.signals import FloatArray
from tests.refusals import refused

ROOT = Path(__file__).parents[3]
CLOSED = ROOT / "docs" / "tutorials" / "closed_path.csv"


def released(name: str) -> slide.Surrogate:
    return slide.load(ROOT / f"fmus/{name}/{name}.fmu")


def unlimited(surrogate: slide.Surrogate, **changes: FloatArray) -> Limits:
    coordinates = coordinates_of(surrogate.inputs)
    ends = {end: np.array([getattr(c, end) for c in coordinates]) for end in ("low", "high")}
    free = {name: np.full(len(coordinates), np.inf) for name in ("speed", "acceleration", "jerk")}
    return Limits(**{**ends, **free, **changes})


def rms(error: FloatArray) -> float:
    return float(np.sqrt(np.mean(np.sum(error**2, axis=-1))))


def test_tool_of_the_robot_follows_the_rigid_path_on_the_streamed_surrogate() -> None:
    robot = released("robot_6r")
    path = read_path(str(CLOSED), coordinates_of(robot.inputs), robot).motion
    found = compensate(robot, path, unlimited(robot))
    assert rms(found.before) > 3e-3
    assert rms(found.after) < rms(found.before) / 1000
    chain = chain_of_surrogate(robot)
    assert chain is not None
    lead = np.tile(found.motion[:1], (300, 1))
    streamed = robot.predict_newest(np.concatenate([lead, found.motion]))[300:]
    error = chain.tool_position(found.motion) + streamed - chain.tool_position(path)
    assert rms(error) < rms(found.before) / 500
    assert 1 < found.condition.max() < 100


def test_force_on_the_duffing_moves_it_as_wished() -> None:
    duffing = released("duffing")
    time = duffing.window.step * np.arange(200)
    wished = 0.15 * np.sin(3 * time[:, None]) * np.minimum(time, 1.0)[:, None] ** 3
    still = np.zeros((200, 1))
    found = compensate(duffing, still, unlimited(duffing), wished)
    assert rms(found.after) < 0.01 * rms(wished)
    lead = np.zeros((300, 1))
    moved = duffing.predict_newest(np.concatenate([lead, found.motion]))[300:]
    assert rms(moved - wished) < 0.02 * rms(wished)


def test_a_wish_beyond_the_range_of_the_force_is_refused_with_the_limit() -> None:
    duffing = released("duffing")
    time = duffing.window.step * np.arange(200)
    wished = 1.5 * np.sin(3 * time[:, None]) * np.minimum(time, 1.0)[:, None] ** 3
    with refused(MotionError, "limit of range", "expected at most 100 %"):
        compensate(duffing, np.zeros((200, 1)), unlimited(duffing), wished)


def test_limits_that_the_correction_breaks_are_named() -> None:
    robot = released("robot_6r")
    path = read_path(str(CLOSED), coordinates_of(robot.inputs), robot).motion
    slow = unlimited(robot, speed=np.full(6, 0.1))
    with refused(MotionError, "limit of speed", "expected at most 100 %"):
        compensate(robot, path, slow)


def test_a_path_through_singular_places_becomes_no_worse() -> None:
    robot = released("robot_6r")
    rng = np.random.default_rng(5)
    low, high = (np.array([getattr(s, end) for s in robot.inputs]) for end in ("low", "high"))
    start, goal = rng.uniform(0.6 * low, 0.6 * high, (4, 6))[2:]
    done = np.linspace(0, 1, 200)[:, None]
    path = start + done**3 * (10 - 15 * done + 6 * done**2) * (goal - start)
    found = compensate(robot, path, unlimited(robot))
    assert found.condition.max() > 100
    assert rms(found.after) < rms(found.before)


def test_surrogates_without_a_chain_need_a_wish() -> None:
    duffing = released("duffing")
    with refused(MotionError, "knows no serial chain", "add what they should be"):
        compensate(duffing, np.zeros((50, 1)), unlimited(duffing))


HEADS = "time,force,position"


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        (["time,power", "0,1", "1,2"], "force"),
        (["time,force", "0,1"], "expected at least two samples"),
        (
            ["time,force", "0,1", "1,2", "1,3"],
            "1 s of sample 2 comes after 1 s; expected times that rise",
        ),
        (["time,force", "0,1", "1,", "2,3"], "'force' in sample 1 is no number"),
    ],
)
def test_files_that_are_no_paths_are_refused(
    lines: list[str], message: str, tmp_path: Path
) -> None:
    path = tmp_path / "path.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    duffing = released("duffing")
    with pytest.raises(MotionError, match=message):
        read_path(str(path), coordinates_of(duffing.inputs), duffing)


def test_a_path_is_sampled_at_the_step_by_splines(tmp_path: Path) -> None:
    path, time = tmp_path / "path.csv", np.linspace(0, 2, 41)
    rows = [f"{t:.12g},{100 * np.sin(t):.12g},{0.1 * t:.12g}" for t in time]
    path.write_text("\n".join([HEADS, *rows]) + "\n", encoding="utf-8")
    duffing = released("duffing")
    found = read_path(str(path), coordinates_of(duffing.inputs), duffing)
    at = 0.03 * np.arange(len(found.motion))
    assert at[-1] == pytest.approx(2.0, abs=0.03)
    np.testing.assert_allclose(found.motion[:, 0], 100 * np.sin(np.minimum(at, 2)), atol=0.02)
    assert found.wished is not None
    # an output answers the force of its sample a step later
    np.testing.assert_allclose(found.wished[:, 0], 0.1 * np.minimum(at + 0.03, 2), atol=1e-9)


def test_a_path_of_an_angle_has_cosine_and_sine(tmp_path: Path) -> None:
    crank, time = released("slider_crank"), np.linspace(0, 2, 41)
    angle = 2 * time**2  # more than a turn
    names = [signal.name for signal in crank.inputs]
    rows = [f"{t},{np.cos(a)},{np.sin(a)}" for t, a in zip(time, angle, strict=True)]
    path = tmp_path / "path.csv"
    path.write_text("\n".join([",".join(["time", *names]), *rows]) + "\n", encoding="utf-8")
    found = read_path(str(path), coordinates_of(crank.inputs), crank).motion
    at = np.minimum(crank.window.step * np.arange(len(found)), 2)
    np.testing.assert_allclose(found[:, 0], 2 * at**2, atol=2e-3)
    path.write_text(f"time,{names[0]}\n0,0\n1,1\n", encoding="utf-8")
    with pytest.raises(MotionError, match=names[1]):
        read_path(str(path), coordinates_of(crank.inputs), crank)


@pytest.mark.parametrize("radius", [0.0, 3.0])
def test_columns_that_are_no_cosine_and_sine_are_refused(radius: float, tmp_path: Path) -> None:
    crank, time = released("slider_crank"), np.linspace(0, 2, 41)
    rows = [f"{t},{radius * np.cos(t)},{radius * np.sin(t)}" for t in time]
    names = [signal.name for signal in crank.inputs]
    path = tmp_path / "path.csv"
    path.write_text("\n".join([",".join(["time", *names]), *rows]) + "\n", encoding="utf-8")
    with pytest.raises(MotionError, match=f"lie {radius:.4g} from 0; expected cosine and sine"):
        read_path(str(path), coordinates_of(crank.inputs), crank)


def test_corrections_that_gain_less_than_the_margin_are_refused() -> None:
    """A crank that turns far beyond its speed, whose rod shall not bend."""
    crank = released("slider_crank")
    count = 100
    path = 8 * np.pi * np.linspace(0, 1, count)[:, None] ** 2
    with pytest.raises(MotionError, match=r"does not become smaller|may be off by"):
        compensate(crank, path, unlimited(crank), np.zeros((count, 1)))


def test_a_path_that_is_off_already_and_one_without_error_are_told_apart() -> None:
    duffing = released("duffing")
    outside = np.full((50, 1), 3000.0)
    with refused(MotionError, "300 %", "limit of range"):
        compensate(duffing, outside, unlimited(duffing), np.zeros((50, 1)))
