"""The figures of estimates and bounds in a validation, and how tables show them."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from slide_fmu.core.figures import plain
from slide_fmu.core.readable import quantity
from slide_fmu.report.html_report import ReportSection
from slide_fmu.report.trust_sections import bound_sections
from slide_fmu.report.trust_sentences import bound_sentences, search_sentence
from slide_fmu.report.trust_tables import (
    bound_table,
    estimate_table,
    harm_table,
    harms_of,
    kind_table,
    tolerance_table,
)
from slide_fmu.surrogate.input_forecast import InputForecast
from slide_fmu.validation.comparison import Comparison, FmuAnswer
from slide_fmu.validation.results import Validation
from slide_fmu.validation.trust_figures import Covered, Harm, SearchFigures
from tests.recipes import whole_recipe
from tests.validation.handmade import bounded, comparison, trust_outputs, validation

STILL = [0.5, 0.5, 0.5, 0.5]
FIRST = comparison(
    [[1.0, 0.1], [-2.0, 0.1], [3.0, 0.2], [4.0, 0.1]],
    trust=trust_outputs([[2.0, 0.2], [3.0, 0.2], [2.0, 0.3], [5.0, 0.4]], STILL),
)
SECOND = comparison(
    [[-1.0, 0.1], [2.0, 0.9], [3.0, 0.9], [1.0, 0.1]],
    kind=1,
    trust=trust_outputs([[2.0, 0.2], [3.0, 0.3], [4.0, 0.4], [2.0, 0.5]], [0.5, 3.0, 3.0, 0.5]),
)
HELD = bounded(FIRST).surrogate
MOVING = replace(HELD, inputs=tuple(replace(one, hold="first_order") for one in HELD.inputs))
THIRD = replace(SECOND, trust=trust_outputs([[9.0, 9.0]] * 4, STILL))


def test_bound_is_measured_for_each_output_over_all_trajectories() -> None:
    found = bounded(FIRST, SECOND).figures().error_bound
    first, second = found.outputs
    assert found.confidence == 0.95
    assert (first.name, second.name) == ("y0", "y1")
    assert (first.coverage, second.coverage) == (7 / 8, 6 / 8)
    assert first.coverage_of_worst_trajectories == 3 / 4
    assert second.coverage_of_worst_trajectories == 2 / 4
    assert (found.flagged, found.trajectories_flagged) == (2 / 8, 1 / 2)
    json.dumps(plain(found), allow_nan=False)


def test_kinds_of_excitation_are_covered_apart() -> None:
    held, sweep = bounded(FIRST, SECOND, THIRD).figures().error_bound.excitations
    assert (held.name, held.trajectories) == ("held_random", 1)
    assert held.coverage == held.lowest_coverage == (3 / 4, 1)
    assert (sweep.name, sweep.trajectories) == ("sweep", 2)
    assert sweep.coverage == (1, 3 / 4)
    assert sweep.lowest_coverage == (1, 1 / 2)
    assert (sweep.flagged, sweep.trajectories_flagged) == (2 / 8, 1 / 2)


def test_surrogate_without_a_bound_has_no_figures_of_one() -> None:
    assert validation(FIRST).figures().error_bound is None


def test_estimates_are_compared_without_floor_where_their_span_is_whole() -> None:
    nan = float("nan")
    some = comparison(
        [[0.0, 0.0]] * 3,
        estimate=np.array([[9.0, 9.0], [1.5, 2.0], [2.0, 2.0]]),
        true_error=np.array([[nan, nan], [1.0, 2.0], [2.0, 1.0]]),
    )
    first, second = validation(some).figures().error_estimate.without_floor
    assert first.name == "y0"
    assert first.mean == pytest.approx(0.25)
    assert first.constant_mean == pytest.approx(0.25)
    assert first.rank_correlation == pytest.approx(1)
    assert second.mean == pytest.approx(0.5)
    assert second.rank_correlation is None


def test_output_without_any_error_has_no_deviation_without_floor() -> None:
    some = comparison([[0.0, 0.0]] * 2, true_error=np.array([[0.0, 1.0], [0.0, 2.0]]))
    (only,) = validation(some).figures().error_estimate.without_floor
    assert only.name == "y1"


def test_rows_of_estimates_have_the_constant_next_to_them() -> None:
    figures = validation(FIRST, SECOND).figures()
    table = estimate_table({"in range": figures})
    heading, (first, second, norm) = table.heading, table.rows
    assert len(heading) == len(first)
    assert heading[4:6] == ("the best constant: mean", "the best constant: 95 % within")
    assert [row[:2] for row in (first, second, norm)] == [
        ("in range", name) for name in ("y0", "y1", "norm of the outputs")
    ]
    # estimated 0.5, true 0.25
    assert second[2:] == ("100 %", "100 %", "0 %", "0 %", "0 %", "0.5 times the estimate", "")


def test_rows_of_bounds_have_percentages_of_outputs_and_kinds() -> None:
    figures = {"in range": bounded(FIRST, SECOND, THIRD).figures()}
    table = bound_table(figures)
    heading, (first, second) = table.heading, table.rows
    assert len(heading) == len(first) == len(second)
    assert first[:4] == ("in range", "y0", "91.7 %", "75 %")
    assert first[-3:] == ("16.7 %", "33.3 %", "16.7 %")
    held, sweep = kind_table(figures).rows
    assert held == ("in range", "held_random", "1", "75 %", "75 %", "0 %", "0 %")
    assert sweep == ("in range", "sweep", "2", "75 %", "50 %", "25 %", "25 %")


def test_harm_stands_by_kind_in_tables_where_usual_errors_are_known() -> None:
    known = replace(bounded(FIRST, SECOND, THIRD), usual=np.array([1.0, 0.2]))
    figures = {"in range": known.figures()}
    table = harm_table(figures)
    heading, (everything, held, sweep) = table.heading, table.rows
    assert len(heading) == len(everything)
    # 4.0 of the first; 0.9 twice in each of the others
    assert everything[:4] == ("in range", "all", "41.7 %", "40 %")
    assert held[1:] == ("held_random", "25 %", "0 %", "0 %", "0 %")
    assert sweep[1:] == ("sweep", "50 %", "50 %", "0 %", "0 %")
    assert harm_table({"in range": bounded(FIRST, SECOND).figures()}).rows == ()


def test_sentences_name_the_calibration_the_confidences_and_the_false_alarms() -> None:
    found = bounded(FIRST, SECOND)
    text = " ".join(bound_sentences(found.recipe, HELD, found.figures()))
    assert "that the surrogate was trained on: they were calibrated by 150 trajectories" in text
    assert "90 to 99 %" in text
    assert "Where in_domain is false" in text


def last_distrusted(*comparisons: Comparison) -> Validation:
    """A validation in which the last sample of each trajectory is not trusted."""
    trusted = [
        replace(c, trust=replace(c.trust, trusted=np.array([1.0, 1.0, 1.0, 0.0])))
        for c in comparisons
        if c.trust is not None
    ]
    return bounded(*trusted)


def test_flag_counts_and_not_the_domain() -> None:
    known = replace(last_distrusted(FIRST, SECOND), usual=np.array([1.0, 0.2]))
    bound = known.figures().error_bound
    assert (bound.flagged, bound.untrusted) == (2 / 8, 2 / 8)
    assert bound.harm == Harm(  # 4.0 of the first and flagged; 0.9 twice of the second, unnoticed
        harmful=3 / 8, harmful_flagged=1 / 3, harmless_flagged=1 / 5, harmful_unnoticed=2 / 8
    )
    figures = {"in range": known.figures()}
    assert harm_table(figures).heading[3:] == (
        "of them flagged (not trusted)",
        "of the harmless ones",
        "harmful, trusted and above the bound",
    )
    for table in (bound_table(figures), kind_table(figures)):
        assert table.heading[-1] == "samples with trusted = false"
        assert {row[-1] for row in table.rows} == {"25 %"}
    text = " ".join(bound_sentences(known.recipe, known.surrogate, known.figures()))
    assert "trusted is false for 25 % and in_domain for 25 %; trusted was false for" in text
    assert "at most 4 % of the samples of the calibration, and in_domain for 0.2 %" in text
    unknown = " ".join(bound_sentences(known.recipe, known.surrogate, None))
    assert "With the tolerances of the start, trusted was false for at most 4 %" in unknown


def test_tolerances_are_given_by_false_alarms_in_range() -> None:
    found = bounded(FIRST, SECOND)
    rows = found.figures().error_bound.tolerances
    assert [row.alarms for row in rows] == [0.005, 0.01, 0.02, 0.04, 0.08]
    assert {row.tolerances for row in rows} == {None}  # a quarter is outside of the domain
    inside = bounded(FIRST, THIRD)
    table = tolerance_table({"in range": inside.figures()})
    start = inside.surrogate.error_tolerances
    factor = max(9.0 / start)  # the largest bounds are 9 and 9
    expected = tuple(quantity(value, "m") for value in factor * start)
    assert table.heading == (
        "false alarms on these trajectories",
        "tolerance of y0",
        "tolerance of y1",
    )
    assert table.rows[0] == ("0.5 %", *expected)
    not_reached = tolerance_table({"in range": found.figures()})
    assert not_reached.rows[0] == ("0.5 %", "not reached", "not reached")
    beyond = bounded(FIRST, THIRD, amplitude=(1.0, 2.0)).figures()
    assert beyond.error_bound.tolerances == ()
    assert tolerance_table({"beyond": beyond}).rows == ()


def test_card_says_what_the_bound_alone_has_learnt_from() -> None:
    found = bounded(FIRST, SECOND)
    kind = {"kind": "binary", "weight": 2.0, "duration": [0.1, 0.3]}
    assert found.recipe.bound is not None
    values = found.recipe.model_dump()
    table = {**values["bound"], "excitation": (kind,)}
    recipe = whole_recipe({**values, "bound": table})
    learnt = f"have also learnt from {recipe.count('further')} trajectories of further kinds"
    assert learnt in " ".join(bound_sentences(recipe, HELD, None))
    assert "further kinds" not in " ".join(bound_sentences(found.recipe, HELD, None))


def test_search_is_told_with_the_starts_from_which_bounds_were_broken() -> None:
    figures = SearchFigures(
        starts=3,
        changes_tried=100,
        confidences=(0.95, 0.99),
        before=(0.5, 2.5, 1.9),
        after=(2.1, 7.0, 1.95),
        after_highest=(1.1, 4.0, 0.9),
        broken=2,
        broken_at_highest=1,
    )
    sentence = search_sentence(figures)
    assert "of 7 times its bound of 95 % (before the search: 2.5)" in sentence
    assert "from 2 of 3 starts (before the search: 1), of 99 % from 1." in sentence


def sections_of(**validations: Validation) -> list[ReportSection]:
    """Return the sections on the bound of validations."""
    return bound_sections(validations, {name: v.figures() for name, v in validations.items()})


def test_report_has_sections_on_the_bound_with_charts() -> None:
    found = bounded(FIRST, SECOND)
    sections = sections_of(in_range=found, beyond=found)
    assert [len(section.charts) for section in sections] == [4, 2, 0]
    assert [len(s.table.rows) for s in sections if s.table is not None] == [4, 4, 5]
    assert "calibrated by 150 trajectories" in sections[0].text


def test_samples_before_the_bound_counts_are_left_out() -> None:
    late = replace(SECOND, first_trusted=2)
    whole, part = (bounded(one).figures().error_bound for one in (SECOND, late))
    cut = late.where_trusted()
    assert cut is not None
    assert len(cut.time) == len(SECOND.time) - 2
    assert bounded(cut).figures().error_bound == part != whole
    assert replace(SECOND, first_trusted=99).where_trusted() is None


def test_all_that_stands_beside_a_sample_is_left_out_with_it() -> None:
    """Estimates would be drawn beside other samples else, or not at all."""
    arrays = {name: SECOND.reference + i for i, name in enumerate(("estimate", "plain", "model"))}
    cut = replace(SECOND, first_trusted=2, **arrays).where_trusted()
    assert cut is not None
    for name, values in arrays.items():
        np.testing.assert_array_equal(getattr(cut, name), values[2:])
    assert cut.free is None


def test_card_says_which_errors_bounds_do_not_hold() -> None:
    own = bounded(FIRST).recipe
    system = own.system.model_copy(update={"reference": {"substeps": 9}})
    finer = own.model_copy(update={"system": system})
    window = own.window.model_copy(update={"planned": True})
    planned = own.model_copy(update={"window": window})
    known, model = "with inputs known to the step's end", "against the finer reference"
    forecast = "the error of forecasting them to its end is in them"
    assert model in " ".join(bound_sentences(finer, HELD, None))
    assert forecast in " ".join(bound_sentences(own, MOVING, None))
    assert known in " ".join(bound_sentences(planned, MOVING, None))
    for text in (model, forecast, known):
        assert text not in " ".join(bound_sentences(own, HELD, None))


def test_bound_and_estimate_are_measured_in_the_call_that_users_make() -> None:
    """Known to the step's end the errors are 1 and 1, in the plain call 3 and 1."""
    inside = trust_outputs([[2.0, 2.0]] * 2, STILL[:2])
    known = comparison([[1.0, 1.0]] * 2, trust=inside)
    outputs = known.reference + [[3.0, 1.0]] * 2
    answer = FmuAnswer(outputs, np.full((2, 2), 1.0), np.array([[3.0, 1.0]] * 2), inside)
    found = bounded(replace(known, plain=outputs, plain_answer=answer))
    figures = found.figures()
    bound = figures.error_bound
    assert [output.coverage for output in bound.outputs] == [0.0, 1.0]
    assert bound.plain == Covered(coverage=(0.0, 1.0), untrusted=0.0)
    assert bound.known_to_step_end == Covered(coverage=(1.0, 1.0), untrusted=0.0)
    estimated = validation(*found.comparisons).figures().error_estimate
    (sentence,) = [s for s in bound_sentences(found.recipe, MOVING, figures) if "Covered" in s]
    assert "in the plain call: 0 %, 100 %; with" in sentence
    first, second = estimated.without_floor
    assert (first.too_small_share, first.too_small_factor) == (1.0, 3.0)
    assert (second.mean, second.too_small_share) == (0.0, 0.0)
    assert [output.p95_error for output in figures.outputs] == [3.0, 1.0]
    assert figures.outputs[0].rmse == 1.0  # the accuracy is that of known inputs
    planned = InputForecast(planned=True)
    moves = replace(found.surrogate.inputs[0], hold="first_order")
    other = replace(found.surrogate, inputs=(moves,), forecast=planned)
    ahead = replace(found, surrogate=other).figures()
    assert [output.coverage for output in ahead.error_bound.outputs] == [1.0, 1.0]
    assert ahead.error_bound.plain == Covered(coverage=(0.0, 1.0), untrusted=0.0)
    harmful = replace(found, surrogate=other, usual=np.array([0.5, 0.5])).figures().error_bound
    assert harmful.harm == harmful.known_to_step_end.harm
    assert harmful.harm.harmful == 0.0
    assert harmful.plain.harm == Harm(
        harmful=1.0, harmful_flagged=0.0, harmless_flagged=None, harmful_unnoticed=1.0
    )
    assert [name for name, _ in harms_of(harmful)][:2] == ["all", "all, plain call"]
    with_estimate = validation(*found.comparisons)
    (own,) = with_estimate.surrogate.inputs
    moves = replace(own, hold="first_order")
    other = replace(with_estimate.surrogate, inputs=(moves,), forecast=planned)
    of_known = replace(with_estimate, surrogate=other).figures().error_estimate
    assert of_known.plain == estimated.without_floor != of_known.without_floor
    assert estimated.plain == ()  # there, the first figures are those of the plain call


@pytest.mark.parametrize("more", [{"amplitude": (1.0, 3.0)}, {"held_out": True}])
def test_report_of_other_inputs_calls_no_flag_a_false_alarm(more: dict[str, Any]) -> None:
    text = sections_of(validation=bounded(FIRST, SECOND, **more))[0].text
    assert "With the tolerances of the start, trusted was false for at most 4 %" in text
    assert "False alarms" not in text
    text = sections_of(validation=bounded(FIRST, SECOND))[0].text
    assert "of the samples in range, trusted is false for 25 %" in text
