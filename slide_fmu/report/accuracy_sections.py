"""Sections of a report show how accurate a surrogate is, and how fast."""

from __future__ import annotations

from collections.abc import Mapping

from slide_fmu.core.measures import percent
from slide_fmu.core.web.charts import Bar
from slide_fmu.report.error_tables import accuracy_table, parameter_table, timing_table
from slide_fmu.report.frequency_charts import frequency_sections
from slide_fmu.report.html_report import Section
from slide_fmu.report.learning_charts import response_charts
from slide_fmu.report.learning_tables import response_table
from slide_fmu.report.trajectory_charts import phase_charts, trajectory_charts
from slide_fmu.report.trust_sections import bound_sections, estimate_section
from slide_fmu.report.validity import RULE, is_ruled, judgement_table, judgements
from slide_fmu.report.worst_windows import worst_section
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import System
from slide_fmu.validation.comparison import Validation, meaning_of
from slide_fmu.validation.error_figures import ResponseFigures, ValidationFigures
from slide_fmu.validation.record_noise import ORIGINS, origin_of_noise
from slide_fmu.validation.response import exact_matrix, learnt_matrix, response_figures

PHASE = (
    "Every output over its speed, around the largest error of its worst trajectory, as splines "
    "through the samples: a wrong period shows as curves that come apart, a wrong rest as curves "
    "about different places."
)

MODEL_TEXT = (
    " The reference is a finer model than the one that made the data; what that one errs on the "
    "same inputs stands beside the surrogate's error."
)


def validation_sections(validations: Mapping[str, Validation]) -> list[Section]:
    """Return the sections on the accuracy; the first validation is the one in range."""
    main = next(iter(validations.values()))
    figures = {name: validation.figures() for name, validation in validations.items()}
    in_range = next(iter(figures.values()))
    worst, phases = worst_section(main), phase_charts(main)
    sections = [
        Section(
            "Side by side with the reference",
            _compared(main)
            + (MODEL_TEXT if main.recipe.system.reference else "")
            + moving_text(main.surrogate, main.recipe.system.is_record),
            accuracy_table(figures),
            charts=trajectory_charts(main),
        ),
        _kinds_section(in_range, main.recipe.system.is_record),
        _validity_section(main, figures),
        *frequency_sections(main),
        *([Section("Phase plot", PHASE, charts=phases)] if phases else []),
        *([] if worst is None else [worst]),
    ]
    if in_range.parameters is not None:
        text = about_parameters(main.recipe.system.is_record)
        table = parameter_table(in_range.parameters)
        sections.append(Section("Physical parameters", text, table))
    if main.surrogate.estimates_errors:
        sections.append(estimate_section(validations, figures))
    if main.surrogate.bound is not None:
        sections += bound_sections(validations, figures)
    text = "Both measured in one run on one machine."
    sections.append(Section("Time per step", text, timing_table(in_range.timing)))
    return sections


def _kinds_section(figures: ValidationFigures, is_record: bool) -> Section:
    """Show the relative RMSE by kind of excitation, the largest over the outputs."""
    bars = []
    for kind in figures.excitations:
        error, count = max(kind.relative_rmse), kind.trajectories
        many = f"{count} trajector{'y' if count == 1 else 'ies'}"
        bars.append(Bar(kind.name, error, f"{percent(error)}, {many}"))
    return Section(
        "By file" if is_record else "By kind of excitation",
        "Relative RMSE: RMSE of the FMU over the RMS of the reference about its mean; of several "
        "outputs the largest.",
        bars=bars,
    )


def _validity_section(main: Validation, figures: Mapping[str, ValidationFigures]) -> Section:
    """Return the section that says in words where the surrogate is valid."""
    found = judgements(main.surrogate, main.recipe, figures)
    text = RULE if is_ruled(found) else ""
    return Section("Where it is valid", text, judgement_table(found))


def moving_text(surrogate: Surrogate, is_record: bool) -> str:
    """Say what is set before a step, of inputs with a first-order hold; nothing of others."""
    if surrogate.hold == "zero_order":
        return ""
    return (
        f" {'The FMU is' if is_record else 'Both FMUs are'} told what the inputs reach by each "
        "step's end. An importer that sets what they are at its start, which is all that a plain "
        "simulation does, has the errors of the "
        f'column "inputs set to what they are now": {meaning_of(surrogate)}.'
    )


def response_section(surrogate: Surrogate, system: System) -> tuple[Section, ResponseFigures]:
    """Show the learnt response matrix of an affine surrogate against the exact one."""
    learnt, exact = learnt_matrix(surrogate), exact_matrix(system, surrogate.window)
    found = response_figures(learnt, exact)
    text = (
        "Every row is one output sample of the window, every column one input sample. Entries "
        "above the diagonal would mean that an output answers to a later input."
    )
    charts = response_charts(learnt, exact, surrogate)
    return Section("Response matrix", text, response_table(found), charts=charts), found


def about_parameters(is_record: bool) -> str:
    """Say at which values of the physical parameters the errors in their table were measured."""
    where = (
        "Every stretch has the values of its specimen."
        if is_record
        else "Every trajectory has values of the physical parameters that no training saw; one "
        "more is at each corner of their ranges, which the figures above do not count."
    )
    return f"{where} Relative RMSE is the largest of the outputs."


def _compared(validation: Validation) -> str:
    """Say what was compared with what."""
    count = len(validation.comparisons)
    if validation.recipe.system.is_record:
        return (
            f"{count} blocks of the records that nothing was learnt or chosen from, and the FMU "
            "run on their inputs. What was measured has noise of its own, which no surrogate can "
            f"predict: its RMS is known {ORIGINS[origin_of_noise(validation.recipe)]}. Run "
            "freely, never handed over from window to window, the network begins with the state "
            "that the lead of a block shows."
        )
    return (
        f"{count} trajectories that no training saw (seed {validation.task.seed}): the FMU, "
        "run by an importer, next to the reference system, simulated on the same inputs."
    )
