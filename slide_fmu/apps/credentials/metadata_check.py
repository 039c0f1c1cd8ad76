"""The metadata of an FMU is compared with its provenance, from which it follows."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

from slide_fmu.apps.credentials.members import METADATA
from slide_fmu.apps.credentials.metadata import resource_metadata
from slide_fmu.apps.credentials.statements import statements
from slide_fmu.core.version import other_writer
from slide_fmu.core.xml_differences import differences
from slide_fmu.fmu.export import Provenance, read_member
from slide_fmu.pipeline.card_check import compared_with_provenance, disagreements
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.surrogate.surrogate import Surrogate


def metadata_problems(fmu: Path, surrogate: Surrogate, provenance: Provenance | None) -> list[str]:
    """Compare the metadata of an FMU with the metadata that its provenance gives.

    The metadata of another version have other words and are not compared.
    Arguments, result and errors are those of ``slide_fmu.pipeline.card_check.card_problems``.
    """

    content = read_member(fmu, METADATA)
    if content is None:
        return []

    def compare(recipe: Recipe) -> Iterator[str]:
        entries = statements(surrogate, recipe, provenance or {})
        payload = surrogate.to_bytes()
        written = resource_metadata(surrogate.name, recipe.description, entries, payload)
        found, expected = ElementTree.fromstring(content), ElementTree.fromstring(written)
        if other_writer(provenance) is None:
            yield from disagreements(METADATA, differences(found, expected))

    return compared_with_provenance(fmu, provenance, compare)
