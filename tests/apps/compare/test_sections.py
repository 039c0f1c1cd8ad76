"""The table, the remarks and the picture of a comparison of models."""

from __future__ import annotations

import io
from typing import Any

import pytest
from PIL import Image

from slide_fmu.apps.compare.sections import (
    baseline_rows,
    baselines_report,
    error_and_cost,
    error_of,
    linear_remark,
    remark_on,
)


def model(title: str, error: float | None, linear: bool = False, **others: Any) -> dict[str, Any]:
    """The figures of a model of one output."""
    output = {
        "name": "position",
        "unit": "m",
        "rmse_over_deviation": error,
        "bounded_rmse_over_deviation": 0.031 if error is None else error,
    }
    return {
        "title": title,
        "linear": linear,
        "structure": "4 lags",
        "cut": False,
        "failed": None,
        "cpu_seconds": 2.0,
        "parameters": 9,
        "step_us": 3.0,
        "time_ratio": 2.0,
        "diverged": 0 if error is not None else 2,
        "outputs": [output],
        **others,
    }


FAILED = {
    "title": "GRU",
    "linear": False,
    "structure": "",
    "cut": False,
    "failed": "training diverged",
    "cpu_seconds": 1.0,
}
"""A model that could not be trained has no further figures."""


def figures(*models: dict[str, Any]) -> dict[str, Any]:
    """The figures of a comparison."""
    return {
        "name": "car",
        "trajectories": 7,
        "seed": 5,
        "training_seed": 0,
        "budget_s": 3.0,
        "models": list(models),
        "remark": linear_remark(models),
    }


OWN = model("own: state space", 0.02)


def test_linear_model_would_do_up_to_a_fifth_more_error() -> None:
    remark = linear_remark([OWN, model("ARX", 0.0238, linear=True), model("NARX", 0.3)])
    assert remark is not None
    assert "ARX errs 1.19 times" in remark
    assert "own: state space" in remark
    assert linear_remark([OWN, model("ARX", 0.0241, linear=True)]) is None


def test_linear_model_would_do_where_no_other_one_stays_bounded() -> None:
    remark = linear_remark([model("own", None), model("FIR", 0.5, linear=True)])
    assert remark is not None
    assert "FIR" in remark
    assert linear_remark([OWN, model("ARX", None, linear=True)]) is None
    assert linear_remark([OWN]) is linear_remark([model("FIR", 0.5, linear=True)]) is None


def test_errors_of_rounding_count_as_equal() -> None:
    remark = linear_remark([model("ARX", 5e-7, linear=True), model("NARX", 1e-15), OWN])
    assert remark is not None
    assert "ARX errs 1 times" in remark


def test_best_of_the_other_models_counts_not_the_own_one_alone() -> None:
    models = [model("own", 0.5), model("ARX", 0.1, linear=True), model("GRU", 0.05), FAILED]
    assert linear_remark(models) is None


def test_error_of_several_outputs_is_the_largest_and_without_one_infinite() -> None:
    several = model("own", 0.02)
    several["outputs"] = [*model("", 0.3)["outputs"], *several["outputs"]]
    assert error_of(several) == 0.3
    assert error_of(model("NARX", None)) == error_of(FAILED) == float("inf")


def test_divergence_is_told_with_what_is_left() -> None:
    assert remark_on(model("NARX", None, cut=True), 7) == (
        "diverged on 2 of 7 trajectories, 3.1 % off on the others; cut by the budget"
    )
    everywhere = model("NARX", None, diverged=7)
    everywhere["outputs"][0]["bounded_rmse_over_deviation"] = None
    assert remark_on(everywhere, 7) == "diverged on 7 of 7 trajectories"
    assert remark_on(OWN, 7) == ""


def test_table_has_a_row_for_every_model_also_for_one_that_failed() -> None:
    untimed = model("own: state space", 0.02, cpu_seconds=None)
    heading, own, narx, failed = baseline_rows(figures(untimed, model("NARX", None), FAILED))
    assert heading[2] == "relative RMSE of position"
    assert own == ("own: state space", "4 lags", "2 %", "9", "", "3", "2", "")
    assert narx[2] == "diverged"
    assert failed == ("GRU", "", "", "", "1", "", "", "failed: training diverged")
    assert len(heading) == len(own) == len(failed)


def test_report_shows_table_picture_and_remark() -> None:
    data = figures(OWN, model("ARX", 0.02, linear=True), model("NARX", None))
    page = baselines_report(data, "a car").html()
    assert page.count("data:image/webp;base64,") == 1
    for words in (
        "car: comparison",
        "a linear model would do: ARX",
        "diverged on 2 of 7",
        "seed 5",
    ):
        assert words in page, words


@pytest.mark.parametrize("models", [[OWN, model("NARX", None), FAILED], [model("own", None)]])
def test_picture_is_drawn_whatever_diverges(models: list[dict[str, Any]]) -> None:
    with Image.open(io.BytesIO(error_and_cost(models))) as image:
        assert image.size[0] > 900
