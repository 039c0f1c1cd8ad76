"""Parts of a step can be repeated on both families, and what is read is the network."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from timing import Part, TimedSurrogate, part_times, repeats

from tests.fmu.samples import CellShape, Shape, random_surrogate

pytestmark = pytest.mark.extended


@pytest.mark.parametrize("shape", [Shape(positions=3), Shape(cell=CellShape(), positions=3)])
def test_every_part_of_a_step_takes_time(shape: Shape) -> None:
    surrogate = random_surrogate(shape)
    timed = TimedSurrogate(surrogate)
    for part in Part:
        assert min(part_times(timed, part, 3, 30)) > 0
        assert repeats(timed, part) >= 1
    assert timed.memory >= 4 * surrogate.network.count_parameters()
