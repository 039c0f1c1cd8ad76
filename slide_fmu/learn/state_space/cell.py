"""The cell of the state-space network as a function of one parameter vector.

The equations are those of ``slide_fmu.network.state_space.equations``, with x = 0 at the first
sample; here are the sizes of a cell and the order of its parameters.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch

from slide_fmu.network.state_space.equations import GATED, ByRole, Equations, Weights, outputs
from slide_fmu.network.state_space.roles import Roles


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
        units: one of ``CELL_ACTIVATIONS``; ``gated`` units have a V.
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
        return self.units == GATED

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

    def weights(self, shape: CellShape) -> Weights:
        """The matrices by name, as views."""
        n, q, arguments = shape.n_states, len(shape.roles.drive), self.w
        w_1 = None
        if shape.bias:
            arguments, w_1 = self.w[:, :-1], self.w[:, -1]
        return Weights(
            a=self.f[:, :n],
            b=self.f[:, n : n + q],
            e=self.f[:, n + q :],
            w_x=None if shape.gated else arguments[:, :n],
            w_f=arguments if shape.gated else arguments[:, n:],
            w_1=w_1,
            v_x=self.v[:, :n] if shape.gated else None,
            v_g=self.v[:, n:] if shape.gated else None,
            c=self.c.flatten(0, 1),
            d=self.d.flatten(0, 1),
            d0=self.constant.flatten(),
            units=shape.units,
            turned=shape.turned,
        )


def simulate(
    shape: CellShape, theta: torch.Tensor, features: torch.Tensor
) -> tuple[torch.Tensor, torch.Tensor]:
    """Run the cell from zero state.

    Args:
        shape: sizes of the cell, and what its features are for.
        theta: shape (n_parameters,).
        features: shape (samples, B, n_signals); the sample comes first, so that each is one
            piece of memory.

    Returns:
        Outputs (samples, B, n_outputs) and states (samples, B, n_states), each one step after
        the feature of its row.
    """
    weights, inputs = shape.split(theta).weights(shape), ByRole.of(shape.roles, features)
    rest = features.new_zeros(features.shape[1], shape.n_states)
    states = Equations(weights, inputs, torch).run(rest)
    return outputs(weights, states, inputs), states
