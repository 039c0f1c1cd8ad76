"""What a run remarks about its result: sizes, accuracy, and whether more training would pay."""

from __future__ import annotations

from dataclasses import replace

import pytest

from slide_fmu.fitting.history import History, SizeTrial
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.report.quality import (
    QualityError,
    linear_size_remark,
    remark_on_error,
    remark_on_training,
    require_motion,
    require_quality,
)
from slide_fmu.report.run_figures import RunFigures
from slide_fmu.report.run_report import with_training
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation.results import Validation
from slide_fmu.validation.task import IN_RANGE
from tests.figures import run_figures
from tests.fmu.samples import random_surrogate, sum_surrogate
from tests.fmu.small_shapes import CELLS
from tests.recipes import tiny_recipe
from tests.refusals import refused

COURSE = History((4, 8, 10), (0.2, 0.1, 0.1), (0.2, 0.1, 0.1))
"""A training whose last steps brought nothing."""


def errors_of(relative_rmse: float) -> RunFigures:
    """Figures of a report with one output."""
    output = {"name": "position", "relative_rmse": relative_rmse}
    return run_figures(validation={IN_RANGE: {"outputs": [output]}})


def remarked(surrogate: Surrogate, linear: float, remark: str | None = None) -> str | None:
    """The remark of a network with an error of 0.1, after a linear one was tried."""
    sizes = SizeTrial(2, 0, 9, linear, None), SizeTrial(2, 8, 9, 0.12, None)
    histories = {"surrogate": replace(COURSE, sizes=sizes, remark=remark)}
    found = with_training(errors_of(0.01), surrogate, histories, tiny_recipe(), ())
    assert found.sizes_tried == sizes
    return found.remark


@pytest.fixture(scope="module")
def nonlinear() -> Surrogate:
    """One whose network has units."""
    found = random_surrogate(CELLS)
    assert not found.network.is_affine
    return found


def test_report_says_that_a_linear_network_would_do(nonlinear: Surrogate) -> None:
    remark = remarked(nonlinear, 0.11)
    assert remark is not None
    assert "a linear model would do: a linear network of order 2 has an error 1.1 times" in remark
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
        r"surrogate 'tiny' is not accurate enough: output 'position' has an error of 23 % on "
        r"unseen trajectories; expected at most 2 % \(validation\.require = 0\.02\): give more or "
        r"other data \(data\.train, data\.excitation\), a larger network"
    )
    with pytest.raises(QualityError, match=message):
        require_quality(requiring(0.02), errors_of(0.23))
    with refused(QualityError, "has an error of nan %"):
        require_quality(requiring(0.02), errors_of(float("nan")))
    require_quality(requiring(0.02), errors_of(0.02))
    require_quality(requiring(None), errors_of(0.23))


def test_surrogate_that_is_far_off_is_remarked_where_nothing_is_required() -> None:
    remark = remark_on_error(requiring(None), errors_of(0.23).validation)
    assert remark is not None
    assert (
        "far off on unseen trajectories: output 'position' has an error of 23 %; give more"
        in remark
    )
    assert "validation.require refuses" in remark
    assert remark_on_error(requiring(None), errors_of(0.01).validation) is None
    assert remark_on_error(requiring(0.5), errors_of(0.23).validation) is None


def course(steps: list[int], errors: list[float]) -> History:
    return History(tuple(steps), tuple(errors), tuple(errors))


def test_training_whose_validation_error_still_falls_is_remarked() -> None:
    falling = course([10, 50, 80, 100], [0.4, 0.2, 0.1, 0.08])
    remark = remark_on_training(tiny_recipe(), falling)
    assert remark == (
        "the validation error still fell by 20 % in the last fifth of the training: a longer one "
        "would pay (training.steps, now 40)"
    )
    assert remark_on_training(tiny_recipe(), COURSE) is None
    worse = course([10, 80, 100], [0.4, 0.1, 0.3])
    assert remark_on_training(tiny_recipe(), worse) is None
    assert remark_on_training(tiny_recipe(), course([0], [0.1])) is None


def test_linear_size_of_the_search_would_do_where_its_error_is_as_small() -> None:
    sizes = [
        SizeTrial(2, 0, 9, 0.3, None),
        SizeTrial(4, 0, 9, 0.11, None),
        SizeTrial(4, 8, 9, 0.1, None),
        SizeTrial(9, 0, 9, None, None),
    ]
    remark = linear_size_remark(sizes, 0.1)
    assert remark is not None
    assert "order 4 has an error 1.1 times" in remark
    assert linear_size_remark(sizes, 0.09) is None
    assert linear_size_remark([], 0.1) is None


def test_surrogate_that_predicts_a_constant_is_refused(finer: Validation) -> None:
    require_motion(finer)
    still = replace(
        finer,
        comparisons=tuple(
            replace(one, surrogate=0.019 * one.reference + 0.5) for one in finer.comparisons
        ),
    )
    words = "is not exported", "output 'position' stays near 0.5", "expected at least 2 %"
    with refused(QualityError, *words):
        require_motion(still)
    slow = [replace(one, surrogate=0.021 * one.reference) for one in finer.comparisons]
    require_motion(replace(finer, comparisons=tuple(slow)))
