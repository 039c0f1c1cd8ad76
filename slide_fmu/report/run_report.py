"""This module makes the report of a run, which shows all measurements of a surrogate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import PureWindowsPath

from slide_fmu.core.readable import decimal
from slide_fmu.core.units import NO_UNIT, behind
from slide_fmu.data.answers import asked_of_sources
from slide_fmu.excitation.kinds import Excitation, names_of
from slide_fmu.excitation.loop import LoopRecipe
from slide_fmu.fitting.history import Curve, History, explanations_of
from slide_fmu.fmu.description.surrogate_variables import Variable, fmu_variables
from slide_fmu.memory.sizing import AnySizing
from slide_fmu.memory.stability import AmplitudeTest, stability_figures
from slide_fmu.recipe.case import Case
from slide_fmu.recipe.model_rules import rules_of
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.report import accuracy_sections, learning_sections
from slide_fmu.report.accuracy_sections import response_section
from slide_fmu.report.html_report import Report, ReportSection, folded, remark_sections
from slide_fmu.report.loop_sections import loop_sections
from slide_fmu.report.prose import sentences
from slide_fmu.report.quality import linear_size_remark, remark_on_error, remark_on_training
from slide_fmu.report.run_figures import RunFigures
from slide_fmu.report.table import ReportTable
from slide_fmu.report.trust_sections import search_sections
from slide_fmu.report.verdict import verdict_of
from slide_fmu.surrogate.description import SurrogateDescription
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import System
from slide_fmu.validation.adversarial import Attack
from slide_fmu.validation.error_figures import ResponseFigures
from slide_fmu.validation.loop_gain import loop_figures
from slide_fmu.validation.response import is_affine
from slide_fmu.validation.results import Validation
from slide_fmu.validation.row import Row
from slide_fmu.validation.task import IN_RANGE


@dataclass(frozen=True, eq=False)
class RunMeasurement:
    """A RunMeasurement holds all measurements of a trained surrogate, which its report shows.

    Attributes:
        surrogate: the surrogate.
        histories: course of its trainings, by stage; empty if it was trained elsewhere.
        validations: by name, the one in range first.
        tests: of fading memory and boundedness.
        sizing: memory of the system, and the part that the window truncates.
        curve: the learning curve by which the number of trajectories was found.
        rows: all that was measured, by inputs, call and communication step.
        attacks: results of the search for unnoticed errors; empty if it was not done now.
        remarks: on trajectories beyond the range.
    """

    surrogate: Surrogate
    histories: Mapping[str, History]
    validations: Mapping[str, Validation]
    tests: tuple[AmplitudeTest, ...]
    sizing: AnySizing
    curve: Curve
    rows: tuple[Row, ...]
    attacks: Sequence[Attack]
    remarks: tuple[str, ...]


def run_figures(
    case: Case, measurement: RunMeasurement, command: str, versions: Mapping[str, str]
) -> tuple[RunFigures, list[ReportSection]]:
    """Return the figures of a run, and the section on the response matrix, if it has one.

    Args:
        case: the case that was learnt.
        measurement: the measurements of the surrogate.
        command: the command that the user called.
        versions: of the packages that made the surrogate, by name.
    """
    surrogate, source = measurement.surrogate, case.source
    response, sections = affine_response(source, surrogate)
    networks = ("surrogate", "companion")  # their remarks are about errors of outputs
    useless = (
        h.remark for name, h in measurement.histories.items() if not name.startswith(networks)
    )
    figures = RunFigures(
        name=case.recipe.name,
        command=command,
        versions=versions,
        validation={name: v.figures() for name, v in measurement.validations.items()},
        window=measurement.sizing.figures(),
        parameters=surrogate.network.count_parameters(),
        response_matrix=response,
        stability=stability_figures(measurement.tests),
        no_error_estimate=next((text for text in useless if text), None),
        learning_curve=measurement.curve
        if measurement.curve.points and measurement.histories
        else None,
        rows=measurement.rows,
        loops=loop_figures(
            case.recipe, surrogate, source, measurement.validations[IN_RANGE].comparisons
        ),
    )
    in_range = measurement.validations[IN_RANGE]
    figures = replace(figures, record_remarks=remarks_on_data(source, in_range))
    return with_training(
        figures, surrogate, measurement.histories, case.recipe, measurement.remarks
    ), sections


@asked_of_sources
def affine_response(
    system: System, surrogate: Surrogate
) -> tuple[ResponseFigures | None, list[ReportSection]]:
    """Return the figures of the response matrix, and its section, if a surrogate has one."""
    if not is_affine(surrogate):
        return None, []
    section, response = response_section(surrogate, system)
    return response, [section]


@asked_of_sources
def remarks_on_data(system: System, in_range: Validation) -> tuple[str, ...] | None:
    """Return the remarks on the data; None where all data were simulated."""
    return None


def with_training(
    figures: RunFigures,
    surrogate: Surrogate,
    histories: Mapping[str, History],
    recipe: Recipe,
    more: Sequence[str],
) -> RunFigures:
    """Return figures with the sizes tried in the training, and with all remarks.

    Args:
        figures: the other figures.
        surrogate: the trained surrogate.
        histories: course of its trainings, by stage; without any, the figures stay as they are.
        recipe: the recipe that it was trained by.
        more: further remarks.
    """
    if not histories:
        return figures
    history, linear = histories["surrogate"], None
    if not surrogate.network.is_affine:
        linear = linear_size_remark(history.sizes, min(history.validation_error))
    remarks = (
        remark_on_error(recipe, figures.validation),
        *(one.remark for one in histories.values()),
        remark_on_training(recipe, history),
        linear,
        *more,
    )
    said = dict.fromkeys(text for text in remarks if text is not None)  # some say it twice
    remark = "; ".join(said) or None
    return replace(
        figures,
        sizes_tried=history.sizes,
        explanations=explanations_of(histories),
        remark=remark,
    )


def run_report(
    recipe: Recipe, measurement: RunMeasurement, figures: RunFigures, response: list[ReportSection]
) -> Report:
    """Return the report of a run without times, as the FMU has it.

    Args:
        recipe: the recipe of the surrogate.
        measurement: the measurements of the surrogate.
        figures: its figures, without times.
        response: the section on its response matrix, if it has one.
    """
    return Report(
        f"{recipe.name}: surrogate FMU",
        recipe.description,
        figures,
        [
            *_sections(measurement, figures, response),
            *origin_sections(measurement.surrogate, recipe),
        ],
        verdict=verdict_of(figures, SurrogateDescription.of(measurement.surrogate)),
    )


def with_times(report: Report, figures: RunFigures, surrogate: Surrogate) -> Report:
    """Return the report of a run with the times that are in its figures.

    The run folder has this report; the FMU, the one without times.
    """
    timing = figures.in_range.timing
    assert timing is not None
    return replace(
        report,
        figures=figures,
        sections=[*report.sections, *accuracy_sections.time_sections(timing)],
        verdict=verdict_of(figures, SurrogateDescription.of(surrogate)),
    )


def _sections(
    measurement: RunMeasurement, figures: RunFigures, response: list[ReportSection]
) -> list[ReportSection]:
    """Return all sections of the report of a run."""
    surrogate, curve = measurement.surrogate, figures.learning_curve
    details = [*response]
    if measurement.tests:
        details.append(
            learning_sections.stability_section(measurement.tests, surrogate.window.step)
        )
    details.append(learning_sections.sizing_section(measurement.sizing))
    if measurement.histories:
        details.append(learning_sections.training_section(measurement.histories))
    if figures.sizes_tried or figures.remark:
        sizes = figures.sizes_tried or ()
        details.append(
            learning_sections.sizes_section(sizes, figures.explanations, figures.remark)
        )
    if curve is not None:
        details.append(learning_sections.curve_section(curve))
    details += search_sections(measurement.attacks, surrogate)
    return [
        *accuracy_sections.validation_sections(measurement.validations, measurement.rows),
        *loop_sections(figures.loops),
        *remark_sections(figures.record_remarks or ()),
        *folded(details),
    ]


def origin_sections(surrogate: Surrogate, recipe: Recipe) -> list[ReportSection]:
    """Return the folded sections on variables, equations, network and excitation."""
    equations = [ReportSection("Equations", recipe.equations.strip())] if recipe.equations else []
    return folded(
        [
            *equations,
            ReportSection("Variables", "", variable_table(surrogate)),
            ReportSection("How it was made", _made(surrogate, recipe), excitation_table(recipe)),
        ]
    )


def _made(surrogate: Surrogate, recipe: Recipe) -> str:
    """Say what was trained on what, and with which network a training began, if with one."""
    start = getattr(recipe.training, "start", None)
    return " ".join(
        sentences(
            "made.txt",
            surrogate=SurrogateDescription.of(surrogate),
            data=recipe.data,
            start=PureWindowsPath(start).name if start else None,
            inputs_seen=rules_of(recipe).words.inputs_seen,
        )
    )


def excitation_table(recipe: Recipe) -> ReportTable:
    """Return the kinds of inputs that surrogate and bound have learnt from."""
    groups: tuple[tuple[str, Sequence[Excitation | LoopRecipe]], ...] = (
        ("", recipe.mix()),
        ("not measured", recipe.kinds_of_training()),
        ("bound alone", recipe.further_kinds()),
    )
    rows = [
        (
            name,
            f"{kind.weight:g}",
            "; ".join(f"{key} {value}" for key, value in kind.settings().items()),
            remark,
        )
        for remark, kinds in groups
        for name, kind in zip(names_of(kinds), kinds, strict=True)
    ]
    rows = rows or [(motion.name, "", "", "") for motion in rules_of(recipe).motions(recipe)]
    heading = "inputs", "weight", "settings", "remark"
    return ReportTable.of(heading, rows).without_empty_columns()


def variable_table(surrogate: Surrogate) -> ReportTable:
    """Return the FMU's variables in the order of their value references."""
    rows = (
        (v.name, v.causality, behind(v.unit or NO_UNIT), _range_of(v), v.description)
        for v in fmu_variables(surrogate)
    )
    return ReportTable.of(("variable", "causality", "unit", "range", ""), rows)


def _range_of(variable: Variable) -> str:
    if variable.type == "Boolean":
        return "false, true"
    if variable.low is None or variable.high is None:
        return ""
    return f"{decimal(variable.low, 4)} .. {decimal(variable.high, 4)}"
