"""The cell of the state-space network as a function of one parameter vector.

    x[k+1] = A x[k] + B f[k] + T E h
    y[k+1] = sum over r in [1, r[k]] of r (C_r x[k+1] + D_r w[k] + d_r)

with x = 0 at the first sample and the units h = act(W [x, f, 1]), or gated ones,
h = tanh(W [s, 1]) * (V [T' x, g]): the next state is then linear in the state, and the schedule s
decides how. T turns the first pairs of states into the frame of the units; f, w, s, g, r are
features of the window (``slide_fmu.features``). ``network.state_space`` holds the same cell as
data; the class of models is the nonlinear state space of system identification (polynomial in
Paduart et al., 2010), with gated units a linear parameter-varying one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields

import torch

from slide_fmu.network.state_space.roles import Roles


def _tanh(values: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    result = torch.tanh(values)
    return result, 1 - result * result


def _cubic(values: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    square = values * values
    return square * values, 3 * square


ACTIVATIONS: dict[str, Callable[[torch.Tensor], tuple[torch.Tensor, torch.Tensor]]] = {
    "tanh": _tanh,
    "cubic": _cubic,
    "gated": _tanh,
}
"""Value and derivative of the units' activation by name."""


@dataclass(frozen=True)
class CellShape:
    """Sizes of a cell and the order of its parameters.

    The vector of parameters is F = [A B E] row by row, then W, V, C, D and d, the last three
    output by output. Without ``bias`` the last column of W and d are left out, and an odd
    activation makes an odd network.

    Attributes:
        n_states: n.
        n_units: H.
        n_outputs: p.
        roles: indices of f, w, g, s, r among the features.
        units: key of ``ACTIVATIONS``; ``gated`` units have a V.
        bias: whether there are constant terms.
        turned: pairs of states that gated units see in the turned frame.
    """

    n_states: int
    n_units: int
    n_outputs: int
    roles: Roles
    units: str = "tanh"
    bias: bool = True
    turned: int = 0

    @property
    def gated(self) -> bool:
        """Whether the units are gated."""
        return self.units == "gated"

    @property
    def n_factors(self) -> int:
        """Number of factors of the values, the constant one among them."""
        return 1 + len(self.roles.readout)

    @property
    def sizes(self) -> tuple[int, int, int, int, int, int]:
        """Numbers of parameters in F, W, V, C, D, d."""
        n, p, factors = self.n_states, self.n_outputs, self.n_factors
        products = self.n_units * self.n_products if self.gated else 0
        return (
            n * self.n_next,
            self.n_units * self.n_arguments,
            products,
            p * factors * n,
            p * factors * len(self.roles.static),
            p * factors * self.bias,
        )

    @property
    def n_next(self) -> int:
        """Length of [x, f, h]: what the next state is a linear map of."""
        return self.n_states + len(self.roles.drive) + self.n_units

    @property
    def n_arguments(self) -> int:
        """Length of what the activation sees: [x, f, 1], of gated units [s, 1]."""
        seen = self.roles.schedule if self.gated else (*range(self.n_states), *self.roles.drive)
        return len(seen) + self.bias

    @property
    def n_products(self) -> int:
        """Length of [x, g]: what gated units multiply."""
        return self.n_states + len(self.roles.gated)

    @property
    def n_dynamic(self) -> int:
        """Number of parameters that the state depends on: those of F, W and V, the first ones."""
        return sum(self.sizes[:3])

    @property
    def n_parameters(self) -> int:
        """Number of all parameters."""
        return sum(self.sizes)

    def linear(self, a: torch.Tensor, b: torch.Tensor, c: torch.Tensor) -> torch.Tensor:
        """Parameters of the linear model x[k+1] = A x + B f, y = C x; for a shape without units.

        Args:
            a: shape (n_states, n_states).
            b: shape (n_states, n_drive).
            c: shape (n_outputs, n_states).
        """
        theta = a.new_zeros(self.n_parameters)
        m = self.split(theta)
        m.f[:] = torch.cat([a, b], 1)
        m.c[:, 0] = c
        return theta

    def split(self, theta: torch.Tensor) -> Matrices:
        """The matrices of a parameter vector, shape (n_parameters,), as views of it."""
        f, w, v, c, d, constant = torch.split(theta, list(self.sizes))
        p, factors = self.n_outputs, self.n_factors
        products = self.n_products if self.gated else 0
        return Matrices(
            f.view(self.n_states, self.n_next),
            w.view(self.n_units, self.n_arguments),
            v.view(self.n_units, products),
            c.view(p, factors, self.n_states),
            d.view(p, factors, len(self.roles.static)),
            constant.view(p, factors) if self.bias else theta.new_zeros(p, factors),
        )

    def join(self, matrices: Matrices) -> torch.Tensor:
        """The parameter vector of matrices; the inverse of ``split``."""
        m = matrices
        parts = [m.f, m.w, m.v, m.c, m.d, *([m.constant] if self.bias else [])]
        return torch.cat([part.reshape(-1) for part in parts])


@dataclass(frozen=True, eq=False)
class Matrices:
    """F = [A B E] (n, n + q + H), W (H, ...), V (H, ...), C (p, R, n), D (p, R, m), d (p, R)."""

    f: torch.Tensor
    w: torch.Tensor
    v: torch.Tensor
    c: torch.Tensor
    d: torch.Tensor
    constant: torch.Tensor


@dataclass(frozen=True, eq=False)
class Sequences:
    """Features along sequences by their roles; the sample first, then the sequence.

    Attributes:
        drive: f, shape (N, B, q).
        static: w, shape (N, B, m).
        arguments: of the activation apart from x: [f, 1], of gated units [s, 1].
        gated: g.
        factors: [1, r], shape (N, B, R).
        turn: cosine and sine, shape (N, B, 2), or (N, B, 0).
    """

    drive: torch.Tensor
    static: torch.Tensor
    arguments: torch.Tensor
    gated: torch.Tensor
    factors: torch.Tensor
    turn: torch.Tensor

    @staticmethod
    def of(shape: CellShape, features: torch.Tensor) -> Sequences:
        """From all features, shape (N, B, n_signals)."""
        roles, one = shape.roles, features.new_ones(*features.shape[:2], 1)

        def chosen(indices: tuple[int, ...]) -> torch.Tensor:
            whole = indices == tuple(range(features.shape[2]))
            return features if whole else features[:, :, list(indices)]

        drive = chosen(roles.drive)
        seen = chosen(roles.schedule) if shape.gated else drive
        return Sequences(
            drive,
            drive if roles.static == roles.drive else chosen(roles.static),
            torch.cat([seen, one], 2) if shape.bias else seen,
            chosen(roles.gated),
            torch.cat([one, chosen(roles.readout)], 2) if roles.readout else one,
            chosen(roles.turn),
        )

    def chosen(self, samples: slice) -> Sequences:
        """A stretch of the samples."""
        parts = (getattr(self, field.name)[samples] for field in fields(self))
        return Sequences(*parts)


def turned(vectors: torch.Tensor, turn: torch.Tensor, pairs: int) -> torch.Tensor:
    """Vectors whose first pairs are turned by an angle.

    Args:
        vectors: shape (B, n).
        turn: cosine and sine of the angle, shape (B, 2).
        pairs: number of pairs; none leaves the vectors as they are.
    """
    if pairs == 0:
        return vectors
    first = vectors[:, : 2 * pairs].reshape(-1, pairs, 2)
    c, s = turn[:, :1], turn[:, 1:]
    x, y = first[:, :, 0], first[:, :, 1]
    moved = torch.stack([c * x - s * y, s * x + c * y], 2).flatten(1)
    return torch.cat([moved, vectors[:, 2 * pairs :]], 1)


def opposite(turn: torch.Tensor) -> torch.Tensor:
    """The turn by the opposite angle."""
    return torch.cat([turn[..., :1], -turn[..., 1:]], -1)


def simulate(
    shape: CellShape, theta: torch.Tensor, features: torch.Tensor
) -> tuple[torch.Tensor, torch.Tensor]:
    """Run the cell from zero state.

    Args:
        features: shape (samples, B, n_signals); the sample comes first, so that each is one
            piece of memory.

    Returns:
        Outputs (samples, B, n_outputs) and states (samples, B, n_states), each one step after
        the feature of its row.
    """
    m, sequences = shape.split(theta), Sequences.of(shape, features)
    run = _run_gated if shape.gated else _run_plain
    states = run(shape, m, sequences)
    return values(m, states, sequences), states


def values(m: Matrices, states: torch.Tensor, sequences: Sequences) -> torch.Tensor:
    """Outputs (N, B, p) of states (N, B, n), one step after the features."""
    p, factors, n = m.c.shape
    parts = states @ m.c.view(-1, n).T + sequences.static @ m.d.view(p * factors, -1).T
    parts = parts + m.constant.reshape(-1)
    if factors > 1:
        shares = parts.view(*parts.shape[:2], p, factors)
        parts = (shares * sequences.factors[:, :, None]).sum(3)
    return parts


def _run_plain(shape: CellShape, m: Matrices, sequences: Sequences) -> torch.Tensor:
    n, q = shape.n_states, len(shape.roles.drive)
    a, e = m.f[:, :n].T, m.f[:, n + q :].T
    driven = sequences.drive @ m.f[:, n : n + q].T
    seen = sequences.arguments @ m.w[:, n:].T
    w, act = m.w[:, :n].T, ACTIVATIONS[shape.units]
    state, states = driven.new_zeros(driven.shape[1], n), []
    for k in range(len(driven)):
        units = act(torch.addmm(seen[k], state, w))[0]
        state = torch.addmm(torch.addmm(driven[k], state, a), units, e)
        states.append(state)
    return torch.stack(states)


def _run_gated(shape: CellShape, m: Matrices, sequences: Sequences) -> torch.Tensor:
    n, q = shape.n_states, len(shape.roles.drive)
    a, e, v = m.f[:, :n].T, m.f[:, n + q :].T, m.v[:, :n].T
    driven = sequences.drive @ m.f[:, n : n + q].T
    gates = torch.tanh(sequences.arguments @ m.w.T)
    offered = sequences.gated @ m.v[:, n:].T
    back = opposite(sequences.turn)
    state, states = driven.new_zeros(driven.shape[1], n), []
    for k in range(len(driven)):
        seen = turned(state, back[k], shape.turned)
        units = gates[k] * torch.addmm(offered[k], seen, v)
        moved = turned(units @ e, sequences.turn[k], shape.turned)
        state = torch.addmm(driven[k], state, a) + moved
        states.append(state)
    return torch.stack(states)
