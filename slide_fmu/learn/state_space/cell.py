"""The state-space cell is a function of one parameter vector here, for least-squares fits.

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
    """A cell's shape is its sizes and the order of its parameters.

    The vector of parameters is F = [A B E] row by row, then W, V, C, D and d, the last three
    output by output. Without ``bias`` the last column of W and d are left out, and an odd
    activation makes an odd network.

    Attributes:
        n_states: number n of states x.
        n_units: number H of units h.
        n_outputs: number p of outputs.
        roles: indices of the state input f, the feedthrough w, what LPV units multiply (g), the
            scheduling variables s and the factors r of the outputs among the features.
        units: activation of the units, one of ``CELL_ACTIVATIONS``; LPV (``gated``) units have a
            V.
        bias: whether there are constant terms.
        turned: pairs of states that LPV units see in the turned frame.
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
        """LPV units (``gated`` in recipes) have gates that scheduling variables open and close."""
        return self.units == GATED

    @property
    def n_factors(self) -> int:
        """There are this many factors of the values, the constant one among them."""
        return 1 + len(self.roles.readout)

    @property
    def sizes(self) -> tuple[int, int, int, int, int, int]:
        """The parts F, W, V, C, D and d have these numbers of parameters."""
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
        """The next state is a linear map of [x, f, h], which has this length."""
        return self.n_states + len(self.roles.drive) + self.n_units

    @property
    def n_arguments(self) -> int:
        """The activation sees [x, f, 1], or [s, 1] in LPV units, which has this length."""
        seen = self.roles.schedule if self.gated else (*range(self.n_states), *self.roles.drive)
        return len(seen) + self.bias

    @property
    def n_products(self) -> int:
        """LPV units multiply [x, g], which has this length."""
        return self.n_states + len(self.roles.gated)

    @property
    def n_dynamic(self) -> int:
        """The state depends on this many parameters: those of F, W and V, the first ones."""
        return sum(self.sizes[:3])

    @property
    def n_parameters(self) -> int:
        """The parameter vector has this length."""
        return sum(self.sizes)

    def linear(self, a: torch.Tensor, b: torch.Tensor, c: torch.Tensor) -> torch.Tensor:
        """Return the parameters of x[k+1] = A x + B f, y = C x for a shape without units.

        A has the shape (n_states, n_states), B (n_states, n_drive), C (n_outputs, n_states).
        """
        theta = a.new_zeros(self.n_parameters)
        m = self.split(theta)
        m.f[:] = torch.cat([a, b], 1)
        m.c[:, 0] = c
        return theta

    def split(self, theta: torch.Tensor) -> Matrices:
        """Return the matrices of a parameter vector, shape (n_parameters,), as views of it."""
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
        """Return the parameter vector of matrices; it is the inverse of ``split``."""
        m = matrices
        parts = [m.f, m.w, m.v, m.c, m.d, *([m.constant] if self.bias else [])]
        return torch.cat([part.reshape(-1) for part in parts])


@dataclass(frozen=True, eq=False)
class Matrices:
    """Matrices are a parameter vector in parts, with R factors and m feedthrough features.

    F = [A B E] is (n, n + q + H), W (H, ...), V (H, ...), C (p, R, n), D (p, R, m), d (p, R).
    """

    f: torch.Tensor
    w: torch.Tensor
    v: torch.Tensor
    c: torch.Tensor
    d: torch.Tensor
    constant: torch.Tensor

    def weights(self, shape: CellShape) -> Weights:
        """Return the matrices by their names in the equations, as views."""
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
    """Run the cell from zero state over features (samples, B, n_signals).

    The sample comes first, so that each is one piece of memory. Theta has the shape
    (n_parameters,).

    Returns:
        Outputs (samples, B, n_outputs) and states (samples, B, n_states), each one step after the
        feature of its row.
    """
    weights, inputs = shape.split(theta).weights(shape), ByRole.of(shape.roles, features)
    rest = features.new_zeros(features.shape[1], shape.n_states)
    states = Equations(weights, inputs, torch).run(rest)
    return outputs(weights, states, inputs), states
