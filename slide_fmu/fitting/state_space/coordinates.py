"""A cell is rewritten with the same response: other coordinates, more states, wider layers.

Random starts of the hidden units need this: their states have an RMS of one, and a start has the
response of its linear model.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy.linalg
import torch

from slide_fmu.fitting.state_space.cell import CellShape, simulate
from slide_fmu.fitting.state_space.segments import Segments
from slide_fmu.network.state_space.cell import MIXED_UNITS, Cell

PAD_POLE, PAD_GAIN = 0.6, 0.8
"""Pole and gain of states that are added: they forget fast, and no output uses them yet."""
JITTER = 1e-10
"""Relative increase of the states' variances before the states are made uncorrelated, and smallest
size of a balanced state relative to the largest."""
HORIZON = 1000
"""Number of samples over which a state adds to later outputs."""
SMALL_ARGUMENTS = 1 / 8
"""Size of the arguments of clipped cubes at the start, far below the clipping limit."""


def rescale(shape: CellShape, cell: Cell, states: torch.Tensor, whiten: bool) -> Cell:
    """Return the cell in coordinates in which its states have a root mean square of one.

    The outputs stay the same. States of a run, shape (..., n), give the present size; ``whiten``
    also makes them uncorrelated.

    Raises:
        ValueError: hidden units see pairs of states in a turned frame; other coordinates would
            destroy the pairs.
    """
    if shape.turned and shape.n_units:
        raise ValueError(
            f"cell with {shape.n_units} units and {shape.turned} turned pairs; expected none of "
            "the one or the other: rescale the states before units are added"
        )
    n = shape.n_states
    flat = states.reshape(-1, n)
    if whiten:
        # the states may be nearly dependent: scale first, and use double precision
        size = _rms(flat).double()
        unit = flat.double() / size
        covariance = unit.T @ unit / len(unit)
        covariance.diagonal().add_(JITTER)
        back = size[:, None] * torch.linalg.cholesky(covariance)
        there, back = torch.linalg.inv(back).to(flat), back.to(flat)
    else:
        size = _rms(flat)
        there, back = torch.diag(1 / size), torch.diag(size)
    a, b, e = there @ cell.a @ back, there @ cell.b, there @ cell.e
    # states enter plain units by W and LPV units by V; scheduling variables enter LPV units by W
    seeing = "w" if cell.v is None else "v"
    seen = cell.arrays()[seeing]
    moved = {seeing: torch.cat([seen[:, :n] @ back, seen[:, n:]], 1)}
    return cell.with_arrays({"a": a, "b": b, "e": e, "c": cell.c @ back, **moved})


def balanced(shape: CellShape, theta: torch.Tensor, segments: Segments) -> torch.Tensor:
    """Return the parameters, (P,), of a linear cell in balanced coordinates.

    Its states over the segments are uncorrelated there, and each adds as much to later outputs as
    it moves (Moore, "Principal component analysis in linear systems", IEEE Transactions on
    Automatic Control 26, 1981). In other coordinates large states may cancel in the outputs: these
    magnify rounding, and so do hidden units that see them. A cell whose states grow beyond all
    numbers, or do nothing, keeps its coordinates.
    """
    double = theta.double().cpu()
    cell, features = shape.split(double), segments.features.double().cpu()
    _, states = simulate(shape, double, features)
    flat = states.reshape(-1, shape.n_states)
    if not torch.isfinite(flat).all():
        return theta
    moved = torch.linalg.qr(flat / math.sqrt(len(flat)), mode="r").R
    seen = [cell.c]
    while len(seen) < HORIZON:
        seen.append(seen[-1] @ cell.a)
    shown = torch.linalg.qr(torch.cat(seen), mode="r").R
    left, sizes, right = torch.linalg.svd(shown @ moved.T)
    if not float(sizes[0]) > 0:
        return theta
    root = sizes.clamp_min(JITTER * float(sizes[0])).sqrt()
    there, back = (left / root).T @ shown, moved.T @ (right.T / root)
    m = replace(cell, a=there @ cell.a @ back, b=there @ cell.b, c=cell.c @ back)
    return shape.join(m).to(theta)


def _rms(states: torch.Tensor) -> torch.Tensor:
    """Return the RMS of every state, shape (n,), from states (N, n).

    A state that never moves gets a small value above 0, since it is a divisor.
    """
    rms = states.square().mean(0).sqrt()
    return rms.clamp_min(1e-9 * float(rms.max()) + 1e-30)


def in_substeps(cells: Sequence[Cell], substeps: int) -> list[Cell]:
    """Return linear cells, one for each term, whose response in several steps equals that in one.

    A is a power of the new A, and B the sum of the features' contributions over all steps. In the
    terms of physical parameters A and B are 0: at the start these have no effect.

    Raises:
        ValueError: a pole changes its sign in every sample, so that no real A has this power.
    """
    if substeps == 1:
        return list(cells)
    first, *others = cells
    power = scipy.linalg.fractional_matrix_power(first.a.double().numpy(), 1 / substeps)
    root = torch.from_numpy(np.real(power).copy())
    if not torch.allclose(torch.linalg.matrix_power(root, substeps), first.a.double(), atol=1e-6):
        poles = torch.linalg.eigvals(first.a.double()).numpy()
        raise ValueError(
            f"network.substeps = {substeps} with the poles {np.round(poles, 3)}; expected none "
            "near the negative axis: choose 1 sub-step, or a shorter window.step"
        )
    together = sum(torch.linalg.matrix_power(root, step) for step in range(substeps))
    b = torch.linalg.solve(together, first.b.double())
    still = [replace(cell, a=0 * cell.a, b=0 * cell.b, substeps=substeps) for cell in others]
    return [replace(first, a=root.to(first.a), b=b.to(first.b), substeps=substeps), *still]


def widen_all(cells: Sequence[Cell], new: CellShape, generator: torch.Generator) -> torch.Tensor:
    """Return parameters, (new.n_parameters,), from one cell for each term.

    The first cell is widened. In the terms of physical parameters new entries are 0, so these have
    no effect on them.
    """
    others = [widen(cell, new, None) for cell in cells[1:]]
    return torch.cat([widen(cells[0], new, generator), *others])


def widen(cell: Cell, new: CellShape, generator: torch.Generator | None) -> torch.Tensor:
    """Return the weights, (new.n_weights,), of a larger cell with the response of a smaller one.

    New states forget fast, and no output uses them; new hidden units have random arguments and no
    effect. Roles and outputs of both cells are the same. Without a generator, new entries are 0.
    """
    (n, q), units, wide = cell.b.shape, len(cell.w), new.n_states
    a, b, e = (cell.a.new_zeros(wide, columns) for columns in (wide, q, new.n_units))
    a[:n, :n], b[:n], e[:n, :units] = cell.a, cell.b, cell.e
    for state in range(n, wide) if generator else ():
        a[state, state] = PAD_POLE
        b[state, (state - n) % q] = PAD_GAIN  # the features alternate
    w = random_arguments(new.shapes["w"], generator).to(a)
    v = random_arguments(new.shapes["v"], generator).to(a) if new.gated else None
    if new.units == MIXED_UNITS:
        w[::2] *= SMALL_ARGUMENTS
    seeing, source = w if v is None else v, cell.arrays()["w" if v is None else "v"]
    seeing[:units], seeing[:units, :n] = 0, source[:, :n]
    seeing[:units, wide:] = source[:, n:]
    if new.gated:
        w[:units] = cell.w
    c = cell.c.new_zeros(len(cell.c), wide)
    c[:, :n] = cell.c
    return new.join(Cell(a, b, e, w, c, cell.d, cell.d0, new.units, v))


def random_arguments(shape: tuple[int, ...], generator: torch.Generator | None) -> torch.Tensor:
    """Draw normal numbers, (hidden units, arguments); a sum over the arguments has the variance 1.

    Without a generator they are 0.
    """
    if generator is None:
        return torch.zeros(*shape, dtype=torch.float64)
    values = torch.randn(*shape, generator=generator, dtype=torch.float64)
    return values / math.sqrt(max(1, shape[1]))
