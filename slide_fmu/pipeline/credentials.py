"""An FMU is written with all that says what it is good for: report, card, and credentials."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from slide_fmu.credentials import members
from slide_fmu.credentials.experiment import Experiment, experiment_members
from slide_fmu.credentials.manifest import Related, write_manifest
from slide_fmu.credentials.metadata import resource_metadata
from slide_fmu.credentials.page import references_page, with_links
from slide_fmu.fmu.export import DOCUMENTATION, EXTRA, PROVENANCE
from slide_fmu.pipeline.experiment import forecasts
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation.statements import statements

KNOWN = (
    Related(
        members.METADATA,
        members.SRMD,
        "meta-data",
        "Purpose, range of validity, reference, data, measured error and limits.",
    ),
    Related(
        members.EXPERIMENTS,
        members.EXPERIMENTS_TYPE,
        "experiment/smoke-test",
        "An experiment that any importer can repeat.",
    ),
    Related(members.INPUTS, members.CSV, "other", "Inputs of the experiment."),
    Related(members.PARAMETERS, members.SSV, "parameter", "Parameters of the experiment."),
    Related(members.RESULTS, members.CSV, "result", "What this FMU gave in the experiment."),
    Related(
        members.REFERENCE_MODEL,
        members.CSV,
        "result",
        "What the reference gave in the experiment, as far as both can be compared.",
    ),
    Related(members.PAGE, "text/html", "report", "Report of the training and validation."),
    Related(members.CARD, "text/markdown", "document", "Model card."),
    Related(
        PROVENANCE, "application/json", "method", "Recipe, seeds, versions and measured figures."
    ),
)
"""All files that a manifest may name, in its order; it names those that the FMU has."""


@dataclass(frozen=True, eq=False)
class Documents:
    """This says what people read about an FMU.

    Attributes:
        page: the report, as HTML.
        card: the model card, as Markdown.
    """

    page: bytes
    card: str


class Files(NamedTuple):
    """Files of the folders ``documentation`` and ``extra`` of an FMU, by their names in these."""

    documentation: dict[str, bytes]
    extra: dict[str, bytes]


def credentials(
    surrogate: Surrogate,
    recipe: Recipe,
    provenance: Mapping[str, Any],
    documents: Documents | None = None,
    experiment: Experiment | None = None,
) -> Files:
    """Return the files of an FMU that say what it is good for.

    The same arguments give the same bytes.

    Args:
        surrogate: what the FMU carries.
        recipe: what it was made from, with all values resolved.
        provenance: where it comes from, perhaps with measured figures.
        documents: report and card; None of an FMU that was not measured.
        experiment: what importers can repeat; None if nothing was run.
    """
    payload, name = surrogate.to_bytes(), surrogate.name
    entries = statements(surrogate, recipe, provenance)
    found = {members.METADATA: resource_metadata(name, recipe.description, entries, payload)}
    if experiment is not None:
        found |= experiment_members(experiment)
    if documents is not None:
        found[members.PAGE] = with_links(documents.page)
        found[members.CARD] = without_pictures(documents.card).encode("utf-8")
    files = [file for file in KNOWN if file.member in found or file.member == PROVENANCE]
    found[members.MANIFEST] = write_manifest(files)
    shifted = forecasts(surrogate)
    found[members.REFERENCES_PAGE] = references_page(name, files, experiment, shifted)
    return Files(_below(DOCUMENTATION, found), _below(EXTRA, found))


def _below(folder: str, found: Mapping[str, bytes]) -> dict[str, bytes]:
    """Return the files in a folder of the FMU, by their names in it."""
    return {
        member.removeprefix(f"{folder}/"): content
        for member, content in found.items()
        if member.startswith(f"{folder}/")
    }


def without_pictures(card: str) -> str:
    """Return a model card without the pictures that lie beside it; the report shows them."""
    lines = card.split("\n")
    return "\n".join(line for line in lines if not line.startswith("!["))
