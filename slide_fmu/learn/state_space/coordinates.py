"""A cell is rewritten so that it answers as before: other coordinates, more states, more units.

Random starts of the units need this: the units see states of unit size, and a start answers as the
linear model that it comes from.
"""

from __future__ import annotations

import math

import torch

from slide_fmu.learn.state_space.cell import CellShape, Matrices

PAD_POLE, PAD_GAIN = 0.6, 0.8
"""States that are added have this pole and this gain: short memories that no output sees yet."""
JITTER = 1e-10
"""The states' variances are raised by this part before the states are made uncorrelated."""


def rescale(shape: CellShape, m: Matrices, states: torch.Tensor, whiten: bool) -> Matrices:
    """Return the cell's matrices in coordinates in which its states have unit root mean square.

    The outputs stay the same. States of a run, shape (..., n), tell the present size; ``whiten``
    makes them uncorrelated too.

    Raises:
        ValueError: units see pairs of states in a turned frame; in other coordinates the states
            would be no pairs.
    """
    if shape.turned and shape.n_units:
        raise ValueError(
            f"cell with {shape.n_units} units and {shape.turned} turned pairs; expected none of "
            "the one or the other: rescale the states before units are added"
        )
    n = shape.n_states
    flat = states.reshape(-1, n)
    if whiten:
        # the states may be nearly dependent: unit size first, and double precision
        size = _rms(flat).double()
        unit = flat.double() / size
        covariance = unit.T @ unit / len(unit)
        covariance.diagonal().add_(JITTER)
        back = size[:, None] * torch.linalg.cholesky(covariance)
        there, back = torch.linalg.inv(back).to(flat), back.to(flat)
    else:
        size = _rms(flat)
        there, back = torch.diag(1 / size), torch.diag(size)
    f = torch.cat([there @ m.f[:, :n] @ back, there @ m.f[:, n:]], 1)
    w, v = m.w, m.v
    if v.shape[1]:  # LPV units: V sees the states, W the scheduling variables alone
        v = torch.cat([v[:, :n] @ back, v[:, n:]], 1)
    else:
        w = torch.cat([w[:, :n] @ back, w[:, n:]], 1)
    return Matrices(f, w, v, m.c @ back, m.d, m.constant)


def _rms(states: torch.Tensor) -> torch.Tensor:
    """Return the RMS of every state, shape (n,), of states (N, n).

    A state that never moves gets a small value above 0, since one divides by it.
    """
    rms = states.square().mean(0).sqrt()
    return rms.clamp_min(1e-9 * float(rms.max()) + 1e-30)


def widen(m: Matrices, old: CellShape, new: CellShape, generator: torch.Generator) -> torch.Tensor:
    """Return parameters, (new.n_parameters,), of a larger cell that answers as a smaller one.

    New states are short memories of the features that no output sees; new units have random
    arguments and act on nothing. Roles and outputs of both shapes are the same.
    """
    n, q, units = old.n_states, len(old.roles.drive), old.n_units
    f = m.f.new_zeros(new.n_states, new.n_next)
    first = new.n_states + q
    f[:n, :n], f[:n, new.n_states : first] = m.f[:, :n], m.f[:, n : n + q]
    f[:n, first : first + units] = m.f[:, n + q :]
    for state in range(n, new.n_states):
        f[state, state] = PAD_POLE
        f[state, new.n_states + (state - n) % q] = PAD_GAIN  # the features take turns
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
    """Draw normal numbers, (units, arguments); a sum over the arguments has unit variance."""
    values = torch.randn(units, arguments, generator=generator, dtype=torch.float64)
    return values / math.sqrt(max(1, arguments))
