"""Remarks on fitted networks: on poor ones, and on those with few samples for each parameter."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import torch

from slide_fmu.fitting.state_space.fit import PER_PARAMETER, remark_on
from slide_fmu.fitting.state_space.sizes import POOR


def remark(learnable: float, parameters: int, samples: int, noise: Any = None) -> str:
    """The remark on a network with an error of 0.2; empty if there is none."""
    winner: Any = SimpleNamespace(error=0.2, shape=SimpleNamespace(n_parameters=parameters))
    whole = SimpleNamespace(targets=torch.zeros(samples))
    data: Any = SimpleNamespace(problem=SimpleNamespace(noise=noise, measured=False), whole=whole)
    return remark_on(winner, learnable, data) or ""


def test_parameters_are_held_against_samples() -> None:
    assert not remark(0.0, 100, 100 * PER_PARAMETER)
    found = remark(0.0, 529, 648)
    assert "529 parameters and was learnt from 648 samples" in found
    assert "1.2 for each; expected at least 10" in found


def test_good_network_of_many_samples_needs_no_remark() -> None:
    assert not remark(0.99 * POOR, 10, 10_000)


def test_poor_network_of_few_samples_has_both_remarks() -> None:
    first, second = remark(0.05, 100, 500).split("; ", 1)
    assert "misses 20 % of the outputs" in first
    assert "5 % could still be learnt" in first
    assert "100 parameters" in second


def test_remark_says_that_errors_are_weighted_where_they_are() -> None:
    plain, weighted = (remark(0.05, 10, 500, noise) for noise in (None, ()))
    assert weighted == plain.replace(
        "in validation)", "in validation, weighted by the spectrum of the noise)"
    )
