"""The figures of a validation against numbers worked out by hand."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from slide_fmu.core.figures import plain, read_figures
from slide_fmu.surrogate.input_forecast import InputForecast
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation.comparison import Comparison
from slide_fmu.validation.error_figures import ValidationFigures
from slide_fmu.validation.task import Task
from tests.validation.handmade import comparison, surrogate_of, validation

NAN = math.nan


def dumped(figures: object) -> str:
    """Return figures as JSON."""
    return json.dumps(plain(figures), allow_nan=False)


ONE = comparison([[1.0, 0.0], [-1.0, 0.0], [1.0, 0.0], [-7.0, 0.0]])
TWO = comparison([[0.0, 2.0], [0.0, 2.0]], kind=1)
DEVIATION = 3.5
"""References are 3 and -4 in turns: so far from their mean."""


def test_errors_of_an_output_are_those_over_all_samples_of_all_trajectories() -> None:
    figures = validation(ONE, TWO).figures()
    first, second = figures.outputs
    assert (figures.trajectories, figures.seed, figures.amplitude) == (2, 5, (1, 2))
    assert (first.name, first.unit) == ("y0", "m")
    assert first.rms_reference_about_mean == pytest.approx(DEVIATION)
    assert first.rmse == pytest.approx(math.sqrt(52 / 6))
    assert first.relative_rmse == pytest.approx(math.sqrt(52 / 6) / DEVIATION)
    assert first.max_error == 7
    assert second.rmse == pytest.approx(math.sqrt(8 / 6))
    assert second.max_error == 2
    assert first.model_relative_rmse is None
    assert read_figures(ValidationFigures, json.loads(dumped(figures))) == figures


def test_quantiles_are_those_of_the_trajectories() -> None:
    levels = [0.0, 1.0, 2.0, 3.0, 14.0]
    found = validation(*(comparison([[level, 0.0]] * 2) for level in levels)).figures()
    quantiles = found.outputs[0].relative_rmse_of_trajectories
    expected = {"median": 2.0, "p10": 0.4, "p90": 9.6}
    assert vars(quantiles) == pytest.approx({k: v / DEVIATION for k, v in expected.items()})


def test_error_of_the_data_s_model_is_relative_to_the_reference() -> None:
    off = replace(ONE, model=ONE.reference + np.array([[0.5, -1.0]]))
    first, second = validation(off, TWO).figures().outputs
    assert first.model_relative_rmse == pytest.approx(0.5 / DEVIATION)
    assert second.model_relative_rmse == pytest.approx(1.0 / DEVIATION)


def test_errors_are_relative_to_what_the_reference_moves_not_to_where_it_lies() -> None:
    """A temperature in K of 293 K would make an error of 10 % look like 0.1 %."""
    far = [
        replace(c, reference=c.reference + 293.0, surrogate=c.surrogate + 293.0)
        for c in (ONE, TWO)
    ]
    near, lifted = (validation(*pair).figures() for pair in ((ONE, TWO), far))
    for one, other in zip(near.outputs, lifted.outputs, strict=True):
        assert other.rms_reference_about_mean == pytest.approx(one.rms_reference_about_mean)
        assert other.relative_rmse == pytest.approx(one.relative_rmse)
    for one, other in zip(near.excitations, lifted.excitations, strict=True):
        assert other.relative_rmse == pytest.approx(one.relative_rmse)


def test_reference_that_is_zero_throughout_gives_large_numbers_and_no_fault() -> None:
    still = replace(TWO, reference=np.zeros((2, 2)), surrogate=np.full((2, 2), 1e-9))
    outputs = validation(still).figures().outputs
    assert all(1e100 < output.relative_rmse < math.inf for output in outputs)


def test_excitations_have_errors_of_their_own_trajectories() -> None:
    third = replace(TWO, surrogate=TWO.reference)
    rows = validation(ONE, TWO, third).figures().excitations
    assert [(row.name, row.kind, row.trajectories) for row in rows] == [
        ("held_random", "held_random", 1),
        ("sweep", "sweep", 2),
    ]
    assert rows[0].relative_rmse == pytest.approx([math.sqrt(13) / DEVIATION, 0])
    assert rows[1].relative_rmse == pytest.approx([0, math.sqrt(2) / DEVIATION])
    (alone,) = validation(TWO).figures().excitations  # a kind that was not drawn has no row
    assert alone.name == "sweep"


def estimated(estimates: list[list[float]], true: list[list[float]]) -> Comparison:
    """A comparison with these estimates and true errors."""
    return comparison(
        [[0.0] * len(true[0])] * len(true), estimate=np.array(estimates), true_error=np.array(true)
    )


def test_deviation_of_estimates_has_no_floor() -> None:
    """Samples whose span is not whole do not count, and errors of zero do not either."""
    one = estimated([[9, 9], [1.5, 0.1], [0.01, 0.5]], [[NAN, NAN], [1.0, 0.0], [0.015, 0.001]])
    two = estimated([[0.3, 0.1]], [[0.1, 0.1]])
    figures = validation(one, replace(two, estimate=None), two).figures().error_estimate
    first, second = figures.without_floor
    assert first.mean == pytest.approx(np.mean([0.5, 0.005 / 0.015, 2.0]))
    assert second.mean == pytest.approx(np.mean([499.0, 0.0]))
    assert figures.span_samples == 2


def test_norm_of_several_outputs_of_one_unit_is_scored_too() -> None:
    one = estimated([[3.0, 4.0], [1.0, 0.0]], [[0.6, 0.8], [3.0, 4.0]])
    euclidean = validation(one).figures().error_estimate.euclidean
    assert euclidean.mean == pytest.approx((4.0 + 0.8) / 2)
    mixed = validation(one, surrogate=surrogate_of(("m", "rad")))
    assert mixed.figures().error_estimate.euclidean is None
    single = estimated([[3.0]], [[1.0]])
    alone = validation(single, surrogate=surrogate_of(("m",)))
    assert alone.figures().error_estimate.euclidean is None


def test_without_an_estimator_there_are_no_figures_of_estimates() -> None:
    plain = replace(surrogate_of(), estimator=None)
    assert validation(ONE, surrogate=plain).figures().error_estimate is None


def test_fmu_is_timed_by_its_median_step_and_the_reference_by_its_fastest_trajectory() -> None:
    one = replace(ONE, step_seconds=(np.full(3, 5e-6), np.full(3, 90e-6)))
    two = replace(TWO, step_seconds=(np.full(4, 10e-6), np.full(4, 40e-6)))
    timing = validation(one, two).figures().timing
    assert timing is not None
    assert timing.fmu_step_us == pytest.approx(10.0)
    assert timing.reference_step_us == pytest.approx(40.0)
    assert timing.speed is None


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"trajectories": 0}, "trajectories = 0; expected at least 1"),
        ({"duration": 0.0}, "duration = 0.0 s; expected a positive, finite time"),
        ({"duration": math.inf}, "duration = inf s"),
        ({"duration": math.nan}, "duration = nan s"),
        ({"amplitude": (0.0, 1.0)}, r"amplitude = \(0.0, 1.0\); expected two positive factors"),
        ({"amplitude": (2.0, 1.0)}, "smaller one first"),
        ({"amplitude": (1.0, math.inf)}, "amplitude"),
    ],
)
def test_task_with_impossible_numbers_is_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Task(1, **changes)


def test_task_at_the_ends_of_what_is_allowed_is_accepted() -> None:
    Task(1, trajectories=1, duration=1e-9, amplitude=(1e-9, 1e-9))
    Task(1, amplitude=(0.5, 0.5))


def test_error_of_free_runs_is_that_of_the_trajectories_that_have_one() -> None:
    assert validation(ONE, TWO).figures().outputs[0].free_relative_rmse is None
    free = replace(ONE, free=ONE.reference + np.array([[2.0, 0.5]]))
    first, second = validation(free, TWO).figures().outputs
    assert first.free_relative_rmse == pytest.approx(2.0 / DEVIATION)
    assert second.free_relative_rmse == pytest.approx(0.5 / DEVIATION)


def planned_surrogate() -> Surrogate:
    """Its inputs are known ahead."""
    signals = tuple(replace(one, hold="first_order") for one in surrogate_of().inputs)
    return replace(surrogate_of(), inputs=signals, forecast=InputForecast(planned=True))


def test_estimates_of_planned_motions_are_scored_in_both_calls() -> None:
    """Of other moving inputs nothing is known ahead: the plain call alone is what users get."""
    late = estimated([[3.0, 0.2], [3.0, 0.2]], [[1.0, 0.1], [2.0, 0.1]])
    both = replace(estimated([[1.5, 0.1]], [[1.0, 0.1]]), plain=late)
    alone = estimated([[1.0, 0.1]], [[1.0, 0.1]])
    found = validation(both, alone, surrogate=planned_surrogate()).figures().error_estimate
    assert [one.mean for one in found.without_floor] == pytest.approx([0.25, 0.0])
    assert [one.mean for one in found.plain] == pytest.approx([(2.0 + 0.5) / 2, 1.0])
    assert [one.name for one in found.plain] == ["y0", "y1"]
    without = validation(alone, surrogate=planned_surrogate()).figures().error_estimate
    assert without.plain == ()
    moving = validation(both, alone).figures().error_estimate
    assert [one.mean for one in moving.without_floor] == pytest.approx([2.5 / 3, 2 / 3])
    assert moving.plain == ()


def test_noise_floor_is_relative_to_what_the_output_moves() -> None:
    assert validation(ONE, TWO).figures().outputs[0].relative_noise_floor is None
    first, second = validation(ONE, TWO, noise=np.array([0.7, 1.4])).figures().outputs
    assert first.relative_noise_floor == pytest.approx(0.7 / DEVIATION)
    assert second.relative_noise_floor == pytest.approx(1.4 / DEVIATION)


def test_error_of_the_plain_call_is_that_of_the_motions_that_have_one() -> None:
    late = replace(ONE, surrogate=ONE.reference + np.array([[2.0, 0.5]]))
    first, second = validation(replace(ONE, plain=late), TWO).figures().outputs
    assert first.plain_relative_rmse == pytest.approx(2.0 / DEVIATION)
    assert second.plain_relative_rmse == pytest.approx(0.5 / DEVIATION)
    assert validation(ONE, TWO).figures().outputs[0].plain_relative_rmse is None


def test_usual_level_is_the_error_that_nineteen_of_twenty_samples_stay_below() -> None:
    errors = np.arange(21.0)[:, None] * np.array([1.0, -2.0])
    found = validation(comparison(errors[::-1].tolist()))
    assert found.usual_error() == pytest.approx([19.0, 38.0])
    assert [one.usual_level for one in found.figures().outputs] == pytest.approx([19.0, 38.0])


@pytest.mark.parametrize(("motions", "each"), [(1, 1), (3, 1), (10, 5), (24, 12), (40, 12)])
def test_further_kinds_have_as_many_motions_as_each_kind_in_range(motions: int, each: int) -> None:
    """The recipe has two kinds; more than twelve of one tell no more."""
    assert validation(*[ONE] * motions).each == each


def test_motions_are_in_range_where_nothing_is_changed() -> None:
    assert not validation(ONE).in_range  # its amplitude is 1 to 2
    assert validation(ONE, task=Task(5)).in_range
    assert not validation(ONE, task=Task(5, held_out=True)).in_range


def test_fmu_of_records_alone_is_timed() -> None:
    records = replace(ONE, step_seconds=(np.array([2e-6, 4e-6, 9e-6]), np.empty(0)))
    timing = validation(records).figures().timing
    assert timing is not None
    assert timing.fmu_step_us == pytest.approx(4.0)
    assert (timing.reference_step_us, timing.speed) == (None, None)
