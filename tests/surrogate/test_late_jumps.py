"""What the companion of an error bound sees of inputs that jump between samples."""

from __future__ import annotations

import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray
from slide_fmu.surrogate.bound_statistics import with_late_jumps


def late(values: object, part: float = 0.5) -> FloatArray:
    """One input, (N,), as the companion sees it."""
    return with_late_jumps(np.asarray(values, np.float64)[None, :, None], part)[0, :, 0]


def test_sample_after_a_jump_lacks_a_part_of_it() -> None:
    jumps = [0.0, 0.0, 0.0, 2.0, 2.0, 2.0, 2.0, -1.0, -1.0, -1.0]
    assert late(jumps).tolist() == [0, 0, 0, 2, 1, 2, 2, -1, 0.5, -1]
    assert late(jumps, 0.25).tolist() == [0, 0, 0, 2, 1.5, 2, 2, -1, -0.25, -1]
    assert late(jumps, 0.0).tolist() == jumps


def test_jump_out_of_a_motion_counts_as_far_as_it_exceeds_it() -> None:
    """A change of 3, beside changes of 0.5: so far as it is more than four times as large."""
    found = late([0.0, 0.5, 1.0, 1.5, 4.5, 5.0, 5.5])
    assert found == pytest.approx([0.0, 0.5, 1.0, 1.5, 4.5, 5.0 - 0.5 * (3 - 4 * 0.5), 5.5])


@pytest.mark.parametrize("samples", [6, 7.3, 12, 40, 300])
def test_sines_and_kinks_have_no_jumps(samples: float) -> None:
    """Also where the sine passes its peak, and the changes before are small; once it has begun."""
    for phase in np.linspace(0, 2 * np.pi, 17):
        sine = np.sin(2 * np.pi * np.arange(200) / samples + phase)
        np.testing.assert_array_equal(late(sine)[5:], sine[5:])
    ramp = np.concatenate([np.zeros(20), np.arange(20.0), np.full(20, 19.0)])
    np.testing.assert_array_equal(late(ramp), ramp)


def test_first_inputs_count_as_constant_before_and_inputs_do_not_mix() -> None:
    both = np.array([[[5.0, 1.0], [7.0, 1.0], [7.0, 1.0], [7.0, 4.0], [7.0, 4.0]]])
    found = with_late_jumps(both, 0.5)[0]
    assert found[:, 0].tolist() == [5, 7, 6, 7, 7]
    assert found[:, 1].tolist() == [1, 1, 1, 4, 2.5]
