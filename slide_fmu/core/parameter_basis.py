"""Network weights are polynomials of physical parameters; this is their basis."""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from itertools import product
from operator import mul
from typing import Any

import numpy as np

from slide_fmu.core.parameters import Parameter

MOST_TERMS = 64
"""Largest number of polynomials; protects against damaged files."""


@dataclass(frozen=True)
class ParameterBasis:
    """A ParameterBasis has products of Chebyshev polynomials in the scaled parameters.

    A weight is theta(p) = sum over k of phi_k(p) Theta_k, with phi_k(p) the product over the
    parameters i of T_e(z_i), e the degree of term k in parameter i, and z_i the parameter's
    transform, scaled to -1 .. 1 over its range. The first term is the constant 1.

    Attributes:
        parameters: at least one, in the order of the values.
        degrees: for every term, the degree in each parameter.

    Raises:
        ValueError: there are no parameters, two have the same name, or the terms are not valid.
    """

    parameters: tuple[Parameter, ...]
    degrees: tuple[tuple[int, ...], ...]

    def __post_init__(self) -> None:
        names = [parameter.name for parameter in self.parameters]
        if not names or len(set(names)) < len(names):
            raise ValueError(f"parameters {names}; expected at least one, of different names")
        count = len(names)
        whole = all(len(row) == count and min(row) >= 0 for row in self.degrees)
        if not (whole and 1 <= len(self.degrees) <= MOST_TERMS and not any(self.degrees[0])):
            raise ValueError(
                f"terms of degrees {self.degrees}; expected 1 to {MOST_TERMS}, each with a degree "
                f"in {count} parameters, and the constant one first"
            )

    @staticmethod
    def of_degree(parameters: tuple[Parameter, ...], degree: int) -> ParameterBasis:
        """Return the basis of all terms up to a total degree, in rising order of degree."""
        every = product(range(degree + 1), repeat=len(parameters))
        low = [row for row in every if sum(row) <= degree]
        return ParameterBasis(parameters, tuple(sorted(low, key=lambda row: (sum(row), row))))

    def values(self, parameters: Any) -> Any:
        """Evaluate all terms: parameters in their units, (..., n_parameters), to (..., n_terms).

        Complex values are allowed: their imaginary parts carry derivatives.
        """
        scaled = [
            parameter.scaled(parameters[..., index])
            for index, parameter in enumerate(self.parameters)
        ]
        most = max(max(row) for row in self.degrees)
        powers = [_chebyshev(z, most) for z in scaled]
        terms = [reduce(mul, (powers[i][e] for i, e in enumerate(row))) for row in self.degrees]
        return np.stack(terms, axis=-1)


def _chebyshev(z: Any, most: int) -> list[Any]:
    """Return the polynomials of degree 0 to ``most`` (at least 1) at z, each of its shape."""
    polynomials = [np.ones_like(z), z]
    while len(polynomials) <= most:
        polynomials.append(2 * z * polynomials[-1] - polynomials[-2])
    return polynomials
