"""The cell of the state-space network as a function of one parameter vector.

    x[k+1] = A x[k] + B f[k] + E act(W [x[k], f[k], 1]),  y[k+1] = C x[k+1] + D f[k] + d0

with x = 0 at the first sample. ``slide_fmu.state_space`` holds the same cell as data; the class of
models is the nonlinear state space of system identification (polynomial in Paduart et al., 2010).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import torch


def _tanh(values: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    result = torch.tanh(values)
    return result, 1 - result * result


def _cubic(values: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    square = values * values
    return square * values, 3 * square


UNITS: dict[str, Callable[[torch.Tensor], tuple[torch.Tensor, torch.Tensor]]] = {
    "tanh": _tanh,
    "cubic": _cubic,
}
"""Value and derivative of the units by name."""


@dataclass(frozen=True)
class CellShape:
    """Sizes of a cell and the order of its parameters.

    The vector of parameters is F = [A B E] row by row, then W, C, D and d0. Without ``bias`` the
    last column of W and d0 are left out, and an odd activation makes an odd network.

    Attributes:
        n_states: n.
        n_features: q, inputs and their differences.
        n_units: H.
        n_outputs: p.
        units: activation, key of ``UNITS``.
        bias: whether there are constant terms.
    """

    n_states: int
    n_features: int
    n_units: int
    n_outputs: int
    units: str = "tanh"
    bias: bool = True

    @property
    def sizes(self) -> tuple[int, int, int, int, int]:
        """Numbers of parameters in F, W, C, D, d0."""
        n, q, p = self.n_states, self.n_features, self.n_outputs
        return (n * self.n_next, self.n_units * self.n_arguments, p * n, p * q, p * self.bias)

    @property
    def n_next(self) -> int:
        """Length of [x, f, act]: what the next state is a linear map of."""
        return self.n_states + self.n_features + self.n_units

    @property
    def n_arguments(self) -> int:
        """Length of [x, f, 1]: what the units see."""
        return self.n_states + self.n_features + self.bias

    @property
    def n_dynamic(self) -> int:
        """Number of parameters that the state depends on: those of F and W, the first ones."""
        return self.sizes[0] + self.sizes[1]

    @property
    def n_parameters(self) -> int:
        """Number of all parameters."""
        return sum(self.sizes)

    def split(self, theta: torch.Tensor) -> Matrices:
        """The matrices of a parameter vector, shape (n_parameters,), as views of it."""
        f, w, c, d, d0 = torch.split(theta, list(self.sizes))
        return Matrices(
            f.view(self.n_states, self.n_next),
            w.view(self.n_units, self.n_arguments),
            c.view(self.n_outputs, self.n_states),
            d.view(self.n_outputs, self.n_features),
            d0 if self.bias else theta.new_zeros(self.n_outputs),
        )

    def join(self, matrices: Matrices) -> torch.Tensor:
        """The parameter vector of matrices; the inverse of ``split``."""
        constant = [matrices.d0] if self.bias else []
        parts = (matrices.f, matrices.w, matrices.c, matrices.d, *constant)
        return torch.cat([part.reshape(-1) for part in parts])


@dataclass(frozen=True, eq=False)
class Matrices:
    """F = [A B E] (n, n + q + H), W (H, n + q + 1), C (p, n), D (p, q), d0 (p,)."""

    f: torch.Tensor
    w: torch.Tensor
    c: torch.Tensor
    d: torch.Tensor
    d0: torch.Tensor


def simulate(
    shape: CellShape, theta: torch.Tensor, features: torch.Tensor
) -> tuple[torch.Tensor, torch.Tensor]:
    """Run the cell from zero state.

    Args:
        features: shape (samples, B, n_features); the sample comes first, so that each is one
            piece of memory.

    Returns:
        Outputs (samples, B, n_outputs) and states (samples, B, n_states), each one step after
        the feature of its row.
    """
    m, n, q = shape.split(theta), shape.n_states, shape.n_features
    state = features.new_zeros(features.shape[1], n)
    states = []
    a, e = m.f[:, :n].T, m.f[:, n + q :].T
    driven = features @ m.f[:, n : n + q].T
    seen = features @ m.w[:, n : n + q].T
    if shape.bias:
        seen = seen + m.w[:, -1]
    w = m.w[:, :n].T
    for k in range(len(features)):
        units = UNITS[shape.units](torch.addmm(seen[k], state, w))[0]
        state = torch.addmm(torch.addmm(driven[k], state, a), units, e)
        states.append(state)
    stacked = torch.stack(states)
    return stacked @ m.c.T + features @ m.d.T + m.d0, stacked
