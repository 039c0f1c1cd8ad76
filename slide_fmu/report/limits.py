"""Sentences name the limits of use of a surrogate, for its card and its credentials."""

from __future__ import annotations

from collections.abc import Sequence

from slide_fmu.core.measures import percent
from slide_fmu.core.readable import ratio_text
from slide_fmu.recipe.model_rules import rules_of
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.report.loop_sections import loop_sentences
from slide_fmu.report.run_figures import RunFigures
from slide_fmu.report.trust_sections import bound_sentences
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation.row import SEARCH, Row

UNUSABLE = 0.2
"""Relative RMSE beyond the range above which a limit is given."""


def useless_beyond(measured: RunFigures) -> list[str]:
    """Say at which amplitudes beyond the range the error of the surrogate is too large."""
    found = []
    for validation in measured.ordered.values():
        low, high = validation.amplitude
        if high > 1.0 and validation.worst > UNUSABLE:
            found.append(
                f"at {low} to {high} times the amplitude its relative RMSE is up to "
                f"{percent(validation.worst)}"
            )
    return found


def meaning_of(surrogate: Surrogate) -> str:
    """Say how the FMU uses inputs that an importer sets to their values at the start of a step."""
    if surrogate.inputs_at_step_end:
        return (
            "the FMU takes them as reached by the step's end, as its parameter inputs_at_step_end "
            "says, and answers one step late"
        )
    return "the FMU forecasts what they do within the step, until they are set again"


def limits(surrogate: Surrogate, recipe: Recipe, measured: RunFigures | None) -> list[str]:
    """Return the limits within which the surrogate can be trusted, one sentence each.

    Args:
        surrogate: the surrogate that the FMU runs.
        recipe: the recipe that it was made from.
        measured: the figures of its report; None where it was not measured.
    """
    kinds = rules_of(recipe).words.trained_on
    window = surrogate.network.memory_length * surrogate.window.step
    held_out = measured and any(found.held_out for found in measured.validation.values())
    found = [
        f"How it answers to inputs of other kinds than the {kinds} that it was trained on is "
        + ("known of those alone that were held out and measured." if held_out else "not known."),
        "Outside the ranges of its inputs nothing is known but what was measured beyond the "
        "range; the output inputs_in_range is false there.",
        f"Its outputs count from {window:.6g} s after the start on, when the output window_filled "
        "is 1; before, the inputs before the start are assumed.",
    ]
    if surrogate.hold == "first_order":
        found.append(
            "Of inputs that an importer sets to their values at the start of a step, "
            f"{meaning_of(surrogate)}."
        )
    if surrogate.parameters:
        found.append("Values of physical parameters outside their ranges are refused.")
    if surrogate.estimator is not None:
        found.append(
            "An error estimate never exceeds the largest error that its training knew; read one "
            "beyond the range as a lower bound."
        )
    if surrogate.bound is not None and surrogate.bound.span is not None:
        found.append(
            "An error estimate is made of what the bound's head expects: outside of the domain, "
            "read one as a lower bound."
        )
    if surrogate.bound is not None:
        judged = surrogate.bound.filling_length * surrogate.window.step
        found.append(
            f"Error bounds, in_domain and trusted count from {judged:.6g} s after the start on, "
            "when error_bound_filled is 1; before, trusted is false if there is such an output."
        )
        found += bound_sentences(recipe, surrogate)
    if measured is None:
        return [*found, "The error of this surrogate has not been measured."]
    return [*found, *_measured_limits(measured)]


def search_sentences(rows: Sequence[Row]) -> list[str]:
    """Say what the search for unnoticed errors has found, if there was one."""
    return [
        f"A search within the ranges of the inputs, from {row.trajectories} unseen trajectories, "
        f"found an error of {ratio_text(row.over_bound)} times its bound of 95 % while trusted is "
        "true."
        for row in rows
        if row.group == SEARCH and row.over_bound is not None and row.is_at("plain", 1.0)
    ]


def _measured_limits(measured: RunFigures) -> list[str]:
    found = [f"Do not use the surrogate there: {text}." for text in useless_beyond(measured)]
    if measured.stability:
        largest = max(test.amplitude for test in measured.stability)
        found.append(
            "Whether it forgets its past and stays bounded was not tested at more than "
            f"{largest:g} times the trained amplitude."
        )
    found += loop_sentences(measured.loops)
    found += search_sentences(measured.rows)
    remarks = [*(measured.record_remarks or ()), *filter(None, [measured.remark])]
    return found + [f"{remark[0].upper()}{remark[1:]}." for remark in remarks]
