"""Sentences explain where error bounds count, and what inputs outside of the domain mean."""

from __future__ import annotations

from slide_fmu.core.measures import percent
from slide_fmu.core.readable import quantity, ratio_text
from slide_fmu.recipe.error_bound import BoundRecipe
from slide_fmu.recipe.recipe import FURTHER, Recipe
from slide_fmu.surrogate.error_bound import calibrated
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation.error_figures import ValidationFigures
from slide_fmu.validation.trust import BROKEN, HARMFUL, OFTEN
from slide_fmu.validation.trust_figures import BoundFigures, SearchFigures, TryFigures

COLUMNS = (
    "A sample is covered if its error stays below the bound. The width is the mean bound over the "
    "95 % quantile of the errors: a constant that knows all of them has 1. The skill is the part "
    "of the pinball loss that the bound saves against the best constant: with 100 % it would "
    "be the error itself, with 0 % it says no more than the constant. The rank correlation is "
    "between bound and error. A trajectory is outside of the domain if more than "
    f"{percent(OFTEN)} of its samples are."
)
"""Explanation of the columns of ``slide_fmu.report.trust_tables.bound_table``."""


HARM = (
    f"A sample is harmful if an error is more than {HARMFUL:g} times the 95 % quantile of the "
    "errors in range. The last column matters most: harmful errors that the FMU does not report."
)
"""Explanation of the columns of ``slide_fmu.report.trust_tables.harm_table``."""


TOLERANCES = (
    "The flag trusted is false where a 95 % bound exceeds its tolerance. Smaller tolerances find "
    "more errors and give more alarms. A row has the tolerances with which this share of the "
    "samples in range is flagged; domain and ranges are included. Set them by the parameters "
    "<output>_error_tolerance."
)
"""Explanation of ``slide_fmu.report.trust_tables.tolerance_table``."""


def search_sentence(figures: SearchFigures) -> str:
    """Give the result of the search for unnoticed errors (``validation.adversarial``)."""
    return " ".join([_noise_sentence(figures), *tries_sentences(figures)])


def tries_sentences(figures: SearchFigures) -> list[str]:
    """Give the results on inputs as users set them; none where none was tried."""
    if not figures.tries:
        return []
    count, worst = len(figures.tries), figures.tries[0]
    broken = sum(one.over_bound > BROKEN for one in figures.tries)
    failed = figures.failed_tries
    return [
        f"A search tried {count} inputs as users set them: tones, offsets, holds and "
        "limits; the second half of them near the worst one.",
        f"On {broken} of {count} an error was more than {BROKEN:g} times its bound of 95 % while "
        "trusted is true.",
        *([f"On {failed} more the reference failed."] if failed else []),
        *_worst_sentences(worst),
    ]


def _worst_sentences(worst: TryFigures) -> list[str]:
    """Describe the worst try, so that it can be repeated."""
    relative = worst.relative_rmse
    return [
        f"The worst, by its error and its bound together, was {worst.kind}: {worst.inputs}.",
        f"There an error was {ratio_text(worst.over_bound)} times its bound.",
        f"Over the whole record, the largest error of {worst.output} is "
        f"{quantity(worst.largest_error, worst.unit)}"
        + ("." if relative is None else f", and its relative RMSE {percent(relative)}."),
        f"Of the samples {percent(worst.harmful)} are harmful, and {percent(worst.unnoticed)} "
        "are harmful and not reported.",
    ]


def _noise_sentence(figures: SearchFigures) -> str:
    usual, highest = (f"{100 * value:g} %" for value in figures.confidences)
    every = figures.before, figures.after, figures.after_highest
    before, after, above = (ratio_text(max(ratios)) for ratios in every)
    starts = figures.starts
    at_first = sum(ratio > BROKEN for ratio in figures.before)
    return (
        f"A search within the ranges of the inputs, from {starts} unseen trajectories, "
        f"found an error at trusted steps of {after} times its bound of {usual} (before the "
        f"search: {before}), and of {above} times its bound of {highest}. Errors of more than "
        f"{BROKEN:g} times the bound of {usual} were found from {figures.broken} of {starts} "
        f"starts (before the search: {at_first}), of {highest} from {figures.broken_at_highest}."
    )


def covered_sentence(bound: BoundFigures) -> str | None:
    """Give the share of samples that bounds cover in both calls; None with held inputs."""
    if bound.plain is None or bound.known_to_step_end is None:
        return None
    plain, known = (
        ", ".join(map(percent, covered.coverage))
        for covered in (bound.plain, bound.known_to_step_end)
    )
    known_words = "with inputs known to the step's end"
    text = f"Covered samples in the plain call: {plain}; {known_words}: {known}."
    both = bound.plain.untrusted, bound.known_to_step_end.untrusted
    rest, known = map(percent, both)
    return (
        f"{text} Samples where trusted is false: {rest} in the plain call, {known} {known_words}."
    )


def bound_sentences(
    recipe: Recipe, surrogate: Surrogate, measured: ValidationFigures | None
) -> list[str]:
    """Say where bounds count, and how the FMU reports that they do not.

    Args:
        recipe: the recipe of the FMU; it has the table ``bound``.
        surrogate: the surrogate of the FMU.
        measured: the figures in range of the FMU's validation; None where it was not measured.
    """
    assert recipe.bound is not None
    moving = surrogate.hold == "first_order"
    low, *_, high = (f"{100 * c:g}" for c in calibrated(recipe.count("calibration")))
    found = [
        "Error bounds count for inputs of the kinds that the surrogate was trained on: they were "
        f"calibrated by {recipe.count('calibration')} trajectories of the same mix.",
        "There, at least this share of the samples has an error below the bound, averaged over "
        f"trajectories: the confidence, {low} to {high} %. A single trajectory, a single kind, or "
        "the samples with the largest errors may be covered less.",
        "Where in_domain is false, the bound is not calibrated, and may be far too small: inputs "
        "have left their ranges, or the surrogate and its companion are further apart, or move "
        "more, than is usual on the calibration.",
        "For inputs of other kinds, in_domain = true proves nothing.",
    ]
    if recipe.further_kinds():
        found.append(
            f"Bounds have also learnt from {recipe.count(FURTHER)} trajectories of further kinds "
            "of inputs; nothing was calibrated by them."
        )
    if recipe.system.reference:
        found.append(
            "Error bounds were calibrated against the model that made the data: the error of that "
            "model against the finer reference is not in them."
        )
    if moving:
        found.append(
            "Error bounds were calibrated with inputs known to the step's end. Where the FMU "
            "forecasts them, it measures what that changed in the outputs of the last steps, and "
            "adds it to the bound, whatever the communication step is. "
            + (
                "Inputs that jump at any time within a step were calibrated, too."
                if recipe.data.jumps
                else "Where an input jumps, in_domain is false until the jump has left the memory."
            )
        )
    bound = None if measured is None else measured.error_bound
    covered = None if bound is None else covered_sentence(bound)
    found += [] if covered is None else [covered]
    call = " with inputs known to the step's end" if moving else ""
    return [*found, *_sentences_on_trust(recipe.bound, bound, call)]


def _sentences_on_trust(recipe: BoundRecipe, bound: BoundFigures | None, call: str) -> list[str]:
    """Say when trusted is false, and how often it is in range, in a call with these words."""
    found = [
        "Where trusted is false, a step may be wrong: a 95 % bound exceeds its tolerance, "
        "in_domain or a range is false, or error_bound_filled is below 1. Tolerances are "
        "parameters, one of each output.",
    ]
    wanted, of_domain = percent(recipe.false_alarms), percent(recipe.domain_alarms)
    calibrated_to = (
        f"trusted was false for at most {wanted} of the samples of the calibration, and in_domain "
        f"for {of_domain}."
    )
    if bound is None:
        return [*found, f"With the tolerances of the start, {calibrated_to}"]
    return [
        *found,
        f"False alarms{call}, with the tolerances of the start: of the samples in range, trusted "
        f"is false for {percent(bound.untrusted)} and in_domain for {percent(bound.flagged)}; "
        f"{calibrated_to}",
    ]
