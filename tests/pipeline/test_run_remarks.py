"""What the report of a run remarks about the search for sizes."""

from __future__ import annotations

from typing import Any

import pytest

from slide_fmu.fitting.history import Curve
from slide_fmu.pipeline.run import _search_sections
from slide_fmu.pipeline.run_folder import Trained
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.samples import random_surrogate, sum_surrogate
from tests.fmu.small_shapes import CELLS


def size(units: int, error: float) -> dict[str, Any]:
    """A size that the search has judged."""
    found = {"order": 2, "units": units, "parameters": 9, "learnable_error": None}
    return {**found, "validation_error": error}


def remarked(surrogate: Surrogate, linear: float, remark: str | None = None) -> str | None:
    """The remark of a network with an error of 0.1, after a linear one was tried."""
    sizes = [size(0, linear), size(8, 0.12)]
    history = {"validation_error": [0.2, 0.1], "sizes": sizes, "remark": remark}
    data: dict[str, Any] = {}
    (section,) = _search_sections(Trained(surrogate, {"surrogate": history}, {}), Curve(), data)
    assert data["remark"] is None or data["remark"] in section.text
    found: str | None = data["remark"]
    return found


@pytest.fixture(scope="module")
def nonlinear() -> Surrogate:
    """One whose network has units."""
    found = random_surrogate(CELLS)
    assert not found.network.is_affine
    return found


def test_report_says_that_a_linear_network_would_do(nonlinear: Surrogate) -> None:
    remark = remarked(nonlinear, 0.11)
    assert remark is not None
    assert "a linear model would do: a linear network of order 2 errs 1.1 times" in remark
    both = remarked(nonlinear, 0.11, "more could be learnt")
    assert both == f"more could be learnt; {remark}"


def test_report_says_nothing_where_units_pay_or_the_network_is_linear(
    nonlinear: Surrogate,
) -> None:
    assert remarked(nonlinear, 0.2) is None
    assert remarked(nonlinear, 0.2, "more could be learnt") == "more could be learnt"
    assert sum_surrogate().network.is_affine
    assert remarked(sum_surrogate(), 0.1) is None
