"""This module makes the sections of a report on accuracy and speed of a surrogate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from slide_fmu.core.signals import Hold
from slide_fmu.core.web.charts import HeatMap
from slide_fmu.recipe.model_rules import rules_of
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.report.error_tables import PLAIN, accuracy_table, parameter_table, timing_table
from slide_fmu.report.frequency_charts import error_maps, frequency_sections
from slide_fmu.report.html_report import ReportSection, folded
from slide_fmu.report.learning_charts import response_charts
from slide_fmu.report.learning_tables import response_table
from slide_fmu.report.limits import START_VALUES
from slide_fmu.report.prose import capitalised
from slide_fmu.report.row_tables import (
    WORDS,
    explanations,
    failures,
    kind_table,
    output_table,
    row_table,
)
from slide_fmu.report.speed import speed_section
from slide_fmu.report.step_chart import TITLE, TWO_LINES, has_model, step_charts
from slide_fmu.report.trajectory_charts import close_ups, phase_charts, trajectory_charts
from slide_fmu.report.trust_sections import bound_sections, estimate_section
from slide_fmu.report.worst_windows import worst_section
from slide_fmu.surrogate.description import SurrogateDescription
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import System
from slide_fmu.validation.error_figures import ResponseFigures
from slide_fmu.validation.response import exact_matrix, learnt_matrix, response_figures
from slide_fmu.validation.results import Validation
from slide_fmu.validation.row import Row

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
        *main_sections(rows, main.surrogate.hold, error_maps(main)),
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
    timing, text = in_range.timing, "Both measured in one run on one machine."
    details.append(ReportSection("Time per step", text, timing_table(timing)))
    if timing.speed is not None:
        details.append(speed_section(timing.speed))
    return [*sections, *folded(details)]


def main_sections(rows: Sequence[Row], hold: Hold, maps: Sequence[HeatMap]) -> list[ReportSection]:
    """Return the picture of the error against the communication step, and the table of kinds.

    Args:
        rows: all that was measured.
        hold: how the inputs of the FMU act between samples.
        maps: the error by amplitude and frequency of the inputs.
    """
    if not rows:
        return []
    charts = step_charts(rows)
    found = (
        [ReportSection(TITLE, TWO_LINES if has_model(rows) else "", charts=charts)]
        if charts
        else []
    )
    table = kind_table(rows, short=False)
    text = f"{capitalised(table.title)}. {explanations(rows, hold)}"
    return [*found, ReportSection("Where it is valid", text, table, maps=maps)]


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
    found = response_figures(learnt, exact)
    text = (
        "Every row is one output sample of the window, every column one input sample. Entries "
        "above the diagonal would mean that an output answers to a later input."
    )
    charts = response_charts(learnt, exact, surrogate)
    return ReportSection("Response matrix", text, response_table(found), charts=charts), found


def about_parameters(recipe: Recipe) -> str:
    """Say for which values of the physical parameters the errors in their table were measured."""
    return f"{rules_of(recipe).words.parameters} Relative RMSE is the largest of the outputs."
