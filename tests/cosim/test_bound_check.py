"""The library's error bounds beside numpy: what is fine, and what is a problem."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray
from slide_fmu.cosim.bound_check import BOUND_TOLERANCE, NOVELTY_TOLERANCE, bound_problems
from slide_fmu.cosim.check import check_fmu
from slide_fmu.fmu.export import export_fmu
from slide_fmu.fmu.libraries.platforms import FmiVersion
from slide_fmu.surrogate.surrogate import Surrogate
from tests.bounded import bounded_surrogate, with_tolerances
from tests.fmu.samples import CellShape, Shape, random_surrogate
from tests.libraries import build_libraries

SHAPE = Shape(n_in=6, n_out=2, n_outputs=2, cell=CellShape())
COUNT = 120
"""Samples; the past is known from the 50th on."""


def told(surrogate: Surrogate, inputs: FloatArray) -> dict[str, FloatArray]:
    """What a library without a fault says."""
    trust = surrogate.trust(inputs)
    bounds = trust.bounds()
    return {
        "y0_error_bound": bounds[:, 0],
        "y1_error_bound": bounds[:, 1],
        "novelty": trust.novelty,
        "in_domain": trust.in_domain.astype(float),
        "trusted": trust.trusted().astype(float),
    }


@pytest.fixture
def inputs() -> FloatArray:
    return np.random.default_rng(0).uniform(-1, 2, (COUNT, 1))


@pytest.fixture
def bounded(inputs: FloatArray) -> Surrogate:
    """Half of the samples are in its domain, and the past of most is known."""
    surrogate = with_tolerances(bounded_surrogate(SHAPE), 1.65)
    assert surrogate.bound is not None
    middle = np.median(surrogate.trust(inputs).novelty) ** 2
    bound = dataclasses.replace(surrogate.bound, limits=middle * surrogate.bound.limits)
    return dataclasses.replace(surrogate, bound=bound)


def test_library_that_says_the_same_has_no_problem(bounded: Surrogate, inputs: FloatArray) -> None:
    native = told(bounded, inputs)
    native["y0_error_bound"] = native["y0_error_bound"] * (1 + 0.9 * BOUND_TOLERANCE)
    native["y1_error_bound"][:5] *= 3
    native["novelty"] = native["novelty"] * (1 + 0.9 * NOVELTY_TOLERANCE)
    assert list(bound_problems(bounded, native, inputs)) == []
    assert 0 < native["trusted"].sum() < native["in_domain"].sum() < COUNT
    assert list(bound_problems(random_surrogate(SHAPE), {}, inputs)) == []


@pytest.mark.parametrize(
    ("name", "factor", "message"),
    [
        ("y1_error_bound", 1.02, "y1_error_bound: native library and numpy differ by 0.02 of"),
        ("y0_error_bound", np.nan, "y0_error_bound: native library and numpy differ by nan"),
        ("novelty", 1.02, "novelty: native library and numpy differ by 0.02 of the value"),
        ("in_domain", 0.0, "in_domain: native library and numpy differ at "),
        ("trusted", 0.0, "trusted: native library and numpy differ at "),
    ],
)
def test_library_that_says_something_else_is_a_problem(
    bounded: Surrogate, inputs: FloatArray, name: str, factor: float, message: str
) -> None:
    native = told(bounded, inputs)
    native[name] = native[name] * factor
    (problem,) = bound_problems(bounded, native, inputs)
    assert problem.startswith(message)
    assert problem.endswith("export again")


@pytest.mark.parametrize("fmi", [2, 3])
def test_fmu_with_an_error_bound_is_fine(
    bounded: Surrogate, tmp_path: Path, fmi: FmiVersion
) -> None:
    build_libraries()
    assert check_fmu(export_fmu(bounded, tmp_path / "m.fmu", fmi=fmi)) == []
