"""What an FMU says of itself in several places is held against each other.

Metadata and model card follow from the surrogate and its provenance. So they are written again
here, and compared with those that the FMU carries.
"""

from __future__ import annotations

from collections.abc import Iterator
from difflib import SequenceMatcher
from itertools import zip_longest
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from slide_fmu.core.xml_differences import apart, differences
from slide_fmu.credentials.members import CARD, METADATA
from slide_fmu.credentials.metadata import resource_metadata
from slide_fmu.fmu.export import PROVENANCE, read_member
from slide_fmu.page.page import carried_drawing
from slide_fmu.pipeline.credentials import without_pictures
from slide_fmu.pipeline.run_folder import recipe_of_provenance
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation.model_card import model_card
from slide_fmu.validation.statements import statements

SHOWN = 3
"""So many differences of each file are named."""

REMEDY = (
    "one of the two was edited, or another version of slide-fmu wrote them; get the file again, "
    "or make it anew (slide-fmu run)"
)


def agreement_problems(fmu: Path, surrogate: Surrogate, provenance: Any) -> list[str]:
    """Compare the metadata and the model card of an FMU with what follows from its provenance.

    Args:
        fmu: the file of an FMU, whose archive has no problems.
        surrogate: what it runs.
        provenance: what it says about its origin; None if it says nothing.

    Returns:
        The problems, each one sentence with its remedy. An FMU without provenance, or with
        neither metadata nor card, has none.

    Raises:
        FmuError: a member cannot be read.
        OSError: the file cannot be read.
    """
    carried = read_member(fmu, METADATA), read_member(fmu, CARD)
    if provenance is None or carried == (None, None):
        return []
    try:
        carried_drawing(surrogate, provenance)
        recipe = recipe_of_provenance(provenance, str(fmu))
        found = list(_of_metadata(fmu, surrogate, recipe, provenance))
        return found + list(_of_card(fmu, surrogate, recipe, provenance))
    except (AttributeError, ArithmeticError, IndexError, LookupError, TypeError, ValueError) as e:
        return [
            f"{PROVENANCE} says something else than slide-fmu writes ({type(e).__name__}: {e}); "
            "expected recipe, seeds, versions and measured errors: get the file again"
        ]


def _of_metadata(
    fmu: Path, surrogate: Surrogate, recipe: Recipe, provenance: dict[str, Any]
) -> Iterator[str]:
    content = read_member(fmu, METADATA)
    if content is None:
        return
    entries = statements(surrogate, recipe, provenance)
    payload = surrogate.to_bytes()
    written = resource_metadata(surrogate.name, recipe.description, entries, payload)
    found, expected = ElementTree.fromstring(content), ElementTree.fromstring(written)
    yield from _told(METADATA, list(differences(found, expected)))


def _of_card(
    fmu: Path, surrogate: Surrogate, recipe: Recipe, provenance: dict[str, Any]
) -> Iterator[str]:
    content = read_member(fmu, CARD)
    if content is None:
        return
    if "measured" not in provenance:
        yield f"{CARD} is there, but {PROVENANCE} has no measured errors; {REMEDY}"
        return
    card = model_card(surrogate, recipe, provenance["measured"], "", "")
    expected = _lines(without_pictures(card))
    pairs = _other_lines(_lines(content.decode("utf-8", "replace")), expected)
    others = [f"{apart(ours, its)!r}; expected {apart(its, ours)!r}" for ours, its in pairs]
    yield from _told(CARD, others)


def _lines(text: str) -> list[str]:
    """Return the lines that are not empty; pictures that are left out leave empty ones."""
    return [line for line in text.split("\n") if line.strip()]


def _other_lines(found: list[str], expected: list[str]) -> Iterator[tuple[str, str]]:
    """Pair lines that differ; the other one is empty where a line is too many."""
    matcher = SequenceMatcher(None, found, expected, autojunk=False)
    for tag, first, last, first_of, last_of in matcher.get_opcodes():
        if tag != "equal":
            yield from zip_longest(found[first:last], expected[first_of:last_of], fillvalue="")


def _told(member: str, others: list[str]) -> Iterator[str]:
    """Say in which places a member does not follow from the provenance."""
    for other in others[:SHOWN]:
        yield f"{member} does not say what {PROVENANCE} says: {other}; {REMEDY}"
    if len(others) > SHOWN:
        yield f"{member} has {len(others) - SHOWN} further differences from {PROVENANCE}"
