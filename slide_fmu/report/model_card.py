"""The model card describes a released FMU: its use, its errors, and its origin."""

from __future__ import annotations

import html
from collections.abc import Mapping

import jinja2

from slide_fmu.core.measures import percent
from slide_fmu.core.readable import decimal, quantity
from slide_fmu.core.units import NO_UNIT, behind
from slide_fmu.excitation.mix import names_of
from slide_fmu.fmu.description.surrogate_variables import Variable, fmu_variables
from slide_fmu.memory.decay_figures import seconds
from slide_fmu.recipe.model_rules import rules_of
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.report.accuracy_sections import about_parameters
from slide_fmu.report.error_tables import box_table, parameter_table, plain_call_table
from slide_fmu.report.importer_sections import box_text, loop_sentences, whole
from slide_fmu.report.limits import meaning_of, useless_beyond
from slide_fmu.report.run_figures import RunFigures
from slide_fmu.report.table import ReportTable, markdown
from slide_fmu.report.trust_sentences import COLUMNS, HARM, bound_sentences, search_sentence
from slide_fmu.report.trust_tables import (
    bound_table,
    estimate_table,
    harm_table,
    kind_table,
    tolerance_table,
)
from slide_fmu.report.validity import RULE, is_ruled, judgement_table, judgements
from slide_fmu.report.verdict import Subject, verdict
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation.error_figures import ValidationFigures
from slide_fmu.validation.plain_call import TEXT


def model_card(
    surrogate: Surrogate,
    recipe: Recipe,
    measured: RunFigures,
    picture: str,
    mechanism: str | None = None,
) -> str:
    """Write the model card as Markdown.

    Args:
        surrogate: the surrogate that the FMU runs.
        recipe: the recipe that it was made from.
        measured: the figures of the report.
        picture: file name of the picture in the folder of the card.
        mechanism: file name of a picture of the system, in the same folder; None without one.
    """
    validations, rules = measured.ordered, rules_of(recipe)
    named, call, box = _named(validations), measured.plain_call, measured.box
    parameters = measured.in_range.parameters
    judged = judgements(surrogate, recipe, validations)
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("slide_fmu.report"),
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.filters["decimal"] = decimal
    environment.filters["quantity"] = quantity
    environment.filters["percent"] = percent
    environment.filters["markdown"] = markdown
    environment.filters["seconds"] = seconds
    environment.filters["plain"] = plain
    environment.filters["escaped"] = lambda text: html.escape(text, quote=False)
    return environment.get_template("card.md").render(
        variables=variable_table(surrogate),
        surrogate=surrogate,
        recipe=recipe,
        measured=measured,
        validations=validations,
        verdict=verdict(measured, Subject.of(surrogate)),
        words=rules.words,
        names=[motion.name for motion in rules.motions(recipe)],
        names_of=names_of,
        other_kinds={
            "It has learnt from these too, but is not measured on them:": (
                recipe.kinds_of_training()
            ),
            "Its error bound alone has learnt from these too, by which it was not calibrated:": (
                recipe.further_kinds()
            ),
        },
        moving=all(validation.moving for validation in validations.values()),
        now_text=meaning_of(surrogate),
        plain_table=None if call is None else plain_call_table(call),
        plain_text="" if call is None else f"{TEXT} {whole(call)}",
        box_table=None if box is None else box_table(box),
        box_text="" if box is None else box_text(box),
        parameter_table=None if parameters is None else parameter_table(parameters),
        about_parameters=about_parameters(recipe),
        estimate_table=estimate_table(named),
        judgement_table=_plain_table(judgement_table(judged)),
        rule=RULE if is_ruled(judged) else "",
        bound_tables=_bound_tables(named) if surrogate.bound is not None else [],
        bound_sentences=_bound_sentences(surrogate, recipe, measured),
        bound_columns=COLUMNS,
        harm_table=harm_table(named),
        harm_columns=HARM,
        search="" if measured.adversarial is None else search_sentence(measured.adversarial),
        loops=loop_sentences(measured.loops),
        noise_origin=rules.origin_of_noise(recipe),
        useless=useless_beyond(measured),
        picture=picture,
        mechanism=mechanism,
    )


def _named(validations: Mapping[str, ValidationFigures]) -> dict[str, ValidationFigures]:
    """Return the validations; each name gives the range of amplitudes."""
    found = {}
    for name, validation in validations.items():
        low, high = validation.amplitude
        inside = low == high == 1
        found[name if inside else f"{name} ({low} to {high} times the amplitude)"] = validation
    return found


def _bound_tables(validations: Mapping[str, ValidationFigures]) -> list[ReportTable]:
    tables = [bound_table(validations), kind_table(validations), tolerance_table(validations)]
    return [table for table in tables if table.rows]


def _bound_sentences(surrogate: Surrogate, recipe: Recipe, measured: RunFigures) -> list[str]:
    """Return the sentences on the error bound; no sentence without a bound."""
    if surrogate.bound is None:
        return []
    return bound_sentences(recipe, surrogate, measured.in_range)


def plain(text: str) -> str:
    """Return a user's text as one line that Markdown shows as it is, in tables too."""
    return " ".join(html.escape(text, quote=False).replace("|", "\\|").split())


def _plain_table(table: ReportTable) -> ReportTable:
    """Return a table whose cells Markdown shows as they are."""
    return ReportTable.of(table.heading, (map(plain, row) for row in table.rows))


def variable_table(surrogate: Surrogate) -> ReportTable:
    """Return the FMU's variables in the order of their value references."""
    rows = (
        (
            f"`{v.name}`",
            v.causality,
            plain(behind(v.unit or NO_UNIT)),
            _range_of(v),
            plain(v.description),
        )
        for v in fmu_variables(surrogate)
    )
    return ReportTable.of(("variable", "causality", "unit", "range", ""), rows)


def _range_of(variable: Variable) -> str:
    if variable.type == "Boolean":
        return "false, true"
    if variable.low is None or variable.high is None:
        return ""
    return f"{decimal(variable.low, 4)} .. {decimal(variable.high, 4)}"


def without_pictures(card: str) -> str:
    """Return a model card without pictures, which are separate files; the report shows them."""
    lines = card.split("\n")
    return "\n".join(line for line in lines if not line.startswith("!["))
