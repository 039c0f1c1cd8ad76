"""Clipped cubes of mixed hidden units are rescaled so that they extend beyond their training
range.

A cube of a scaled argument is a scaled cube: rows of W and columns of E can be scaled against each
other without changing the response. They are scaled so that the cubes are clipped at a given
multiple of the largest argument in training. Not sooner, since the cubes are right just beyond
it; not much later, so that the cell stays bounded.
"""

from __future__ import annotations

import torch

from slide_fmu.fitting.state_space.cell import CellShape, simulate
from slide_fmu.fitting.state_space.segments import Segments
from slide_fmu.network.activations import CLIPPED
from slide_fmu.network.state_space.cell import MIXED_UNITS
from slide_fmu.network.state_space.equations import times

ROOM = 3.0
"""Multiple of the largest training argument at which cubes are clipped."""
CHUNK = 64
"""Number of segments that are run at once."""


def with_room(shape: CellShape, theta: torch.Tensor, segments: Segments) -> torch.Tensor:
    """Return parameters, (P,), of a cell with the same response on segments like these.

    Cells with other hidden units stay unchanged, and so do cubes that are clipped on the segments.
    """
    if shape.units != MIXED_UNITS or shape.n_units == 0:
        return theta
    result = theta.clone()
    peaks = torch.stack([_peaks(shape, theta, part) for part in segments.chunks(CHUNK)]).amax(0)
    usable = (peaks > 0) & (peaks < CLIPPED)
    factors = torch.where(usable, CLIPPED / (ROOM * peaks), torch.ones_like(peaks))
    for cell in shape.cells(result):  # one for each term of physical parameters
        cell.w[::2] *= factors[:, None]
        cell.e[:, ::2] /= factors**3
    return result


def _peaks(shape: CellShape, theta: torch.Tensor, segments: Segments) -> torch.Tensor:
    """Return the largest arguments of all cubes, shape (cubes,), on segments."""
    _, states = simulate(shape, theta, segments.features, segments.phi)
    before = torch.cat([torch.zeros_like(states[:1]), states[:-1]])
    seen = [before, segments.features[:, :, list(shape.roles.drive)]]
    if shape.bias:
        seen.append(torch.ones_like(before[:, :, :1]))
    w = shape.split(shape.weights(theta, segments.phi)).w
    arguments = times(torch.cat(seen, 2), w[..., ::2, :])
    peaks: torch.Tensor = arguments.abs().amax((0, 1))
    return peaks
