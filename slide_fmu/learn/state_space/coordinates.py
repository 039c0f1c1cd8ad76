"""Cells that answer alike: states in other coordinates, more states, more units."""

from __future__ import annotations

import math

import torch

from slide_fmu.learn.state_space.cell import CellShape, Matrices

PAD_POLE, PAD_GAIN = 0.6, 0.8
"""Of states that are added: short memories of the features, which no output sees yet."""
JITTER = 1e-10
"""Added to the variances of the states, relative to them, before they are made uncorrelated."""


def rescale(shape: CellShape, m: Matrices, states: torch.Tensor, whiten: bool) -> Matrices:
    """Change the coordinates of the states to unit standard deviation.

    Args:
        m: matrices of a cell of this shape.
        states: of a run, shape (..., n).
        whiten: make them uncorrelated too.

    Raises:
        ValueError: units see pairs of states in a turned frame: in other coordinates they are no
            pairs.
    """
    if shape.turned and shape.n_units:
        raise ValueError(
            f"cell with {shape.n_units} units and {shape.turned} turned pairs; expected none of "
            "the one or the other: rescale the states before units are added"
        )
    n = shape.n_states
    flat = states.reshape(-1, n)
    if whiten:
        # of states in units of their spread, and in double precision: they may be nearly dependent
        spread = _spread(flat).double()
        unit = flat.double() / spread
        covariance = unit.T @ unit / len(unit)
        covariance.diagonal().add_(JITTER)
        back = spread[:, None] * torch.linalg.cholesky(covariance)
        there, back = torch.linalg.inv(back).to(flat), back.to(flat)
    else:
        spread = _spread(flat)
        there, back = torch.diag(1 / spread), torch.diag(spread)
    f = torch.cat([there @ m.f[:, :n] @ back, there @ m.f[:, n:]], 1)
    w, v = m.w, m.v
    if v.shape[1]:  # the units are gated: W does not see the states
        v = torch.cat([v[:, :n] @ back, v[:, n:]], 1)
    else:
        w = torch.cat([w[:, :n] @ back, w[:, n:]], 1)
    return Matrices(f, w, v, m.c @ back, m.d, m.constant)


def _spread(states: torch.Tensor) -> torch.Tensor:
    """RMS of every state, shape (n,); of one that never moves, a little."""
    spread = states.square().mean(0).sqrt()
    return spread.clamp_min(1e-9 * float(spread.max()) + 1e-30)


def widen(m: Matrices, old: CellShape, new: CellShape, generator: torch.Generator) -> torch.Tensor:
    """Parameters of a larger cell that answers exactly as a smaller one.

    New states are short memories of the features that no output sees; new units have random
    arguments and act on nothing.

    Args:
        m: matrices of the smaller cell, of shape ``old``.

    Returns:
        Shape (new.n_parameters,).
    """
    n, q, units = old.n_states, len(old.roles.drive), old.n_units
    f = m.f.new_zeros(new.n_states, new.n_next)
    first = new.n_states + q
    f[:n, :n], f[:n, new.n_states : first] = m.f[:, :n], m.f[:, n : n + q]
    f[:n, first : first + units] = m.f[:, n + q :]
    for state in range(n, new.n_states):
        f[state, state] = PAD_POLE
        f[state, new.n_states + (state - n) % q] = PAD_GAIN
    w = _random(new.n_units, new.n_arguments, generator).to(m.f)
    v = _random(new.n_units, new.n_products if new.gated else 0, generator).to(m.f)
    seeing = v if new.gated else w
    seeing[:units], source = 0, m.v if new.gated else m.w
    seeing[:units, :n], seeing[:units, new.n_states :] = source[:, :n], source[:, n:]
    if new.gated:
        w[:units] = m.w
    c = m.c.new_zeros(new.n_outputs, new.n_factors, new.n_states)
    c[:, :, :n] = m.c
    return new.join(Matrices(f, w, v, c, m.d, m.constant))


def _random(units: int, arguments: int, generator: torch.Generator) -> torch.Tensor:
    """Normal numbers, such that sums over the arguments have unit variance."""
    values = torch.randn(units, arguments, generator=generator, dtype=torch.float64)
    return values / math.sqrt(max(1, arguments))
