"""Clipped cubes get room beyond their training, and a cell with them answers as before."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch

from slide_fmu.fitting.state_space import cubes
from slide_fmu.fitting.state_space.cell import CellShape, simulate
from slide_fmu.fitting.state_space.cubes import ROOM, with_room
from slide_fmu.network.activations import CLIPPED
from tests.fitting.state_space.cells import plain, random_segments, random_theta

SHAPES = [plain(3, 2, 5, 1, "mixed"), plain(2, 1, 4, 2, "mixed", bias=False)]


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("size", [0.01, 1.0])
def test_cell_answers_as_before_with_cubes_clipped_beyond(shape: CellShape, size: float) -> None:
    segments = random_segments(shape, 5, 20, 70)
    theta = random_theta(shape)
    shape.split(theta).w.mul_(size)
    found = with_room(shape, theta, segments)
    for before, after in zip(
        simulate(shape, theta, segments.features),
        simulate(shape, found, segments.features),
        strict=True,
    ):
        torch.testing.assert_close(after, before)
    peaks = cubes._peaks(shape, found, segments)
    assert peaks.tolist() == pytest.approx([CLIPPED / ROOM] * len(peaks))
    assert torch.equal(shape.split(found).w[1::2], shape.split(theta).w[1::2])
    assert torch.equal(shape.split(found).e[:, 1::2], shape.split(theta).e[:, 1::2])


def test_cubes_that_are_clipped_in_the_training_stay_as_they_are() -> None:
    shape = plain(2, 1, 3, 1, "mixed")
    theta = random_theta(shape)
    shape.split(theta).w[0] *= 1e3
    shape.split(theta).e[:, 0] = 0
    found = with_room(shape, theta, random_segments(shape, 5, 20, 4))
    assert torch.equal(shape.split(found).w[0], shape.split(theta).w[0])
    assert not torch.equal(shape.split(found).w[2], shape.split(theta).w[2])


@pytest.mark.parametrize("units", ["tanh", "cubic"])
def test_cells_of_other_units_stay_as_they_are(units: str) -> None:
    shape = plain(2, 1, 3, 1, units)
    theta = random_theta(shape)
    assert torch.equal(with_room(shape, theta, random_segments(shape, 5, 20, 4)), theta)


def test_linear_cell_stays_as_it_is() -> None:
    shape = plain(2, 1, 0, 1, "mixed")
    theta = random_theta(shape)
    assert torch.equal(with_room(shape, theta, random_segments(shape, 5, 20, 4)), theta)


def test_cells_of_physical_parameters_answer_as_before() -> None:
    plain_shape = plain(3, 2, 5, 1, "mixed")
    segments = random_segments(plain_shape, 5, 20, 4)
    phi = torch.stack([torch.ones(4), torch.linspace(-1, 1, 4)], 1).double()
    theta = torch.cat([random_theta(plain_shape), 0.1 * random_theta(plain_shape, seed=1)])
    shape, segments = replace(plain_shape, terms=2), replace(segments, phi=phi)
    found = with_room(shape, theta, segments)
    before, after = (
        simulate(shape, values, segments.features, phi)[0] for values in (theta, found)
    )
    torch.testing.assert_close(after, before)
    peaks = cubes._peaks(shape, found, segments)
    assert peaks.tolist() == pytest.approx([CLIPPED / ROOM] * len(peaks))
