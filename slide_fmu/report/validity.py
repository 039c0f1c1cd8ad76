"""This module judges for which kinds of inputs a surrogate is valid, from measured samples."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from slide_fmu.core.measures import percent
from slide_fmu.excitation.words import between
from slide_fmu.recipe.model_rules import rules_of
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.report.table import ReportTable
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation.error_figures import ValidationFigures
from slide_fmu.validation.trust import HARMFUL
from slide_fmu.validation.trust_figures import Harm

MOST_HARMFUL = 0.02
"""Largest share of harmful samples of a valid kind of inputs."""

MOST_UNNOTICED = 0.01
"""Largest share of harmful samples of a valid kind that neither flag nor bound reports."""

MOSTLY = 0.5
"""Bounds do not count for a kind if a larger share of its harmless samples is flagged."""

VALID = "valid"
FLAGGED = "valid, but flagged"
NOTICED = "not valid, and the FMU says so"
SILENT = "not valid, and the FMU does not always say so"
TRAINED, HELD_OUT, BEYOND = "trained on", "not trained on", "beyond the range"
"""Names of kinds for which no harmful errors are known."""

KNOWN_CALL, PLAIN_CALL = ", known to the step's end", "in the plain call "
"""Words for the two calls of an FMU whose inputs move."""

RULE = (
    f"A sample is harmful if its error exceeds {HARMFUL:g} times the usual 95 % level. It is "
    "flagged if trusted is false, and unnoticed if it is harmful, not flagged, and above its "
    f"bound. A kind of inputs is valid if at most {percent(MOST_HARMFUL)} of its samples are "
    f"harmful and at most {percent(MOST_UNNOTICED)} unnoticed. If only the second holds, it is "
    f"not valid, and the FMU says so. Where more than {percent(MOSTLY)} of the harmless samples "
    "are flagged, a valid kind is called flagged."
)
"""Explanation of the verdicts on a surrogate."""


COLUMNS = (
    *("", "inputs", "trajectories", "relative RMSE{known}", "covered by the bound{plain}"),
    *("harmful", "of these flagged", "unnoticed", "harmless ones flagged"),
)
"""Columns of the table of judgements, with the names of the calls that were measured."""


@dataclass(frozen=True)
class Judgement:
    """A Judgement is the verdict on a kind of inputs, with their description.

    Attributes:
        verdict: one of the words above.
        inputs: description of the inputs.
        seen: ``HELD_OUT`` if the verdict does not say that no training saw them; else empty.
        trajectories: number that was measured; None if it is not known.
        error: largest relative RMSE of all outputs; None if it was not measured.
        covered: smallest share of samples below the bound, of all outputs; None without a bound.
        harm: harm of the errors; None without a bound.
        calls: names of the calls in which error, and bound and harm, were measured.
        name: by which other places name this kind; empty if none does.
    """

    verdict: str
    inputs: str
    seen: str = ""
    trajectories: int | None = None
    error: float | None = None
    covered: float | None = None
    harm: Harm | None = None
    calls: tuple[str, str] = ("", "")
    name: str = ""

    @property
    def described(self) -> str:
        """The inputs behind their name."""
        return f"{self.name}: {self.inputs}" if self.name else self.inputs

    @property
    def measured(self) -> str:
        """What was measured, in words."""
        if self.error is None:
            return "not measured"
        known, plain = self.calls
        found = [self.seen] if self.seen else []
        if self.trajectories is not None:
            found.append(
                f"{self.trajectories} trajector{'y' if self.trajectories == 1 else 'ies'}"
            )
        found.append(f"relative RMSE {percent(self.error)}{known}")
        if self.covered is not None:
            found.append(f"{plain}{percent(self.covered)} of the samples covered by the bound")
            plain = ""
        if self.harm is not None:
            harm = self.harm
            found.append(f"{plain}{percent(harm.harmful)} of the samples harmful")
            if harm.harmful_flagged is not None and harm.harmful:
                found.append(f"{percent(harm.harmful_flagged)} of these flagged")
                found.append(f"{percent(harm.harmful_unnoticed)} of all unnoticed")
            if harm.harmless_flagged:
                found.append(f"{percent(harm.harmless_flagged)} of the harmless ones flagged")
        return ", ".join(found)

    def row(self) -> tuple[str, ...]:
        """Return the cells of ``COLUMNS``."""
        harm, origin = self.harm, f" ({self.seen})" if self.seen else ""
        trajectories = "" if self.trajectories is None else str(self.trajectories)
        shares: tuple[float | None, ...] = (None,) * 4
        if harm is not None:
            shares = (
                harm.harmful,
                harm.harmful_flagged,
                harm.harmful_unnoticed,
                harm.harmless_flagged,
            )
        cells = (_or_empty(share) for share in (self.error, self.covered, *shares))
        return (f"{self.verdict}{origin}", self.described, trajectories, *cells)


def _or_empty(share: float | None) -> str:
    return "" if share is None else percent(share)


def judgements(
    surrogate: Surrogate, recipe: Recipe, validations: Mapping[str, ValidationFigures]
) -> list[Judgement]:
    """Judge all kinds of inputs that were trained on, or measured.

    Args:
        surrogate: the surrogate that the FMU runs.
        recipe: the recipe that it was made from.
        validations: figures by name; may be empty.
    """
    found: list[Judgement] = []
    rules, signals, step = rules_of(recipe), surrogate.inputs, surrogate.window.step
    learnt = rules.described(recipe, signals, step, held_out=False)
    for figures in validations.values():
        if figures.amplitude != (1.0, 1.0):
            found.append(_beyond(figures, _calls(surrogate, figures)))
        elif figures.held_out:
            held_out = rules.described(recipe, signals, step, held_out=True)
            found += _of_kinds(held_out, figures, HELD_OUT, _calls(surrogate, figures))
        else:
            found += _of_kinds(learnt, figures, TRAINED, _calls(surrogate, figures))
    named = {judgement.inputs for judgement in found}
    rest = [text for text in learnt.values() if text not in named]
    return found + [Judgement(TRAINED, text) for text in rest]


def judgement_table(found: Sequence[Judgement]) -> ReportTable:
    """Return judgements as a table."""
    known, plain = next((j.calls for j in found if any(j.calls)), ("", ""))
    plain = f", {plain}".rstrip() if plain else ""
    heading = (name.format(known=known, plain=plain) for name in COLUMNS)
    return ReportTable.of(heading, (j.row() for j in found)).without_empty_columns()


def judgement_sentences(found: Sequence[Judgement]) -> list[str]:
    """Return judgements as sentences; the rule comes last, where a verdict follows from it."""
    sentences = [f"{_upper(j.verdict)}: {j.described} ({j.measured})." for j in found]
    return [*sentences, RULE] if is_ruled(found) else sentences


def is_ruled(found: Sequence[Judgement]) -> bool:
    """Tell whether some verdicts follow from the rule."""
    return any(j.verdict in (VALID, FLAGGED, NOTICED, SILENT) for j in found)


def _of_kinds(
    kinds: Mapping[str, str],
    figures: ValidationFigures,
    unknown: str,
    calls: tuple[str, str],
) -> Iterator[Judgement]:
    """Judge the kinds that were measured; the others have no trajectories.

    ``unknown`` is the verdict on kinds without known harm; ``calls`` are those of ``_calls``.
    """
    bounds = () if figures.error_bound is None else figures.error_bound.excitations
    found = {kind.name: kind for kind in bounds}
    for kind in figures.excitations:
        if kind.name in kinds:
            bound, error = found.get(kind.name), max(kind.relative_rmse)
            harm = None if bound is None else bound.harm
            verdict = unknown if harm is None else _verdict(harm)
            yield Judgement(
                verdict,
                kinds[kind.name],
                "" if harm is None or unknown == TRAINED else unknown,
                None if bound is None else bound.trajectories,
                error,
                None if bound is None else min(bound.coverage, default=None),
                harm,
                calls,
                "" if harm is None else kind.name,
            )


def _beyond(figures: ValidationFigures, calls: tuple[str, str]) -> Judgement:
    """Judge all kinds together, at larger amplitudes."""
    bound = figures.error_bound
    harm = None if bound is None else bound.harm
    kinds = "kinds that were held out" if figures.held_out else "same kinds"
    text = f"inputs of the {kinds} at {between(figures.amplitude)} times the amplitude"
    verdict = BEYOND if harm is None else _verdict(harm)
    covered = None
    if bound is not None:
        plain = bound.plain if calls[1] else None
        known = (output.coverage for output in bound.outputs)
        covered = min(known if plain is None else plain.coverage, default=None)
    trajectories = None if harm is None else figures.trajectories
    return Judgement(verdict, text, "", trajectories, figures.worst, covered, harm, calls)


def _calls(surrogate: Surrogate, figures: ValidationFigures) -> tuple[str, str]:
    """Name the calls in which errors, and bounds and harm, were measured; where inputs move."""
    if not figures.moving:
        return "", ""
    return KNOWN_CALL, "" if surrogate.planned else PLAIN_CALL


def is_valid(harm: Harm) -> bool:
    """Tell whether a kind of inputs is valid, by its harmful samples."""
    return harm.harmful <= MOST_HARMFUL and harm.harmful_unnoticed <= MOST_UNNOTICED


def _verdict(harm: Harm) -> str:
    if not is_valid(harm):
        return NOTICED if harm.harmful_unnoticed <= MOST_UNNOTICED else SILENT
    return FLAGGED if (harm.harmless_flagged or 0.0) > MOSTLY else VALID


def _upper(text: str) -> str:
    return text[0].upper() + text[1:]
