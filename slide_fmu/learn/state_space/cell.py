"""The state-space cell is a function of one parameter vector here, for least-squares fits.

The equations are those of ``slide_fmu.network.state_space.equations``, with x = 0 at the first
sample; here are the sizes of a cell and the order of its parameters.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch

from slide_fmu.network.state_space.cell import GATED, Cell, Roles
from slide_fmu.network.state_space.equations import ByRole, Equations, outputs


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
        m.a[:], m.b[:] = a, b
        m.c.view(self.n_outputs, self.n_factors, self.n_states)[:, 0] = c
        return theta

    def split(self, theta: torch.Tensor) -> Cell:
        """Return the cell of a parameter vector, shape (n_parameters,): views of it."""
        f, w, v, c, d, constant = torch.split(theta, list(self.sizes))
        parts = [self.n_states, len(self.roles.drive), self.n_units]
        a, b, e = torch.split(f.view(self.n_states, self.n_next), parts, 1)
        rows = self.n_outputs * self.n_factors
        return Cell(
            a,
            b,
            e,
            w.view(self.n_units, self.n_arguments),
            c.view(rows, self.n_states),
            d.view(rows, len(self.roles.static)),
            constant if self.bias else theta.new_zeros(rows),
            self.units,
            v.view(self.n_units, self.n_products) if self.gated else None,
        )

    def join(self, cell: Cell) -> torch.Tensor:
        """Return the parameter vector of a cell; it is the inverse of ``split``."""
        m = cell.arrays()
        f = torch.cat([m.pop("a"), m.pop("b"), m.pop("e")], 1)
        if not self.bias:
            del m["d0"]
        return torch.cat([part.reshape(-1) for part in (f, *m.values())])


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
    cell, inputs = shape.split(theta), ByRole.of(shape.roles, features)
    rest = features.new_zeros(features.shape[1], shape.n_states)
    states = Equations(cell, inputs, shape.turned, torch).run(rest)
    return outputs(cell, states, inputs), states
