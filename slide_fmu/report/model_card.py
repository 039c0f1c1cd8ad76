"""The model card of a released FMU says what it is, how wrong it is, and how it was made."""

from __future__ import annotations

import html
from collections.abc import Sequence
from typing import Any

import jinja2

from slide_fmu.core.units import NO_UNIT, behind
from slide_fmu.excitation.mix import names_of
from slide_fmu.fmu.description.surrogate_variables import Variable, fmu_variables
from slide_fmu.memory.decay_figures import seconds
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.report.importer_sections import box_rows, box_text, plain_call_rows, whole
from slide_fmu.report.limits import ordered, useless_beyond
from slide_fmu.report.tables import about_parameters, parameter_rows
from slide_fmu.report.trust_sentences import COLUMNS, HARM, bound_sentences, search_sentence
from slide_fmu.report.trust_tables import bound_rows, estimate_rows, harm_rows, kind_rows
from slide_fmu.report.validity import judgement_sentences, judgements
from slide_fmu.report.verdict import Subject, verdict
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation.comparison import meaning_of
from slide_fmu.validation.motions import motions_of
from slide_fmu.validation.plain_call import TEXT
from slide_fmu.validation.record_noise import ORIGINS, origin_of_noise


def model_card(
    surrogate: Surrogate,
    recipe: Recipe,
    measured: dict[str, Any],
    picture: str,
    mechanism: str | None = None,
) -> str:
    """Write the model card as Markdown.

    Args:
        surrogate: what the FMU runs.
        recipe: what it was made from.
        measured: the figures of the report, live or as an FMU keeps them.
        picture: file name of the picture beside the card.
        mechanism: file name of a picture of the system, beside the card; None if there is none.
    """
    validations = ordered(measured)
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("slide_fmu.report"),
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.filters["behind"] = behind
    environment.filters["percent"] = lambda value: f"{100 * value:.3g} %"
    environment.filters["seconds"] = seconds
    environment.filters["plain"] = plain
    environment.filters["escaped"] = lambda text: html.escape(text, quote=False)
    return environment.get_template("card.md").render(
        variables=variable_table(surrogate),
        surrogate=surrogate,
        recipe=recipe,
        measured={**measured, "validation": validations},
        verdict=verdict(measured, Subject.of(surrogate)),
        names=[motion.name for motion in motions_of(recipe)],
        further_names=names_of(recipe.further_kinds()),
        moving=all("plain_relative_rmse" in o for v in validations.values() for o in v["outputs"]),
        now_text=meaning_of(surrogate),
        **_about_plain_call(measured),
        box_rows=box_rows(measured["box"]) if "box" in measured else [],
        box_text=box_text(measured.get("box", {})),
        parameter_rows=_parameter_rows(validations),
        about_parameters=about_parameters(recipe.system.is_record),
        estimate_rows=estimate_rows(_named(validations)) if surrogate.estimates_errors else [],
        judgements=[
            plain(sentence)
            for sentence in judgement_sentences(judgements(surrogate, recipe, validations))
        ],
        **_about_bound(surrogate, recipe, measured),
        noise_origin=ORIGINS[origin_of_noise(recipe)],
        useless=useless_beyond(measured),
        picture=picture,
        mechanism=mechanism,
    )


def _about_plain_call(measured: dict[str, Any]) -> dict[str, Any]:
    """Return what the card shows of the plain call; nothing where it was not measured."""
    found = measured.get("plain_call")
    if found is None:
        return {"plain_rows": []}
    return {"plain_rows": plain_call_rows(found), "plain_text": f"{TEXT} {whole(found)}"}


def _parameter_rows(validations: dict[str, Any]) -> list[Sequence[str]]:
    """Return the table of the errors by physical parameters; nothing where there are none."""
    found = next(iter(validations.values())).get("parameters")
    return [] if found is None else parameter_rows(found)


def _named(validations: dict[str, Any]) -> dict[str, Any]:
    """Return the validations by names that say at which amplitudes they are."""
    found = {}
    for name, validation in validations.items():
        low, high = validation["amplitude"]
        inside = low == high == 1
        found[name if inside else f"{name} ({low} to {high} times the amplitude)"] = validation
    return found


def _about_bound(surrogate: Surrogate, recipe: Recipe, measured: dict[str, Any]) -> dict[str, Any]:
    """Return what the card says of the error bound; nothing where there is none."""
    validations, search = ordered(measured), measured.get("adversarial")
    if surrogate.bound is None:
        return {"bound_tables": []}
    named = _named(validations)
    return {
        "bound_sentences": bound_sentences(
            recipe, surrogate.hold == "first_order", next(iter(validations.values()))
        ),
        "bound_tables": [bound_rows(named), kind_rows(named)],
        "bound_columns": COLUMNS,
        "harm_rows": harm_rows(named),
        "harm_columns": HARM,
        "search": search_sentence(search) if search else "",
    }


def plain(text: str) -> str:
    """Return a user's text as one line that Markdown shows as it is, in tables too."""
    return " ".join(html.escape(text, quote=False).replace("|", "\\|").split())


def variable_table(surrogate: Surrogate) -> str:
    """Return the FMU's variables in the order of their value references, as Markdown table."""
    rows = [
        f"| `{v.name}` | {v.causality} | {plain(behind(v.unit or NO_UNIT))} | {_range_of(v)} "
        f"| {plain(v.description)} |"
        for v in fmu_variables(surrogate)
    ]
    return "\n".join(
        ["| variable | causality | unit | range | |", "| --- | --- | --- | --- | --- |", *rows]
    )


def _range_of(variable: Variable) -> str:
    if variable.type == "Boolean":
        return "false, true"
    if variable.low is None or variable.high is None:
        return ""
    return f"{variable.low:.4g} .. {variable.high:.4g}"


def without_pictures(card: str) -> str:
    """Return a model card without the pictures that lie beside it; the report shows them."""
    lines = card.split("\n")
    return "\n".join(line for line in lines if not line.startswith("!["))
