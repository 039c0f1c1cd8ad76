"""Charts of error bounds by kind, and the steps at which errors are largest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from slide_fmu.report.trust_charts import coverage_charts
from slide_fmu.validation.comparison import Comparison
from slide_fmu.validation.worst_steps import error_over_bound, worst_steps
from tests.validation.handmade import bounded, comparison, trust_outputs


def along(errors: list[float], kind: int = 0, outside: tuple[int, ...] = ()) -> Comparison:
    """A trajectory of two outputs with a bound of 2; the second output makes no error."""
    novelty = [3.0 if index in outside else 0.5 for index in range(len(errors))]
    bounds = trust_outputs([[2.0, 2.0]] * len(errors), novelty)
    return comparison([[error, 0.0] for error in errors], kind, trust=bounds)


def test_worst_steps_are_the_largest_of_each_trajectory_in_falling_order() -> None:
    trajectories = [along([1.0, 4.0, 3.9]), along([-6.0, 1.0, 5.9]), along([0.0, 0.0, 1.0])]
    found = worst_steps(trajectories, 2, 1, error_over_bound)
    assert [(step.sample, step.output, step.ratio) for step in found] == [(0, 0, 3), (1, 0, 2)]
    assert found[0].comparison is trajectories[1]


def test_trajectories_have_further_steps_apart_where_there_are_too_few() -> None:
    only = along([1.0, 8.0, 7.0, 2.0, 6.0, 1.0])
    found = worst_steps([only], 3, 2, error_over_bound)
    assert [step.sample for step in found] == [1, 4]  # further ones touch these
    assert [step.sample for step in worst_steps([only], 3, 1, error_over_bound)] == [1, 2, 4]


def test_error_over_bound_is_that_of_every_output() -> None:
    assert np.array_equal(error_over_bound(along([-1.0, 4.0])), [[0.5, 0], [2, 0]])


def test_chart_of_kinds_has_a_step_for_each_trajectory() -> None:
    trajectories = along([1.0, 3.0]), along([1.0, 1.0]), along([3.0, 3.0], 1)
    (chart,) = coverage_charts({"in range": bounded(*trajectories)})
    (panel,) = chart.panels
    assert [line.name for line in panel.lines] == ["held_random (2)", "sweep (1)"]
    assert [line.x.tolist() for line in panel.lines] == [[0, 50, 100, 100], [0, 0, 100]]
    assert [line.y.tolist() for line in panel.lines] == [[0, 0, 50, 100], [0, 0, 100]]
    assert chart.marks == [95.0]


def test_charts_of_kinds_name_those_of_each_validation() -> None:
    """Kinds that are held out are others than those of the training."""
    inside = bounded(along([1.0, 3.0]))
    _, other = inside.recipe.data.excitation
    data = inside.recipe.data.model_copy(update={"excitation": (other,)})
    held_out = replace(inside, recipe=inside.recipe.model_copy(update={"data": data}))
    charts = coverage_charts({"in range": inside, "held out": held_out})
    names = [[line.name for line in chart.panels[0].lines] for chart in charts]
    assert names == [["held_random (1)"], ["sweep (1)"]]
