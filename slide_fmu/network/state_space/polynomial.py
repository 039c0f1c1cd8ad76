"""The weights of a cell can be polynomials of physical parameters.

The parameters are constant along a run, or change now and then. The weights are formed once for
their values; then the cell is a plain one (``cell.py``), at the same cost per step. The C
runtime forms them too (``slide_fmu/fmu/runtime/network/parameters.c``).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.parameter_basis import ParameterBasis
from slide_fmu.core.signals import FloatArray
from slide_fmu.network.state_space.cell import Cell


@dataclass(frozen=True, eq=False)
class CellPolynomial:
    """A CellPolynomial gives a cell for every value of the parameters.

    Attributes:
        basis: the polynomials phi_k, K of them.
        terms: Theta_k, one cell of coefficients for each, of equal shapes, float32.

    Raises:
        ValueError: the number of cells is not the number of terms, or their shapes differ.
    """

    basis: ParameterBasis
    terms: tuple[Cell, ...]

    def __post_init__(self) -> None:
        if len(self.terms) != len(self.basis.degrees):
            raise ValueError(
                f"cells of {len(self.terms)} terms; expected {len(self.basis.degrees)}, one for "
                "each term of the parameters' polynomials"
            )
        shapes = [
            (
                cell.activation,
                cell.substeps,
                {name: part.shape for name, part in cell.arrays().items()},
            )
            for cell in self.terms
        ]
        if any(shape != shapes[0] for shape in shapes):
            raise ValueError(
                f"cells of the terms have the shapes {shapes}; expected the same for all"
            )

    def at(self, parameters: FloatArray) -> Cell:
        """Form the cell for parameters in their units, (n_parameters,), in float32."""
        parts = {name: part.astype(np.float32) for name, part in self.formed(parameters).items()}
        return self.terms[0].with_arrays(parts)

    def starting_at(self, parameters: FloatArray) -> CellPolynomial:
        """Return the same polynomials, of parameters with other start values, (n_parameters,)."""
        started = tuple(
            replace(parameter, start=float(value))
            for parameter, value in zip(self.basis.parameters, parameters, strict=True)
        )
        return replace(self, basis=replace(self.basis, parameters=started))

    def complex_at(self, parameters: NDArray[np.complex128]) -> Cell:
        """Form the cell for complex parameters, (n_parameters,), in complex128."""
        return self.terms[0].with_arrays(self.formed(parameters))

    def formed(self, parameters: NDArray[Any]) -> dict[str, NDArray[Any]]:
        """Return the weights by name; the terms are summed one by one in double precision."""
        phi = self.basis.values(parameters)
        coefficients = [cell.arrays() for cell in self.terms]
        return {
            name: sum(
                value * part[name].astype(np.float64)
                for value, part in zip(phi, coefficients, strict=True)
            )
            for name in coefficients[0]
        }
