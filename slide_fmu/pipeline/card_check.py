"""This module compares the statements of an FMU about itself in several places.

The model card follows from the surrogate and its provenance. So it is written again here, and
compared with the card in the FMU; apps compare their own files likewise. Versions differ in their
words, so this holds for files that this version wrote.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from difflib import SequenceMatcher
from itertools import zip_longest
from pathlib import Path

from slide_fmu.core.version import other_writer
from slide_fmu.core.xml_differences import apart
from slide_fmu.fmu.export import PROVENANCE, Provenance, read_member
from slide_fmu.pipeline.apps import check_origins
from slide_fmu.pipeline.documents import CARD
from slide_fmu.pipeline.run_folder import recipe_of_provenance
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.report.fmu_description import FmuDescription
from slide_fmu.report.model_card import model_card
from slide_fmu.surrogate.surrogate import Surrogate

SHOWN = 3
"""Number of differences of each file that are named."""

REMEDY = (
    "one of the two was edited, or another version of slide-fmu wrote them; get the file again, "
    "or make it anew (slide-fmu run)"
)


def card_problems(fmu: Path, surrogate: Surrogate, provenance: Provenance | None) -> list[str]:
    """Compare the model card of an FMU with the card that follows from its provenance.

    The card of another version has other words and is not compared.

    Args:
        fmu: the file of an FMU, whose archive has no problems.
        surrogate: its surrogate.
        provenance: its origin; None if unknown.

    Returns:
        The problems, each one sentence with its remedy. An FMU without provenance
        or without a card has none.
    """

    content = read_member(fmu, CARD)
    if content is None:
        return []

    def compare(recipe: Recipe) -> Iterator[str]:
        check_origins(surrogate, provenance)
        described = FmuDescription.of(surrogate, provenance)
        if described.measured is None:
            yield f"{CARD} is there, but {PROVENANCE} has no measured errors; {REMEDY}"
            return
        if other_writer(provenance) is not None:
            return
        card = model_card(described)
        expected = _lines(card)
        pairs = _other_lines(_lines(content.decode("utf-8", "replace")), expected)
        others = (f"{apart(ours, its)!r}; expected {apart(its, ours)!r}" for ours, its in pairs)
        yield from disagreements(CARD, others)

    return compared_with_provenance(fmu, provenance, compare)


def compared_with_provenance(
    fmu: Path, provenance: Provenance | None, compare: Callable[[Recipe], Iterable[str]]
) -> list[str]:
    """Return the problems that a comparison with the recipe of an FMU finds.

    Args:
        fmu: the file of the FMU.
        provenance: its origin; None, and nothing is compared, if unknown.
        compare: takes the recipe and gives the problems; if it fails, the provenance counts as
            damaged.
    """
    if provenance is None:
        return []
    try:
        return list(compare(recipe_of_provenance(provenance, str(fmu))))
    except (AttributeError, ArithmeticError, IndexError, LookupError, TypeError, ValueError) as e:
        return [
            f"{PROVENANCE} is not in the form that slide-fmu writes ({type(e).__name__}: {e}); "
            "expected recipe, seeds, versions and measured errors: get the file again"
        ]


def _lines(text: str) -> list[str]:
    """Return the lines that are not empty; left-out pictures leave empty ones."""
    return [line for line in text.split("\n") if line.strip()]


def _other_lines(lines: list[str], expected: list[str]) -> Iterator[tuple[str, str]]:
    """Pair lines that differ; the other one is empty where a line is too many."""
    matcher = SequenceMatcher(None, lines, expected, autojunk=False)
    for tag, first, last, first_of, last_of in matcher.get_opcodes():
        if tag != "equal":
            yield from zip_longest(lines[first:last], expected[first_of:last_of], fillvalue="")


def disagreements(member: str, differences: Iterable[str]) -> Iterator[str]:
    """Name the places in which a member of an FMU differs from its provenance."""
    others = list(differences)
    for other in others[:SHOWN]:
        yield f"{member} does not say what {PROVENANCE} says: {other}; {REMEDY}"
    if len(others) > SHOWN:
        yield f"{member} has {len(others) - SHOWN} further differences from {PROVENANCE}"
