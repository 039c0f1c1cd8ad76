"""The doubt about held inputs between samples is that of the slowest period in samples."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from slide_fmu.bounds.held_doubt import MARGIN, MOST, doubt_of
from slide_fmu.fmu.export import read_fmu
from slide_fmu.network.state_space.network import StateSpace
from tests.fmu.samples import CellShape, Shape, random_surrogate

FMUS = Path(__file__).parents[2] / "fmus"


def network_of(name: str) -> StateSpace:
    network = read_fmu(FMUS / name / f"{name}.fmu")[0].network
    assert isinstance(network, StateSpace)
    return network


@pytest.mark.parametrize(("name", "step"), [("linear", 1 / 64), ("linear_10ms", 0.01)])
def test_doubt_of_one_oscillation_follows_from_how_far_it_turns_in_a_sample(
    name: str, step: float
) -> None:
    """m = 1 kg, d = 8 N s/m, k = 1600 N/m: each difference of it has a factor of z - 1."""
    pole = np.exp(complex(-4.0, np.sqrt(1600.0 - 16.0)) * step)
    ratio = abs(pole - 1)
    assert doubt_of(network_of(name)) == pytest.approx(MARGIN * ratio / (1 - ratio), rel=0.15)


def test_released_bounds_have_the_doubt_of_their_companions() -> None:
    for name, most in (("duffing", True), ("duffing_10ms", False)):
        bound = read_fmu(FMUS / name / f"{name}.fmu")[0].bound
        assert bound is not None
        assert bound.doubt == pytest.approx(doubt_of(bound.companion), rel=0.01)
        assert (bound.doubt == MOST) == most


def test_doubt_has_a_most_and_is_zero_without_a_response() -> None:
    shape = Shape(n_inputs=2, n_outputs=2, cell=CellShape())
    network = random_surrogate(shape).network
    assert isinstance(network, StateSpace)
    assert 0 < doubt_of(network) <= MOST
    arrays = {name: np.zeros_like(part) for name, part in network.cell.arrays().items()}
    silent = StateSpace(
        network.cell.with_arrays(arrays),
        network.n_samples,
        network.n_out,
        network.features,
        network.roles,
        network.turned,
    )
    assert doubt_of(silent) == 0
