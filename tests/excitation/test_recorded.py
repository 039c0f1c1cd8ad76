"""Recorded inputs drive a system as they are in their file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from pydantic import TypeAdapter, ValidationError

from slide_fmu.core.signals import Signal
from slide_fmu.excitation.kinds import Excitation
from slide_fmu.excitation.recorded import REST, Recorded
from tests.refusals import refused

ROAD = Signal("road", "m", -0.05, 0.05, hold="first_order")
FORCE = Signal("force", "N", -5.0, 5.0)
TIME = 0.01 * np.arange(300)


def write_record(folder: Path, count: int = 201, names: str = "time,road,f") -> Path:
    """Write a record of 1 s with a road in waves and a force in steps."""
    time = np.linspace(3.0, 4.0, count)
    road = 0.04 * np.sin(20.0 * time)
    force = np.floor(10.0 * (time - 3.0)) - 4.0
    path = folder / "drive.csv"
    np.savetxt(path, np.stack([time, road, force], 1), delimiter=",", header=names, comments="")
    return path


def recorded(path: Path, **extra: object) -> Recorded:
    table = {"kind": "file", "weight": 1.0, "path": str(path), "columns": {"force": "f"}, **extra}
    kind = TypeAdapter(Excitation).validate_python(table)
    assert isinstance(kind, Recorded)
    return kind


def test_parts_are_those_of_the_file_after_a_rest_under_its_first_values(tmp_path: Path) -> None:
    kind = recorded(write_record(tmp_path, count=100_001))
    kind.check((ROAD, FORCE))
    rested = 0
    for seed in range(20):
        inputs = kind.inputs((ROAD, FORCE), TIME, 1.0, np.random.default_rng(seed))
        # the file is shorter than the trajectory: it runs backwards after its end
        begin = np.random.default_rng(seed).uniform(-REST * TIME[-1], 1.0)
        phase = np.mod(np.maximum(begin + TIME, 0.0), 2.0)
        seconds = 3.0 + np.where(phase <= 1.0, phase, 2.0 - phase)
        assert inputs[:, 0] == pytest.approx(0.04 * np.sin(20.0 * seconds), abs=1e-6)
        assert set(np.unique(inputs[:, 1])) <= set(range(-4, 7))
        jumps = np.abs(np.diff(inputs[:, 0]))
        assert jumps.max() <= 0.04 * 20.0 * 0.01 * 1.001  # it never jumps, at the ends either
        rested += bool(inputs[0, 0] == inputs[1, 0])
    assert 0 < rested < 20


def test_nothing_behind_the_learnt_part_is_ever_drawn(tmp_path: Path) -> None:
    path = tmp_path / "drive.csv"
    time = np.linspace(0.0, 10.0, 1001)
    np.savetxt(path, np.stack([time, time], 1), delimiter=",", header="t,force", comments="")
    force = Signal("force", "N", 0.0, 10.0, hold="first_order")
    kind = recorded(path, columns={}, learnt=0.5)
    kind.check((force,))
    drawn = [
        kind.inputs((force,), time, 1.0, np.random.default_rng(seed))[:, 0]
        for time in (TIME, 4.0 * TIME)
        for seed in range(50)
    ]
    assert max(values.max() for values in drawn) <= 5.0
    whole = drawn[:50]  # the part is longer than these trajectories: they run forwards
    assert min(np.diff(values).min() for values in whole) >= 0.0
    assert max(values.max() for values in whole) > 4.5
    assert kind.judging() == "second half of drive.csv"
    assert recorded(path, columns={}, learnt=0.8).judging() == "last 20 % of drive.csv"


def test_a_file_that_judges_stays_in_the_ranges(tmp_path: Path) -> None:
    path = write_record(tmp_path)
    narrow = (Signal("road", "m", -0.05, 0.03), FORCE)
    recorded(path).check(narrow)  # clipped, and said
    with refused(
        ValueError, "'road' = 0.0399999 m", "values are beyond its range", "-0.05 .. 0.03 m"
    ):
        recorded(path, learnt=0.5).check(narrow)


def test_scale_and_factor_multiply_deviations_and_widen_the_range(tmp_path: Path) -> None:
    path = write_record(tmp_path, count=5001)
    plain, scaled, wide = (
        recorded(path, scale=[scale, scale]).inputs(
            (ROAD,), TIME, factor, np.random.default_rng(4)
        )[:, 0]
        for scale, factor in ((1.0, 1.0), (0.5, 1.0), (1.0, 3.0))
    )
    mean = 0.04 * np.sin(20.0 * np.linspace(3.0, 4.0, 5001)).mean()
    assert scaled - mean == pytest.approx(0.5 * (plain - mean), abs=1e-12)
    assert np.abs(wide).max() > 0.1  # three times as far, within three times the range
    assert np.abs(wide).max() <= 0.15


def test_record_in_another_unit_is_refused_and_one_with_peaks_is_not(tmp_path: Path) -> None:
    path = write_record(tmp_path, count=5001)
    in_km = Signal("road", "km", -5e-5, 5e-5)
    with refused(ValueError, "-0.04 .. 0.04 for 'road'", "give them in km"):
        recorded(path).check((in_km,))
    recorded(path).check((Signal("road", "m", -0.02, 0.02),))  # twice the range is clipped


def test_the_same_file_is_known_by_its_digest(tmp_path: Path) -> None:
    path = write_record(tmp_path)
    kind = recorded(path)
    again = TypeAdapter(Excitation).validate_python(kind.model_dump(mode="json"))
    assert again == kind
    path.write_text(path.read_text() + "4.5,0.0,0.0\n")
    with refused(ValidationError, "changed since"):
        TypeAdapter(Excitation).validate_python(kind.model_dump(mode="json"))


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with refused(ValidationError, "no file '", "missing.csv' in", "check the name"):
        recorded(tmp_path / "missing.csv")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "time,way,f\n0,1,1\n1,2,2\n",
            r"has no columns \['road'\]; it has \['time', 'way'",
        ),
        ("time,road,f\n0,1,1\n1,,2\n", r"sample 2 \(line 3, t = 1 s\): 'road' is no finite"),
        ("time,road,f\n0,1,1\n0,2,2\n", r"line 3, t = 0 s\): the time does not rise"),
        ("way,road,f\n0,1,1\n1,2,2\n", r"has no column of times"),
        ("time,road,f\n0,1,1\n", r"at least two samples"),
    ],
)
def test_a_file_that_cannot_drive_the_inputs_is_refused(
    tmp_path: Path, text: str, message: str
) -> None:
    path = tmp_path / "drive.csv"
    path.write_text(text)
    kind = recorded(path)
    with pytest.raises(ValueError, match=message):
        kind.check((ROAD, FORCE))
