"""The polynomials of parameters."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slide_fmu.core.parameter_basis import MOST_TERMS, ParameterBasis
from slide_fmu.core.parameters import Parameter
from tests.refusals import refused

MASS = Parameter("mass", "kg", 1.0, 3.0, transform="log")
STIFFNESS = Parameter("stiffness", "N/m", 100.0, 300.0)


def test_basis_has_all_terms_up_to_a_total_degree() -> None:
    assert ParameterBasis.of_degree((MASS,), 2).degrees == ((0,), (1,), (2,))
    both = ParameterBasis.of_degree((MASS, STIFFNESS), 2)
    assert both.degrees == ((0, 0), (0, 1), (1, 0), (0, 2), (1, 1), (2, 0))


@given(st.floats(1, 3), st.floats(100, 300), st.integers(0, 4))
def test_terms_are_products_of_chebyshev_polynomials(m: float, k: float, degree: int) -> None:
    basis = ParameterBasis.of_degree((MASS, STIFFNESS), degree)
    z = 2 * math.log(m) / math.log(3) - 1, (k - 200) / 100
    angles = [math.acos(min(1.0, max(-1.0, value))) for value in z]
    expected = [
        math.cos(first * angles[0]) * math.cos(second * angles[1])
        for first, second in basis.degrees
    ]
    # the polynomial is known to rounding only, its angle near the ends of the range less well
    assert basis.values(np.array([m, k])) == pytest.approx(expected, abs=1e-9)


def test_many_values_are_evaluated_at_once() -> None:
    basis = ParameterBasis.of_degree((MASS, STIFFNESS), 3)
    points = np.random.default_rng(0).uniform([1, 100], [3, 300], (5, 2))
    found = basis.values(points)
    assert found.shape == (5, len(basis.degrees))
    for row, point in zip(found, points, strict=True):
        assert np.array_equal(row, basis.values(point))


def test_imaginary_parts_are_derivatives() -> None:
    basis, point, step = ParameterBasis.of_degree((MASS, STIFFNESS), 3), [1.7, 220.0], 1e-5
    for index in range(2):
        moved, either = np.array(point, np.complex128), np.array([point, point])
        moved[index] += 1e-30j
        either[0, index] += step
        either[1, index] -= step
        high, low = basis.values(either)
        expected = (high - low) / (2 * step)
        assert basis.values(moved).imag / 1e-30 == pytest.approx(expected, rel=1e-6, abs=1e-8)


@pytest.mark.parametrize(
    "degrees", [(), ((1,),), ((0,), (-1,)), ((0,), (1, 0)), ((0,),) * (MOST_TERMS + 1)]
)
def test_terms_that_are_none_of_the_parameters_are_refused(
    degrees: tuple[tuple[int, ...], ...],
) -> None:
    with refused(ValueError, "the constant one first"):
        ParameterBasis((MASS,), degrees)


@pytest.mark.parametrize("parameters", [(), (MASS, MASS)])
def test_parameters_need_names_of_their_own(parameters: tuple[Parameter, ...]) -> None:
    with refused(ValueError, "different names"):
        ParameterBasis.of_degree(parameters, 1)
