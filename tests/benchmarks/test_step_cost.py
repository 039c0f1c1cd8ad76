"""The cost of a communication step is measured at the steps that were asked for."""

from __future__ import annotations

import argparse
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from step_cost import case_of, length_of, measure, other_of

from tests.progress import no_stages

pytestmark = pytest.mark.extended

FMUS = Path(__file__).parents[2] / "fmus"
OWN = 0.03
FASTEST = 20.0
"""No joint of the robot turns faster, in rad/s."""


@pytest.mark.parametrize(
    ("step", "seconds"),
    [
        ("h", OWN),
        ("2h", 2 * OWN),
        ("h/4", OWN / 4),
        ("0.001", 0.001),
        ("irregular", None),
        ("mixed", None),
    ],
)
def test_communication_steps_are_read_as_the_command_says(step: str, seconds: float) -> None:
    assert length_of(step, OWN) == (None if seconds is None else pytest.approx(seconds))


def test_communication_step_that_is_none_is_rejected_with_what_is_expected() -> None:
    with pytest.raises(
        ValueError, match="'k/4'; expected seconds, irregular, mixed, or such as h"
    ):
        length_of("k/4", OWN)


def test_inputs_go_there_and_back_without_a_jump() -> None:
    case = case_of(FMUS / "robot_6r" / "robot_6r.fmu")
    values = case.motion(np.arange(0.0, 40.0, 1e-3))
    assert np.abs(np.diff(values, axis=0)).max() < FASTEST * 1e-3


@pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler")
def test_fmu_beside_itself_costs_the_same_in_c_and_through_fmpy() -> None:
    arguments = argparse.Namespace(
        fmus=[FMUS / "duffing" / "duffing.fmu"],
        against=FMUS,
        steps="h,h/4",
        calls="plain,known",
        rounds=7,
    )
    found = measure(arguments, no_stages)["fmus"]["duffing"]
    rows, sizes = found["rows"], found["state_bytes"]
    assert sizes["own"] == sizes["against"] > 10_000
    # its inputs are held: there is no known call
    assert [(r["call"], r["with_bounds"], r["step"]) for r in rows if r["file"] == "own"] == [
        ("plain", bounds, step) for bounds in (False, True) for step in ("h", "h/4")
    ]
    for row in rows:
        assert 0 < row["c_us"] < row["fmpy_us"]
        if row["file"] == "own":
            assert row["c_over_against"] == pytest.approx(1, abs=0.25)


def test_other_fmu_of_a_folder_has_the_same_file_name(tmp_path: Path) -> None:
    assert other_of(FMUS / "duffing" / "duffing.fmu", FMUS) == FMUS / "duffing" / "duffing.fmu"
    with pytest.raises(FileNotFoundError, match=r"0 files duffing\.fmu; expected one"):
        other_of(FMUS / "duffing" / "duffing.fmu", tmp_path)
