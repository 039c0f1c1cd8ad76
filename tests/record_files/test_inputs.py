"""Files of inputs are read at any clock, and refused where inputs would have to be guessed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from slide_fmu.core.signals import Signal
from slide_fmu.record_files.inputs import duration_of, read_inputs
from slide_fmu.record_files.record import RecordError
from tests.refusals import refused

FORCE = Signal("force", "N", -5.0, 5.0, hold="first_order")
VALVE = Signal("valve", "1", 0.0, 1.0)


def written(folder: Path, *lines: str) -> str:
    path = folder / "drive.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return str(path)


def test_inputs_move_or_are_held_at_an_uneven_clock(tmp_path: Path) -> None:
    path = written(tmp_path, "t [ms],valve,force", "500,0,1", "600,1,3", "2000,0,-4")
    table = read_inputs(path, (FORCE, VALVE))
    assert table.duration == duration_of(path, {}) == pytest.approx(1.5)
    at = np.array([-1.0, 0.05, 0.1 - 1e-9, 0.1, 0.8, 9.0])
    assert table.at(at)[:, 0] == pytest.approx([1.0, 2.0, 3.0, 3.0, -0.5, -4.0])
    assert table.at(at)[:, 1].tolist() == [0.0, 0.0, 1.0, 1.0, 1.0, 0.0]


def test_columns_and_times_may_have_other_names(tmp_path: Path) -> None:
    path = written(tmp_path, "clock,f", "0,1", "1,2")
    table = read_inputs(path, (FORCE,), {"time": "clock", "force": "f"})
    assert table.values[:, 0].tolist() == [1.0, 2.0]


def test_an_angle_stays_on_its_circle(tmp_path: Path) -> None:
    path = written(tmp_path, "time,x,y", "0,1,0", "1,0,1")
    angle = (
        Signal("x", "1", -1.0, 1.0, hold="first_order", angle="cosine"),
        Signal("y", "1", -1.0, 1.0, hold="first_order", angle="sine"),
    )
    halfway = read_inputs(path, angle).at(np.array([0.5]))
    assert np.hypot(*halfway[0]) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("lines", "parts"),
    [
        (("time,way", "0,1", "1,2"), ("has no columns ['force']", "a column for each of")),
        (("time,force", "0,1", "1,", "2,3"), ("line 3", "'force' is no finite", "fill the gap")),
        (("time,force", "0,1", "2,2", "1,3"), ("line 4", "does not rise, after 2 s")),
        (("time,force [kN]", "0,1", "1,2"), ("in kN", "expected N", "convert the column")),
        (
            ("time,force", *(f"{0.1 * k + 3.0 * (k > 20)},0" for k in range(40))),
            ("line 22", "next sample comes 3.1 s later", "0.1 s apart otherwise"),
        ),
    ],
)
def test_a_file_with_a_fault_is_refused(
    tmp_path: Path, lines: tuple[str, ...], parts: tuple[str, ...]
) -> None:
    with refused(RecordError, *parts):
        read_inputs(written(tmp_path, *lines), (FORCE,))


def test_values_beyond_a_range_are_refused_with_the_farthest(tmp_path: Path) -> None:
    path = written(tmp_path, "time,force", "0,1", "1,-6", "2,7")
    parts = "line 4, t = 2 s", "'force' = 7 N", "2 of 3 values", "-5 .. 5 N", "widen the range"
    with refused(RecordError, *parts):
        read_inputs(path, (FORCE,)).require_in_range()
