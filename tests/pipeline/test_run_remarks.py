"""What a run remarks about its result: sizes, accuracy, and whether more training would pay."""

from __future__ import annotations

from typing import Any

import pytest

from slide_fmu.fitting.history import Curve
from slide_fmu.pipeline.errors import QualityError
from slide_fmu.pipeline.measurement import IN_RANGE
from slide_fmu.pipeline.quality import (
    linear_size_remark,
    remark_on_error,
    remark_on_training,
    require_quality,
)
from slide_fmu.pipeline.run import _search_sections
from slide_fmu.pipeline.run_folder import Trained
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.samples import random_surrogate, sum_surrogate
from tests.fmu.small_shapes import CELLS
from tests.recipes import tiny_recipe


def size(units: int, error: float) -> dict[str, Any]:
    """A size that the search has judged."""
    found = {"order": 2, "units": units, "parameters": 9, "learnable_error": None}
    return {**found, "validation_error": error}


COURSE: dict[str, Any] = {"step": [4, 8, 10], "validation_error": [0.2, 0.1, 0.1]}
"""A training whose last steps brought nothing."""


def errors_of(relative_rmse: float) -> dict[str, Any]:
    """Figures of a report with one output."""
    output = {"name": "position", "relative_rmse": relative_rmse}
    return {"validation": {IN_RANGE: {"outputs": [output]}}}


def remarked(surrogate: Surrogate, linear: float, remark: str | None = None) -> str | None:
    """The remark of a network with an error of 0.1, after a linear one was tried."""
    sizes = [size(0, linear), size(8, 0.12)]
    history = {**COURSE, "sizes": sizes, "remark": remark}
    trained = Trained(surrogate, {"surrogate": history}, {})
    data = errors_of(0.01)
    (section,) = _search_sections(trained, tiny_recipe(), Curve(), data)
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


def requiring(most: float | None) -> Recipe:
    """The tiny recipe with a gate."""
    recipe = tiny_recipe()
    validation = recipe.validation.model_copy(update={"require": most})
    return recipe.model_copy(update={"validation": validation})


def test_surrogate_that_errs_by_more_than_is_required_is_refused() -> None:
    message = (
        r"surrogate 'tiny' is not accurate enough: output 'position' errs by 23 % on unseen "
        r"trajectories; expected at most 2 % \(validation\.require = 0\.02\): give more or other "
        r"data \(data\.train, data\.excitation\), a larger network"
    )
    with pytest.raises(QualityError, match=message):
        require_quality(requiring(0.02), errors_of(0.23))
    with pytest.raises(QualityError, match="errs by nan %"):
        require_quality(requiring(0.02), errors_of(float("nan")))
    require_quality(requiring(0.02), errors_of(0.02))
    require_quality(requiring(None), errors_of(0.23))


def test_surrogate_that_is_far_off_is_remarked_where_nothing_is_required() -> None:
    remark = remark_on_error(requiring(None), errors_of(0.23))
    assert remark is not None
    assert "far off on unseen trajectories: output 'position' errs by 23 %; give more" in remark
    assert "validation.require refuses" in remark
    assert remark_on_error(requiring(None), errors_of(0.01)) is None
    assert remark_on_error(requiring(0.5), errors_of(0.23)) is None


def test_training_whose_validation_error_still_falls_is_remarked() -> None:
    falling = {"step": [10, 50, 80, 100], "validation_error": [0.4, 0.2, 0.1, 0.08]}
    remark = remark_on_training(tiny_recipe(), falling)
    assert remark == (
        "the validation error still fell by 20 % in the last fifth of the training: a longer one "
        "would pay (training.steps, now 40)"
    )
    assert remark_on_training(tiny_recipe(), COURSE) is None
    worse = {"step": [10, 80, 100], "validation_error": [0.4, 0.1, 0.3]}
    assert remark_on_training(tiny_recipe(), worse) is None
    assert remark_on_training(tiny_recipe(), {"step": [0], "validation_error": [0.1]}) is None


def test_linear_size_of_the_search_would_do_where_its_error_is_as_small() -> None:
    sizes = [
        {"order": 2, "units": 0, "validation_error": 0.3},
        {"order": 4, "units": 0, "validation_error": 0.11},
        {"order": 4, "units": 8, "validation_error": 0.1},
        {"order": 9, "units": 0, "validation_error": None},
    ]
    remark = linear_size_remark(sizes, 0.1)
    assert remark is not None
    assert "order 4 errs 1.1 times" in remark
    assert linear_size_remark(sizes, 0.09) is None
    assert linear_size_remark([], 0.1) is None
