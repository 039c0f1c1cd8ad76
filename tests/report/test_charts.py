"""Charts of a report: which lines they have, and that they show what was measured."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from slide_fmu.core.signals import Signal
from slide_fmu.fitting.history import CurvePoint, History
from slide_fmu.memory.decay import Decay
from slide_fmu.memory.stability import AmplitudeTest
from slide_fmu.report.accuracy_sections import worst_section
from slide_fmu.report.frequency_charts import frequency_sections
from slide_fmu.report.learning_charts import (
    curve_chart,
    decay_chart,
    response_charts,
    stability_charts,
    training_charts,
)
from slide_fmu.report.learning_sections import training_section
from slide_fmu.report.trajectory_charts import (
    MOST_SAMPLES,
    inputs_panel,
    phase_charts,
    trajectory_charts,
)
from slide_fmu.report.trust_charts import bound_charts, estimate_charts, novelty_charts
from slide_fmu.validation.comparison import Comparison
from slide_fmu.validation.results import Validation
from tests.charts import line_of, panel_of
from tests.validation.handmade import bounded, comparison, trust_outputs, validation

BAD = comparison([[1.0, 0.0], [-1.0, 0.0], [1.0, 0.0], [-7.0, 0.0]])
GOOD = comparison([[0.0, 2.0], [0.0, 2.0]], kind=1)
BEST = comparison([[0.0, 0.0]] * 3, kind=1)


def _along(errors: list[float], kind: int = 0, outside: tuple[int, ...] = ()) -> Comparison:
    """A trajectory of two outputs with a bound of 2; the second output makes no error."""
    novelty = [3.0 if index in outside else 0.5 for index in range(len(errors))]
    bounds = trust_outputs([[2.0, 2.0]] * len(errors), novelty)
    return comparison([[error, 0.0] for error in errors], kind, trust=bounds)


def test_worst_and_median_trajectory_of_every_output_are_drawn() -> None:
    charts = trajectory_charts(validation(BAD, GOOD, BEST))
    assert [chart.title for chart in charts] == [
        *("y0: worst trajectory", "y0: median trajectory"),
        *("y1: worst trajectory", "y1: median trajectory"),
    ]
    worst = panel_of(charts[0], "y0")
    np.testing.assert_array_equal(line_of(worst.lines, "reference").y, BAD.reference[:, 0])
    np.testing.assert_array_equal(line_of(worst.lines, "surrogate").y, BAD.surrogate[:, 0])
    error = panel_of(charts[0], "error")
    np.testing.assert_array_equal(line_of(error.lines, "|error|").y, [1, 1, 1, 7])
    assert charts[0].text.startswith("held_random, relative RMSE 10")
    assert charts[2].text.startswith("sweep")


def test_worst_trajectory_has_the_largest_error_not_the_smallest_reference() -> None:
    still = comparison([[0.1, 0.0]] * 3)
    small = 1e-3 * still.reference
    still = replace(still, reference=small, surrogate=small + 0.1)
    charts = trajectory_charts(validation(still, BAD, BEST))
    worst = panel_of(charts[0], "y0")
    np.testing.assert_array_equal(line_of(worst.lines, "reference").y, BAD.reference[:, 0])


def test_only_trajectory_is_drawn_once() -> None:
    assert [chart.title for chart in trajectory_charts(validation(BAD))] == [
        "y0: the only trajectory",
        "y1: the only trajectory",
    ]


def test_long_trajectory_is_drawn_around_its_largest_error() -> None:
    errors = np.zeros((2 * MOST_SAMPLES, 2))
    errors[-5, 0] = 9.0
    (chart, _) = trajectory_charts(validation(comparison(errors.tolist())))
    line = line_of(panel_of(chart, "error").lines, "|error|")
    assert len(line.x) == MOST_SAMPLES
    assert line.y.max() == 9.0


def test_error_has_its_bound_and_what_is_not_trusted_is_shaded() -> None:
    chart, _ = trajectory_charts(bounded(_along([0.0, 1.0, 3.0, 0.0], outside=(2,))))
    (band,) = panel_of(chart, "error").bands
    assert band.high.tolist() == [2.0] * 4
    assert list(chart.parts) == [(1.0, 2.0)]
    assert chart.shaded == "not trusted (trusted is false)"


def test_legend_of_an_fmu_with_tolerances_names_its_flag() -> None:
    measured = bounded(_along([0.0, 1.0, 3.0, 0.0], outside=(2,)))
    of = {"outputs": measured.surrogate.outputs, "inputs": measured.surrogate.inputs}
    bound = SimpleNamespace(tolerances=(1.0, 1.0))
    surrogate = SimpleNamespace(**of, bound=bound, estimated_samples=2)
    chart, _ = trajectory_charts(replace(measured, surrogate=surrogate))
    assert chart.shaded == "not trusted (trusted is false)"


def test_several_inputs_are_drawn_over_their_ranges() -> None:
    signals = (Signal("a", "N", -2.0, 2.0), Signal("b", "m", 0.0, 4.0))
    measured = replace(validation(GOOD), surrogate=SimpleNamespace(inputs=signals))
    panel = inputs_panel(measured, np.arange(3.0), np.array([[-2.0, 0.0], [0.0, 1.0], [1.0, 4.0]]))
    assert (panel.title, panel.unit) == ("inputs over half their ranges", "1")
    assert line_of(panel.lines, "a").y.tolist() == [-1.0, 0.0, 0.5]
    assert line_of(panel.lines, "b").y.tolist() == [-1.0, -0.5, 1.0]
    assert {line.style for line in panel.lines} == {"steps"}


def test_one_input_is_drawn_in_its_unit(finer: Validation) -> None:
    panel = panel_of(trajectory_charts(finer)[0], "input")
    assert (panel.unit, [line.name for line in panel.lines]) == ("N", ["force"])


def test_phase_plot_goes_through_the_samples_with_their_speeds() -> None:
    time = 0.05 * np.arange(80)
    course = np.repeat(np.sin(3 * time)[:, None], 2, axis=1)
    motion = replace(comparison([[0.0, 0.0]] * 80), time=time, reference=course, surrogate=course)
    chart, _ = phase_charts(validation(motion))
    line = line_of(chart.panels[0].lines, "reference")
    np.testing.assert_allclose(line.x[::8], course[:, 0], atol=1e-12)
    np.testing.assert_allclose(line.x**2 + (line.y / 3) ** 2, 1.0, atol=0.02)


def test_trajectories_of_a_few_samples_have_no_phase_plot() -> None:
    assert phase_charts(validation(GOOD)) == []


def test_report_has_responses_and_spectra_of_every_output(finer: Validation) -> None:
    response, spectrum = frequency_sections(finer)
    assert [chart.title for chart in response.charts] == ["force to position"]
    assert [chart.title for chart in spectrum.charts] == ["position"]
    names = [line.name for line in spectrum.charts[0].panels[0].lines]
    assert names == ["reference", "surrogate", "error"]


def test_further_inputs_have_responses_where_they_move_the_output_enough() -> None:
    inputs = np.random.default_rng(5).normal(size=(4000, 3))
    output = inputs @ np.array([[0.3], [2.0], [0.001]])
    motion = comparison([[0.0]])
    motion = replace(motion, time=np.arange(4000.0), inputs=inputs, reference=output)
    signals = [Signal(name, "N", -1.0, 1.0) for name in "abcy"]
    of = {"inputs": signals[:3], "outputs": signals[3:], "hold": "first_order"}
    surrogate = SimpleNamespace(**of, window=SimpleNamespace(step=1.0))
    whole = replace(validation(replace(motion, surrogate=output)), surrogate=surrogate)
    strongest, others, _ = frequency_sections(whole)
    assert [chart.title for chart in strongest.charts] == ["b to y"]
    assert [chart.title for chart in others.charts] == ["a to y"]
    assert others.folded
    assert "1 % of the output's power" in others.text


def test_short_trajectories_have_no_sections_on_frequencies() -> None:
    assert frequency_sections(validation(BAD, GOOD)) == []


def test_worst_windows_are_those_relative_to_the_bound_where_there_is_one() -> None:
    section = worst_section(bounded(_along([0.5] * 9 + [6.0] + [0.5] * 9), _along([1.0] * 19, 1)))
    assert section is not None
    assert section.charts[0].title == "y0 has an error of 3 times its bound"
    assert section.charts[0].text == "held_random, at 9 s"
    assert list(section.charts[0].marks) == [9.0]
    assert len(section.charts) <= 10
    assert "relative to their bounds" in section.text


def test_worst_windows_without_a_bound_are_those_relative_to_the_reference() -> None:
    section = worst_section(validation(BAD, GOOD))
    assert section is not None
    assert section.charts[0].title == "y0 has an error of 200 % of the RMS"
    assert section.charts[1].title == "y1 has an error of 57.1 % of the RMS"
    panels = [panel.title for panel in section.charts[0].panels]
    assert panels == ["input", "y0", "error"]


def test_scatter_tells_what_is_outside_of_the_domain_by_its_colour() -> None:
    measured = {"in range": bounded(_along([1.0, 3.0, 1.0], outside=(2,)))}
    (bound,), (novelty,) = bound_charts(measured), novelty_charts(measured)
    for chart in (bound, novelty):
        names = [line.name for line in chart.panels[0].lines]
        assert names[:2] == ["in the domain", "outside of the domain"]
    lines = novelty.panels[0].lines
    assert np.allclose(line_of(lines, "in the domain").x, 0.5)
    assert np.allclose(line_of(lines, "outside of the domain").y, [0.5])
    assert "33.3 % not covered, in the domain" in novelty.title


def test_estimates_are_drawn_over_true_errors() -> None:
    (chart,) = estimate_charts({"in range": validation(BAD)})
    points = chart.panels[0].lines[0]
    assert set(points.x) == {0.25}
    assert set(points.y) == {0.5}
    nothing = replace(BAD, true_error=np.zeros_like(BAD.true_error))
    assert estimate_charts({"in range": validation(nothing)}) == []


def test_training_of_one_step_is_not_drawn() -> None:
    long, short = History((1, 2), (2.0, 1.0), (3.0, 2.0)), History((1,), (2.0,), (3.0,))
    (chart,) = training_charts({"surrogate": long, "estimator": short})
    assert chart.title == "surrogate"
    assert line_of(chart.panels[0].lines, "validation").y.tolist() == [3.0, 2.0]


def test_training_is_drawn_as_relative_rmse_without_a_start_far_off() -> None:
    errors = (1e34, 0.5, 0.02, 0.004), (1e30, 0.4, 0.02, 0.00287)
    history = History((1, 2, 3, 4), *errors, relative=True)
    (chart,) = training_charts({"surrogate": history})
    (panel,) = chart.panels
    assert (panel.title, panel.unit, panel.log) == ("relative RMSE", "%", True)
    training, validation = panel.lines
    np.testing.assert_allclose(training.y, [np.nan, 50.0, 2.0, 0.4])
    np.testing.assert_allclose(validation.y, [np.nan, 40.0, 2.0, 0.287])
    section = training_section({"surrogate": history, "x": replace(history, relative=False)})
    assert section.table is not None
    assert section.table.rows[0] == ("surrogate", "4", "0.287 %")
    assert section.table.rows[1] == ("x", "4", "0.00287, scaled")


def test_training_whose_loss_may_be_negative_has_an_even_axis() -> None:
    loss = History((1, 2), (3.0, -0.2), (2.0, -0.3))
    (panel,) = training_charts({"error bound": loss})[0].panels
    assert (panel.title, panel.log) == ("error, scaled", False)
    assert panel.lines[1].y.tolist() == [2.0, -0.3]


def test_run_that_grows_without_bound_is_drawn_up_to_a_limit() -> None:
    pair = np.array([[[1.0], [np.inf]], [[1.0], [-1e30]]])
    test = AmplitudeTest(2.0, 9.0, np.array([0.1]), pair, "it grows")
    (chart,) = stability_charts([test], 0.1)
    assert chart.title == "2 times the trained amplitude: FAILED"
    assert [line.y[-1] for line in chart.panels[0].lines] == [1e6, -1e6]


def test_decay_times_are_drawn_as_the_part_of_the_motions_that_has_forgotten() -> None:
    rates = np.array([-2.0, -1.0, 0.0])
    chart = decay_chart(None, Decay(rates, np.exp(-1.0)), 4.0)
    line, mean = chart.panels[0].lines
    assert line.x.tolist() == pytest.approx([0.0, 0.5, 1.0, 4.4])
    assert line.y.tolist() == pytest.approx([0.0, 0.0, 100 / 3, 200 / 3])  # one never forgets
    assert mean.x.tolist() == pytest.approx([1.0, 1.0])
    assert chart.marks == [4.0]


def test_response_is_that_of_the_newest_output_to_every_input() -> None:
    exact = np.array([[1.0, 5.0, 2.0, 6.0], [3.0, 7.0, 4.0, 8.0]])  # two inputs, one output
    signals = [SimpleNamespace(name=name, unit="N") for name in ("a", "b")]
    output = SimpleNamespace(name="y", unit="m")
    surrogate = SimpleNamespace(inputs=signals, outputs=[output])
    first, second = response_charts(exact + 0.5, exact, surrogate)  # type: ignore[arg-type]
    assert (first.title, second.title) == ("a to y", "b to y")
    assert line_of(first.panels[0].lines, "exact").y.tolist() == [3.0, 4.0]
    assert line_of(second.panels[0].lines, "learnt").y.tolist() == [7.5, 8.5]
    assert line_of(first.panels[1].lines, "deviation").y.tolist() == [0.5, 0.5]


@pytest.mark.parametrize(("name", "key"), [("validation", 0), ("training", 1)])
def test_learning_curve_has_both_errors(name: str, key: int) -> None:
    points = [CurvePoint(n, 1 / n, 0.5 / n, 1.0) for n in (4, 8)]
    line = line_of(curve_chart(points).panels[0].lines, name)
    assert line.x.tolist() == [4.0, 8.0]
    assert line.y.tolist() == [[0.25, 0.125], [0.125, 0.0625]][key]
