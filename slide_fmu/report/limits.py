"""Sentences name the limits of use of a surrogate, for its report and its credentials."""

from __future__ import annotations

from slide_fmu.core.measures import percent
from slide_fmu.recipe.model_rules import rules_of
from slide_fmu.recipe.recipe import FURTHER, Recipe
from slide_fmu.report.fmu_description import FmuDescription
from slide_fmu.report.loop_sections import loop_sentences
from slide_fmu.report.prose import sentences
from slide_fmu.report.run_figures import RunFigures
from slide_fmu.surrogate.description import SurrogateDescription
from slide_fmu.surrogate.error_bound import calibrated
from slide_fmu.validation.row import SEARCH

UNUSABLE = 0.2
"""Relative RMSE beyond the range above which a limit is given."""

START_VALUES = {
    True: "the FMU forecasts what they do within the step, until they are set again",
    False: "the FMU takes them as reached by the step's end, as its parameter inputs_at_step_end "
    "says, and answers one step late",
}
"""What the FMU does with inputs that an importer sets to their values at the start of a step, by
whether it forecasts inputs."""


def limits(described: FmuDescription, recipe: Recipe) -> list[str]:
    """Return the limits within which a surrogate can be trusted, one or few sentences each.

    Args:
        described: the FMU, measured or not.
        recipe: the recipe that it was made from.
    """
    surrogate, measured = described.surrogate, described.measured
    return sentences(
        "limits.txt",
        surrogate=surrogate,
        measured=measured,
        trained_on=rules_of(recipe).words.trained_on,
        held_out=measured and any(one.held_out for one in measured.validation.values()),
        start_values=START_VALUES[surrogate.forecasts_inputs],
        of_bound=bound_sentences(surrogate, recipe) if surrogate.error_bound else (),
        useless=[] if measured is None else useless_beyond(measured),
        of_loops=[] if measured is None else loop_sentences(measured.loops),
        searched=[] if measured is None else _searched(measured),
    )


def bound_sentences(surrogate: SurrogateDescription, recipe: Recipe) -> list[str]:
    """Say where bounds count, and how the FMU reports that they do not.

    Args:
        surrogate: a surrogate with an error bound.
        recipe: its recipe, which has the table ``bound``.
    """
    assert recipe.bound is not None
    calibration = recipe.count("calibration")
    return sentences(
        "bound.txt",
        calibration=calibration,
        calibrated_by=rules_of(recipe).words.calibrated_by,
        confidences=[percent(one) for one in calibrated(calibration)],
        further=recipe.count(FURTHER) if recipe.further_kinds() else 0,
        finer_reference=bool(recipe.system.reference),
        tolerances=surrogate.tolerance_text,
        false_alarms=percent(recipe.bound.false_alarms),
        domain_alarms=percent(recipe.bound.domain_alarms),
    )


def useless_beyond(measured: RunFigures) -> list[str]:
    """Say at which amplitudes beyond the range the error of the surrogate is too large."""
    return [
        f"at {validation.amplitude[0]} to {validation.amplitude[1]} times the amplitude its "
        f"relative RMSE is up to {percent(validation.worst)}"
        for validation in measured.ordered.values()
        if validation.amplitude[1] > 1.0 and validation.worst > UNUSABLE
    ]


def _searched(measured: RunFigures) -> list[object]:
    """Return the rows of a search for unnoticed errors in the plain call, at the own step."""
    rows = (row for row in measured.rows if row.group == SEARCH and row.is_at("plain", 1.0))
    return [row for row in rows if row.over_bound is not None]
