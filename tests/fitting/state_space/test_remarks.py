"""Remarks on fitted networks: on poor ones, and on those with few samples for each parameter."""

from __future__ import annotations

from slide_fmu.fitting.state_space.fit import PER_PARAMETER, remark_on, remark_on_samples
from slide_fmu.fitting.state_space.sizes import POOR


def test_parameters_are_held_against_samples() -> None:
    assert remark_on_samples(100, 100 * PER_PARAMETER) is None
    remark = remark_on_samples(529, 648)
    assert remark is not None
    assert "529 parameters and was learnt from 648 samples" in remark
    assert "1.2 for each; expected at least 10" in remark


def test_good_network_of_many_samples_needs_no_remark() -> None:
    assert remark_on(0.1, 0.99 * POOR, 10, 10_000) is None


def test_poor_network_of_few_samples_has_both_remarks() -> None:
    remark = remark_on(0.2, 0.05, 100, 500)
    assert remark is not None
    first, second = remark.split("; ", 1)
    assert "misses 20 % of the outputs" in first
    assert "5 % could still be learnt" in first
    assert "100 parameters" in second


def test_remark_says_that_errors_are_weighted_where_they_are() -> None:
    plain, weighted = (remark_on(0.2, 0.05, 10, 500, way) for way in (False, True))
    assert plain is not None
    assert weighted == plain.replace(
        "in validation)", "in validation, weighted by the spectrum of the noise)"
    )
