"""The state-space cell is a function of one parameter vector, for least-squares fits.

The equations are in ``slide_fmu.network.state_space.equations``, with x = 0 at the first sample.
This module has the sizes of a cell and the order of its parameters.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch

from slide_fmu.network.state_space.cell import GATED, Cell, Roles, cell_shapes
from slide_fmu.network.state_space.equations import ByRole, Equations, outputs


@dataclass(frozen=True)
class CellShape:
    """A CellShape has the sizes of a cell and the order of its parameters.

    The parameter vector is F = [A B E] row by row, then W, V, C, D and d, the last three output by
    output. Without ``bias`` the last column of W and d are omitted, so that an odd activation
    gives an odd network.

    Attributes:
        n_states: number n of states x.
        n_units: number H of hidden units h.
        n_outputs: number p of outputs.
        roles: feature indices of the state input f, the feedthrough w, the factors g of LPV units,
            the scheduling variables s and the factors r of the outputs.
        units: activation of the hidden units, one of ``CELL_ACTIVATIONS``; LPV (``gated``) units
            have a V.
        bias: whether there are constant terms.
        turned: pairs of states that LPV units see in the turned frame.
        terms: number K of terms phi_k of physical parameters p. Every weight is a sum over k of
            phi_k(p) Theta_k; the parameter vector has the K cells of coefficients one after the
            other. A plain cell has only the constant term.
        substeps: number of steps of the states in every sample.
    """

    n_states: int
    n_units: int
    n_outputs: int
    roles: Roles
    units: str = "tanh"
    bias: bool = True
    turned: int = 0
    terms: int = 1
    substeps: int = 1

    @property
    def gated(self) -> bool:
        """Whether hidden units are LPV (``gated``): scheduling variables open their gates."""
        return self.units == GATED

    @property
    def is_plain(self) -> bool:
        """Whether the cell is linear, and neither parameters nor factors change it."""
        return not (self.n_units or self.turned or self.roles.readout) and self.terms == 1

    @property
    def n_factors(self) -> int:
        """The number of factors of the values, including the constant one."""
        return 1 + len(self.roles.readout)

    @property
    def shapes(self) -> dict[str, tuple[int, ...]]:
        """The shapes of the matrices, by name."""
        rows = self.n_outputs * self.n_factors
        return cell_shapes(self.roles, self.units, self.n_states, self.n_units, rows, self.bias)

    @property
    def sizes(self) -> tuple[int, int, int, int, int, int]:
        """The numbers of parameters in F, W, V, C, D and d."""
        sizes_of_parts = {name: math.prod(shape) for name, shape in self.shapes.items()}
        w, v, c, d, d0 = (sizes_of_parts.get(name, 0) for name in ("w", "v", "c", "d", "d0"))
        return self.n_states * self.n_next, w, v, c, d, d0

    @property
    def n_next(self) -> int:
        """The length of [x, f, h], of which the next state is a linear map."""
        return self.n_states + len(self.roles.drive) + self.n_units

    @property
    def n_dynamic(self) -> int:
        """The number of parameters that the state depends on: F, W and V, which come first."""
        return sum(self.sizes[:3])

    @property
    def n_weights(self) -> int:
        """The number of weights of one cell."""
        return sum(self.sizes)

    @property
    def n_parameters(self) -> int:
        """The length of the parameter vector."""
        return self.terms * self.n_weights

    def linear(
        self, a: torch.Tensor, b: torch.Tensor, c: torch.Tensor, d: torch.Tensor | None = None
    ) -> torch.Tensor:
        """Return the parameters of x[k+1] = A x + B f, y = C x + D w without hidden units.

        A has the shape (n_states, n_states), B (n_states, n_drive), C (n_outputs, n_states), D
        (n_outputs, n_static); it is zero if it is None.
        Physical parameters have no effect: all terms but the constant one are zero.
        """
        theta = a.new_zeros(self.n_parameters)
        m = self.split(theta[: self.n_weights])
        m.a[:], m.b[:] = a, b
        m.c.view(self.n_outputs, self.n_factors, self.n_states)[:, 0] = c
        if d is not None:
            m.d.view(self.n_outputs, self.n_factors, -1)[:, 0] = d
        return theta

    @property
    def of_inputs(self) -> torch.Tensor:
        """Which parameters of a linear cell are of B, D and d, shape (n_parameters,).

        The outputs are linear in them. Of several terms or factors it is the constant one.
        """
        zero = torch.zeros(self.n_parameters, dtype=torch.float64)
        m = self.split(zero[: self.n_weights])
        m.b[:] = 1
        for part in (m.d, m.d0) if self.bias else (m.d,):
            part.view(self.n_outputs, self.n_factors, -1)[:, 0] = 1
        return zero > 0

    def split(self, theta: torch.Tensor) -> Cell:
        """Return the cell of weights, shape (n_weights,), as views of them.

        Weights of several cells, (B, n_weights), give matrices with the axis B in front.
        """
        shapes, leading = self.shapes, theta.shape[:-1]
        columns = [shapes.pop(name)[1] for name in "abe"]
        f, rest = theta[..., : self.sizes[0]], theta[..., self.sizes[0] :]
        f = f.view(*leading, self.n_states, self.n_next)
        parts = dict(zip("abe", torch.split(f, columns, -1), strict=True))
        flat = torch.split(rest, [math.prod(shape) for shape in shapes.values()], -1)
        parts |= {
            name: part.view(*leading, *shapes[name])
            for name, part in zip(shapes, flat, strict=True)
        }
        parts.setdefault("d0", theta.new_zeros(self.n_outputs * self.n_factors))
        return Cell(**parts, activation=self.units, substeps=self.substeps)

    def cells(self, theta: torch.Tensor) -> list[Cell]:
        """Return the cells of coefficients of a parameter vector, one for each term."""
        return [self.split(row) for row in theta.view(self.terms, -1)]

    def weights(self, theta: torch.Tensor, phi: torch.Tensor | None) -> torch.Tensor:
        """Return the weights for a parameter vector, shape (n_weights,).

        For cells with physical parameters, values phi of the terms, shape (B, terms), give weights
        for each, (B, n_weights).
        """
        return theta if phi is None else phi @ theta.view(self.terms, -1)

    def join(self, cell: Cell) -> torch.Tensor:
        """Return the weights of a cell: the inverse of ``split``."""
        m = cell.arrays()
        f = torch.cat([m.pop("a"), m.pop("b"), m.pop("e")], 1)
        if not self.bias:
            del m["d0"]
        return torch.cat([part.reshape(-1) for part in (f, *m.values())])


def simulate(
    shape: CellShape,
    theta: torch.Tensor,
    features: torch.Tensor,
    phi: torch.Tensor | None = None,
    initial: torch.Tensor | None = None,
) -> tuple[torch.Tensor, torch.Tensor]:
    """Run the cell at theta, (n_parameters,), over features, (samples, B, q).

    It begins at the states ``initial``, (B, n_states), or at zero.

    The samples are the first axis, so that each sample is contiguous in memory. The outputs
    (samples, B, n_outputs) and the states (samples, B, n_states) are one step after the feature of
    their row. For cells with physical parameters, phi has the values of the terms, (B, terms).
    """
    cell, inputs = shape.split(shape.weights(theta, phi)), ByRole.of(shape.roles, features)
    if initial is None:
        initial = features.new_zeros(features.shape[1], shape.n_states)
    states = Equations(cell, inputs, shape.turned, torch).run(initial)
    return outputs(cell, states, inputs), states
