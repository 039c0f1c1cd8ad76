"""Lasting tones fill the cells of frequency and amplitude, one input at a time."""

from __future__ import annotations

import dataclasses
import itertools
import math
from pathlib import Path

import numpy as np
import pytest

from slide_fmu.core.signals import Signal
from slide_fmu.recipe.case import Case, case_of
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation.calls import InputsLabel, MeasuredMotion
from slide_fmu.validation.row import TONES, ToneCell
from slide_fmu.validation.task import UNSEEN_SEED, Task
from slide_fmu.validation.tones import AMPLITUDES, COLUMNS, _cells, _drawn, tone_kinds
from slide_fmu.validation.user_channels import Channel
from slide_fmu.validation.user_inputs import simulated_kinds
from tests.progress import silent
from tests.validation.lag import lag_recipe, lag_surrogate

FORCE = Channel(
    (Signal("force", "N", -300.0, 1000.0),), -300.0, 1000.0, 0.0, (1.0, 60.0), (0.02, 2.0)
)
HEAT = dataclasses.replace(
    FORCE, signals=(Signal("heat", "K", 280.0, 320.0),), low=280.0, high=320.0, rest=290.0
)
JOINT = dataclasses.replace(
    FORCE,
    signals=(Signal("joint", "rad", -1.0, 2.5),),
    low=-1.0,
    high=2.5,
    rest=0.5,
    speed=1.4,
    acceleration=5.7,
)
TIME = np.linspace(0.0, 40.0, 40_001)


def test_cells_cover_the_whole_band_without_gaps() -> None:
    cells = list(_cells([FORCE]))
    assert len(cells) == COLUMNS * (len(AMPLITUDES) - 1)
    bands = sorted({cell.hz for cell in cells})
    assert bands[0][0] == pytest.approx(1.0 / (2 * math.pi), rel=0.05)
    assert bands[-1][1] == pytest.approx(60.0 / (2 * math.pi), rel=0.05)
    assert all(one[1] == other[0] for one, other in itertools.pairwise(bands))


@pytest.mark.parametrize("cell", list(_cells([FORCE, HEAT])))
def test_one_input_moves_within_its_cell_and_all_stay_in_their_ranges(cell: ToneCell) -> None:
    alone = set()
    for index in range(8):
        (motion,) = _drawn([FORCE, HEAT], cell, index, np.random.default_rng(index))
        values = motion.inputs(TIME)
        (moving,) = np.flatnonzero(np.ptp(values, axis=0) > 1e-9)
        alone.add(int(moving))
        for column, channel in zip(values.T, (FORCE, HEAT), strict=True):
            assert channel.low <= column.min() <= column.max() <= channel.high
        moved = (FORCE, HEAT)[moving]
        amplitude = np.ptp(values[:, moving]) / (moved.high - moved.low)
        assert cell.amplitude[0] - 1e-3 <= amplitude <= cell.amplitude[1] + 1e-9
        assert cell.hz[0] <= motion.hz <= cell.hz[1]
        still = (FORCE, HEAT)[1 - moving]
        at_rest = np.allclose(values[:, 1 - moving], still.rest)
        assert at_rest == (index // 2 % 2 == 0)
    assert alone == {0, 1}


def test_motions_keep_their_limits_and_leave_cells_empty() -> None:
    empty = 0
    for cell in _cells([JOINT]):
        for motion in _drawn([JOINT], cell, 0, np.random.default_rng(3)):
            (tone,) = motion.inputs.waveforms
            speed = 2 * math.pi * motion.hz * tone.amplitude
            assert speed <= 1.4 * (1 + 1e-9)
            assert 2 * math.pi * motion.hz * speed <= 5.7 * (1 + 1e-9)
            break
        else:
            empty += 1
    assert 0 < empty < 2 * COLUMNS


def simulated(
    surrogate: Surrogate, case: Case, task: Task, each: int
) -> dict[InputsLabel, list[MeasuredMotion]]:
    kinds = tone_kinds(surrogate, case, task, each)
    return simulated_kinds(surrogate, case, kinds, silent)


@pytest.mark.parametrize("hold", ["zero_order", "first_order"])
def test_each_cell_has_as_many_motions_as_asked_for(tmp_path: Path, hold: str) -> None:
    recipe = lag_recipe(tmp_path, hold)
    surrogate, case = lag_surrogate(recipe, hold), case_of(recipe)
    found = simulated(surrogate, case, Task(UNSEEN_SEED, duration=6.0), 2)
    assert len(found) == COLUMNS * (len(AMPLITUDES) - 1)
    for label, motions in found.items():
        assert (label.group, len(motions)) == (TONES, 2)
        assert label.tones is not None
        assert label.inputs.startswith(f"tones of {label.tones.hz[0]:g} to ")
        for motion in motions:
            values = motion.course(motion.grid * np.arange(len(motion.truth)))
            assert 0.05 < np.ptp(values) / 8.0 <= 1.0
    others = simulated(surrogate, case, Task(7, duration=6.0), 1)
    one, other = (next(iter(each.values()))[0].truth for each in (found, others))
    assert not np.array_equal(one[: len(other)], other[: len(one)])
