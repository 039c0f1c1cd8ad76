"""This module makes the sections of a report on accuracy and speed of a surrogate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from slide_fmu.core.measures import TINY, percent, rms
from slide_fmu.core.readable import ratio_text
from slide_fmu.core.signals import FloatArray, Hold
from slide_fmu.core.web.charts import Chart
from slide_fmu.recipe.model_rules import rules_of
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.report.error_tables import PLAIN, accuracy_table, parameter_table, timing_table
from slide_fmu.report.frequency_charts import frequency_sections
from slide_fmu.report.html_report import ReportSection, folded
from slide_fmu.report.learning_charts import response_charts
from slide_fmu.report.learning_tables import response_table
from slide_fmu.report.limits import START_VALUES
from slide_fmu.report.prose import capitalised
from slide_fmu.report.row_tables import (
    WORDS,
    card_table,
    explanations,
    failures,
    output_table,
    row_table,
)
from slide_fmu.report.speed import speed_section
from slide_fmu.report.step_chart import TITLE, TWO_LINES, has_model, step_charts
from slide_fmu.report.tone_map import tone_maps
from slide_fmu.report.trajectory_charts import (
    NOT_TRUSTED,
    close_ups,
    error_panel,
    inputs_panel,
    name_of_motion,
    outputs_panel,
    outside_parts,
    phase_charts,
    trajectory_charts,
)
from slide_fmu.report.trust_sections import bound_sections, estimate_section
from slide_fmu.surrogate.description import SurrogateDescription
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import System
from slide_fmu.validation.comparison import Comparison
from slide_fmu.validation.error_figures import ResponseFigures, Timing
from slide_fmu.validation.response import exact_matrix, learnt_matrix, response_figures
from slide_fmu.validation.results import Validation
from slide_fmu.validation.row import Row
from slide_fmu.validation.worst_steps import WorstStep, error_over_bound, worst_steps

WINDOWS = 3
"""Number of worst windows that are drawn."""

MOST_BEFORE = 400
"""A window is drawn with no more samples than these before its worst one."""

FEWEST_BEFORE = 20

CLOSE_UP = "Each output around its largest error, with {bound}the inputs that led there."

PHASE = (
    "Every output over its speed, around the largest error of its worst trajectory, as splines "
    "through the samples: a wrong period shows as curves that come apart, a wrong rest as curves "
    "about different places."
)

MODEL_TEXT = (
    " The reference is a finer model than the one that made the data; its error on the same "
    "inputs is given next to the surrogate's error."
)


def validation_sections(
    validations: Mapping[str, Validation], rows: Sequence[Row] = ()
) -> list[ReportSection]:
    """Return the sections on the accuracy; the first validation is the one in range."""
    main = next(iter(validations.values()))
    rules, surrogate = rules_of(main.recipe), SurrogateDescription.of(main.surrogate)
    figures = {name: validation.figures() for name, validation in validations.items()}
    in_range = next(iter(figures.values()))
    worst, phases = worst_section(main), phase_charts(main)
    sections = [
        *main_sections(rows, main.surrogate.hold),
        ReportSection(
            "Around the largest error",
            CLOSE_UP.format(bound="" if main.surrogate.bound is None else "its bound and "),
            charts=close_ups(main),
        ),
        *frequency_sections(main),
        *([] if worst is None else [worst]),
    ]
    details = [
        ReportSection(
            "Side by side with the reference",
            rules.compared(main.recipe, len(main.comparisons), main.task.seed)
            + (MODEL_TEXT if main.recipe.system.reference else "")
            + moving_text(surrogate),
            accuracy_table(figures),
            charts=trajectory_charts(main),
        ),
        *([ReportSection("Phase plot", PHASE, charts=phases)] if phases else []),
    ]
    if in_range.parameters is not None:
        text = about_parameters(main.recipe)
        table = parameter_table(in_range.parameters)
        details.append(ReportSection("Physical parameters", text, table))
    if surrogate.estimate_span_s is not None:
        details.append(estimate_section(validations, figures))
    if surrogate.error_bound is not None:
        details += bound_sections(validations, figures, surrogate)
    details += all_rows(rows)
    return [*sections, *folded(details)]


def time_sections(timing: Timing) -> list[ReportSection]:
    """Return the folded sections on times, which the report in an FMU does not have."""
    text = "Both measured in one run on one machine."
    speed = [] if timing.speed is None else [speed_section(timing.speed)]
    return folded([ReportSection("Time per step", text, timing_table(timing)), *speed])


def main_sections(rows: Sequence[Row], hold: Hold) -> list[ReportSection]:
    """Return the picture of the error against the communication step, and the table of kinds.

    Args:
        rows: all that was measured.
        hold: how the inputs of the FMU act between samples.
    """
    if not rows:
        return []
    charts = step_charts(rows)
    pictures = (
        [ReportSection(TITLE, TWO_LINES if has_model(rows) else "", charts=charts)]
        if charts
        else []
    )
    table = card_table(rows, short=False)
    text = f"{capitalised(table.title)}. {explanations(rows, hold)}"
    return [*pictures, ReportSection("Where it is valid", text, table, maps=tone_maps(rows))]


def all_rows(rows: Sequence[Row]) -> list[ReportSection]:
    """Return the folded sections with all rows, and with the errors of each output in its unit."""
    if not rows:
        return []
    text = " ".join([WORDS, "The width is the mean bound over the usual level.", *failures(rows)])
    return folded(
        [
            ReportSection("All that was measured", text, row_table(rows)),
            ReportSection(
                "Errors of each output", "In the units of the outputs.", output_table(rows)
            ),
        ]
    )


def moving_text(surrogate: SurrogateDescription) -> str:
    """Say which values of moving inputs are set before a step; an empty text of held inputs."""
    if surrogate.hold == "zero_order":
        return ""
    return (
        " Inputs are known to the step's end: before each step the FMU gets the values that they "
        "reach by then. An importer that sets the values at its start makes the plain call, whose "
        f'errors stand in the column "{PLAIN}": {START_VALUES[surrogate.forecasts_inputs]}.'
    )


def response_section(
    surrogate: Surrogate, system: System
) -> tuple[ReportSection, ResponseFigures]:
    """Show the learnt response matrix of an affine surrogate against the exact one."""
    learnt, exact = learnt_matrix(surrogate), exact_matrix(system, surrogate.window)
    figures = response_figures(learnt, exact)
    text = (
        "Every row is one output sample of the window, every column one input sample. Entries "
        "above the diagonal would mean that an output answers to a later input."
    )
    charts = response_charts(learnt, exact, surrogate)
    return ReportSection("Response matrix", text, response_table(figures), charts=charts), figures


def about_parameters(recipe: Recipe) -> str:
    """Say for which values of the physical parameters the errors in their table were measured."""
    return f"{rules_of(recipe).words.parameters} Relative RMSE is the largest of the outputs."


def worst_section(validation: Validation) -> ReportSection | None:
    """Return the section on the worst windows; None where no sample counts."""
    bounded = bool(validation.trusted)
    scale = "their bounds" if bounded else "the RMS of the reference about its mean"
    worst = _worst(validation)
    if not worst:
        return None
    text = (
        f"These are the samples whose errors are largest relative to {scale}, one of each "
        "trajectory at most where there are enough of them, with the inputs that the surrogate "
        "saw before."
    )
    charts = [_chart(validation, step, bounded) for step in worst]
    return ReportSection("The worst windows", text, charts=charts)


def _worst(validation: Validation) -> list[WorstStep]:
    before = _before(validation)
    if validation.trusted:
        return worst_steps(validation.trusted, WINDOWS, before, error_over_bound)
    scale = rms(np.concatenate([c.reference - validation.mean for c in validation.comparisons]))

    def ratio(comparison: Comparison) -> FloatArray:
        return np.asarray(np.abs(comparison.error) / np.maximum(scale, TINY))

    return worst_steps(validation.comparisons, WINDOWS, before, ratio)


def _before(validation: Validation) -> int:
    """Return how many samples are drawn before a worst one: the memory of the surrogate."""
    memory = validation.surrogate.network.memory_length
    return min(max(memory, FEWEST_BEFORE), MOST_BEFORE)


def _chart(validation: Validation, step: WorstStep, bounded: bool) -> Chart:
    comparison, before = step.comparison, _before(validation)
    first = max(0, step.sample - before)
    part = slice(first, step.sample + before // 4 + 1)
    signal = validation.surrogate.outputs[step.output]
    kind = name_of_motion(validation, comparison)
    size = (
        f"{ratio_text(step.ratio)} times its bound"
        if bounded
        else f"{percent(step.ratio)} of the RMS"
    )
    return Chart(
        f"{signal.name} has an error of {size}",
        [
            inputs_panel(validation, comparison.time[part], comparison.inputs[part]),
            outputs_panel(validation, comparison, part, step.output),
            error_panel(validation, comparison, part, step.output),
        ],
        text=f"{kind}, at {comparison.time[step.sample]:.6g} s",
        parts=outside_parts(comparison, part),
        marks=[float(comparison.time[step.sample])],
        shaded=NOT_TRUSTED,
    )
