"""The table, the remarks and the charts of a comparison of models."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from slide_fmu.apps.compare.model_figures import ComparisonFigures, ModelFigures, ModelOutput
from slide_fmu.apps.compare.sections import (
    baselines_report,
    error_charts,
    linear_remark,
    model_table,
    remark_on,
)


def model(title: str, error: float | None, linear: bool = False, **others: Any) -> ModelFigures:
    """The figures of a model of one output."""
    output = ModelOutput(
        name="position",
        unit="m",
        rmse_over_deviation=error,
        bounded_rmse_over_deviation=0.031 if error is None else error,
    )
    found = ModelFigures(
        title=title,
        linear=linear,
        structure="4 lags",
        cpu_seconds=2.0,
        parameters=9,
        diverged=0 if error is not None else 2,
        outputs=(output,),
        step_us=3.0,
        time_ratio=2.0,
    )
    return replace(found, **others)


FAILED = ModelFigures(
    title="GRU", linear=False, structure="", failed="training diverged", cpu_seconds=1.0
)
"""A model that could not be trained has no further figures."""


def figures(*models: ModelFigures) -> ComparisonFigures:
    """The figures of a comparison."""
    return ComparisonFigures(
        name="car",
        trajectories=7,
        budget_s=3.0,
        seed=5,
        training_seed=0,
        models=models,
        remark=linear_remark(models),
    )


OWN = model("own: state space", 0.02)


def test_linear_model_would_do_up_to_a_fifth_more_error() -> None:
    remark = linear_remark([OWN, model("ARX", 0.0238, linear=True), model("NARX", 0.3)])
    assert remark is not None
    assert "ARX has 1.19 times the error" in remark
    assert "own: state space" in remark
    assert linear_remark([OWN, model("ARX", 0.0241, linear=True)]) is None


def test_linear_model_would_do_names_networks_that_a_larger_budget_may_improve() -> None:
    early = model("GRU", 0.03, validation_error=0.02, error_half_way=0.03, cut=True)
    ended = model("own", 0.03, validation_error=0.02, error_half_way=0.02, cut=True)
    searched = model("NARX", 0.04, cut=True)
    remark = linear_remark([model("FIR", 0.01, linear=True), early, ended, searched])
    assert remark is not None
    assert remark.endswith("Not converged: GRU. A larger --budget may change this")
    assert "Not converged" not in str(linear_remark([model("FIR", 0.01, linear=True), ended]))


def test_linear_model_would_do_where_no_other_one_stays_bounded() -> None:
    remark = linear_remark([model("own", None), model("FIR", 0.5, linear=True)])
    assert remark is not None
    assert "FIR" in remark
    assert linear_remark([OWN, model("ARX", None, linear=True)]) is None
    assert linear_remark([OWN]) is linear_remark([model("FIR", 0.5, linear=True)]) is None


def test_errors_of_rounding_count_as_equal() -> None:
    remark = linear_remark([model("ARX", 5e-7, linear=True), model("NARX", 1e-15), OWN])
    assert remark is not None
    assert "ARX has 1 times the error" in remark


def test_best_of_the_other_models_counts_not_the_own_one_alone() -> None:
    models = [model("own", 0.5), model("ARX", 0.1, linear=True), model("GRU", 0.05), FAILED]
    assert linear_remark(models) is None


def test_error_of_several_outputs_is_the_largest_and_without_one_infinite() -> None:
    single = model("own", 0.02)
    assert replace(single, outputs=model("", 0.3).outputs + single.outputs).error == 0.3
    assert model("NARX", None).error == FAILED.error == float("inf")


def test_divergence_is_told_with_what_is_left() -> None:
    assert remark_on(model("NARX", None, cut=True), 7) == (
        "diverged on 2 of 7 trajectories, 3.1 % off on the others; "
        "its search was cut by the budget"
    )
    (output,) = model("NARX", None).outputs
    unknown = replace(output, bounded_rmse_over_deviation=None)
    everywhere = model("NARX", None, diverged=7, outputs=(unknown,))
    assert remark_on(everywhere, 7) == "diverged on 7 of 7 trajectories"
    assert remark_on(OWN, 7) == ""


def test_training_that_still_improves_is_not_converged() -> None:
    course = {"validation_error": 0.02, "error_half_way": 0.03, "cut": True}
    assert remark_on(model("GRU", 0.02, **course), 7) == (
        "not converged: 3 % in validation at half of its time, 2 % at the end"
    )
    near = model("GRU", 0.02, **{**course, "error_half_way": 0.021})
    assert remark_on(near, 7).startswith("converged: 2.1 %")
    ended = model("GRU", 0.02, **{**course, "cut": False})
    assert remark_on(ended, 7) == "trained to its end: 2 % in validation"


def test_training_that_took_longer_than_the_budget_is_remarked() -> None:
    assert remark_on(model("FIR", 0.02, cpu_seconds=3.0), 7, 2.0) == "took 1.5 times the budget"
    assert remark_on(model("FIR", 0.02, cpu_seconds=2.05), 7, 2.0) == ""


def test_table_has_a_row_for_every_model_also_for_one_that_failed() -> None:
    untimed = model("own: state space", 0.02, cpu_seconds=None)
    table = model_table(figures(untimed, model("NARX", None), FAILED))
    heading, (own, narx, failed) = table.heading, table.rows
    assert heading[1] == "error of position"
    assert own == ("own: state space", "2 %", "9", "", "3 µs", "2", "4 lags", "")
    assert narx[1] == "diverged"
    assert failed == ("GRU", "", "", "1 s", "", "", "", "failed: training diverged")
    assert len(heading) == len(own) == len(failed)


def test_report_shows_table_charts_and_remark() -> None:
    data = figures(OWN, model("ARX", 0.02, linear=True), model("NARX", None))
    page = baselines_report(data, "a car").html()
    assert page.count("data-chart=") == 2
    for words in (
        "car: comparison",
        "a linear model would do: ARX",
        "diverged on 2 of 7",
        "seed 5",
    ):
        assert words in page, words


@pytest.mark.parametrize("models", [[OWN, model("NARX", None), FAILED], [model("own", None)]])
def test_charts_are_drawn_whatever_diverges(models: list[ModelFigures]) -> None:
    size, time = error_charts(models)
    for chart in (size, time):
        lines = [line for line in chart.panels[0].lines if line.name]
        assert len(lines) == sum(one.failed is None for one in models)
        assert all(np.isfinite(line.y).all() for line in lines)
        assert all(("(diverged)" in line.name) == (line.y[0] > 2.5) for line in lines)
