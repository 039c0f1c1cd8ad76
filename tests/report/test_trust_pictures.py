"""Pictures of error bounds, and the steps that they show."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

from slide_fmu.report import trust_pictures
from slide_fmu.validation.comparison import Comparison
from slide_fmu.validation.worst_steps import error_over_bound, worst_steps
from tests.validation.handmade import bounded, comparison, told


def along(errors: list[float], kind: int = 0, outside: tuple[int, ...] = ()) -> Comparison:
    """A trajectory of two outputs with a bound of 2; the second output makes no error."""
    novelty = [3.0 if index in outside else 0.5 for index in range(len(errors))]
    bounds = told([[2.0, 2.0]] * len(errors), novelty)
    return comparison([[error, 0.0] for error in errors], kind, told=bounds)


def drawn_by(monkeypatch: pytest.MonkeyPatch) -> list[Figure]:
    """The figures that are drawn from now on."""
    drawn: list[Figure] = []
    monkeypatch.setattr(trust_pictures, "_png", drawn.append)
    return drawn


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


def test_picture_of_kinds_has_a_dot_for_each_trajectory(monkeypatch: pytest.MonkeyPatch) -> None:
    drawn = drawn_by(monkeypatch)
    trajectories = along([1.0, 3.0]), along([1.0, 1.0]), along([3.0, 3.0], 1)
    trust_pictures.coverage_by_kind({"in range": bounded(*trajectories)})
    (axes,) = drawn[0].axes
    labels = [label.get_text() for label in axes.get_yticklabels()]
    assert labels == ["held_random (2)", "sweep (1)"]
    dots = [line.get_xdata() for line in axes.lines if line.get_marker() == "."]
    assert [list(np.asarray(values)) for values in dots] == [[50, 100], [0]]


def test_picture_of_kinds_names_those_of_each_validation(monkeypatch: pytest.MonkeyPatch) -> None:
    """Kinds that are held out are others than those of the training."""
    drawn = drawn_by(monkeypatch)
    inside = bounded(along([1.0, 3.0]))
    _, other = inside.recipe.data.excitation
    data = inside.recipe.data.model_copy(update={"excitation": (other,)})
    held_out = replace(inside, recipe=inside.recipe.model_copy(update={"data": data}))
    trust_pictures.coverage_by_kind({"in range": inside, "held out": held_out})
    labels = [[label.get_text() for label in ax.get_yticklabels()] for ax in drawn[0].axes]
    assert labels == [["held_random (1)", "sweep (0)"], ["sweep (1)"]]
