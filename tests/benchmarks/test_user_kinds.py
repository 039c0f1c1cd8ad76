"""Kinds of input as users drive machines keep the limits that they promise."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from crank_kinds import CRANK, HARSH_LIMITS, MODERATE_LIMITS
from force_kinds import FORCES, LIMIT, MODERATE_FORCE
from joint_kinds import JOINT_MOTIONS, limits_of
from kind_tables import HARSH, LEVELS, Machine, rng_of
from user_kind_truths import CONTROL
from user_kinds import measure, parser

from mbs_models.robot_6r.puma_560 import LIMITS
from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.export import load
from tests.progress import no_stages

ROUNDING = 1e-6
"""Differences of samples keep limits up to this part, since they are rounded."""
STEPS = {"force": 0.03, "crank": 1 / 32, "joints": 1 / 60}
MACHINES = {"force": FORCES, "crank": CRANK, "joints": JOINT_MOTIONS}


def drawn(name: str, case: tuple[str, str], index: int) -> FloatArray:
    times = STEPS[name] * np.arange(round(20.0 / STEPS[name]))
    return MACHINES[name].inputs(case, times, rng_of(1, case, index, 0))


def rates(values: FloatArray, step: float) -> tuple[FloatArray, FloatArray]:
    """Return largest first and second differences per time of every column."""
    first = np.abs(np.diff(values, axis=0)).max(axis=0) / step
    return first, np.abs(np.diff(values, 2, axis=0)).max(axis=0) / step**2


def many(machine: Machine) -> list[tuple[str, str]]:
    cases = machine.cases()
    assert len({kind for kind, _ in cases}) >= 12
    return cases


@pytest.mark.parametrize("name", MACHINES)
def test_same_seed_gives_same_inputs_and_another_index_others(name: str) -> None:
    for case in many(MACHINES[name]):
        first, again, other = (drawn(name, case, index) for index in (0, 0, 1))
        assert np.array_equal(first, again), case
        assert np.isfinite(first).all(), case
        assert np.ptp(first, axis=0).max() > 0, case
        assert not np.array_equal(first, other), case


def test_forces_keep_their_range() -> None:
    for case in many(FORCES):
        for index in range(3):
            largest = np.abs(drawn("force", case, index)).max()
            assert largest <= (LIMIT if case[1] == HARSH else MODERATE_FORCE), case


def test_cranks_keep_speed_and_acceleration() -> None:
    step = STEPS["crank"]
    for case in many(CRANK):
        limits = HARSH_LIMITS if case[1] == HARSH else MODERATE_LIMITS
        for index in range(3):
            director = drawn("crank", case, index)
            angle = np.unwrap(np.arctan2(director[:, 1], director[:, 0]))[:, None]
            speed, acceleration = rates(angle, step)
            assert speed[0] <= limits.speed * (1 + ROUNDING), case
            assert acceleration[0] <= limits.acceleration * (1 + ROUNDING), case


def test_joints_keep_ranges_speeds_and_accelerations() -> None:
    for case in many(JOINT_MOTIONS):
        limits = limits_of(case[1] == HARSH)
        for index in range(2):
            joints = drawn("joints", case, index)
            speed, acceleration = rates(joints, STEPS["joints"])
            assert np.all(np.abs(joints) <= LIMITS), case
            assert np.all(speed <= limits.speeds * (1 + ROUNDING)), case
            assert np.all(acceleration <= limits.accelerations * (1 + ROUNDING)), case


@pytest.mark.extended
def test_surrogates_are_measured_on_the_same_kept_truths(tmp_path: Path) -> None:
    fmu = Path(__file__).parents[2] / "fmus" / "duffing" / "duffing.fmu"
    other, store = tmp_path / "surrogate.slide", tmp_path / "store"
    replace(load(fmu), bound=None).save(other)
    options = [fmu, "--trajectories=1", "--control=1", "--duration=1", "--workers=0"]
    given = parser().parse_args(
        [str(part) for part in (*options, "--surrogate", other, "--store", store)]
    )
    figures = measure(given, no_stages)
    kept = sorted(place.stat().st_mtime_ns for place in store.rglob("*.npz"))
    assert len(kept) == len(FORCES.cases()) + 1
    assert measure(given, no_stages) == figures
    assert sorted(place.stat().st_mtime_ns for place in store.rglob("*.npz")) == kept
    first, second = figures["surrogates"].values()
    assert set(first["levels"]) == {*LEVELS, CONTROL}
    assert 0.8 < first["levels"][HARSH]["coverage"] <= 1
    assert not second["has_a_bound"]
    assert "coverage" not in second["levels"][HARSH]
    for one, another in zip(first["kinds"], second["kinds"], strict=True):
        assert one["outputs"] == another["outputs"]
