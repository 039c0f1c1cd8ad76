"""The credentials of an FMU are files that it carries: metadata, manifest and an experiment."""

from __future__ import annotations

from slide_fmu.apps.credentials import members
from slide_fmu.apps.credentials.experiment import experiment_members, read_experiment
from slide_fmu.apps.credentials.make_experiment import forecasts, make_experiment
from slide_fmu.apps.credentials.manifest import Related, write_manifest
from slide_fmu.apps.credentials.metadata import resource_metadata
from slide_fmu.apps.credentials.page import references_page, with_links
from slide_fmu.apps.credentials.statements import statements
from slide_fmu.fmu.export import PROVENANCE
from slide_fmu.pipeline.apps import Release
from slide_fmu.pipeline.documents import CARD, PAGE

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
    Related(PAGE, "text/html", "report", "Report of the training and validation."),
    Related(CARD, "text/markdown", "document", "Model card."),
    Related(
        PROVENANCE, "application/json", "method", "Recipe, seeds, versions and measured figures."
    ),
)
"""All files that a manifest may name, in its order; it names those that the FMU has."""


def members_of(release: Release) -> dict[str, bytes]:
    """Return the credentials of an FMU, by their names in it.

    The same release gives the same bytes. The experiment is taken from the former FMU, if it
    carries one; otherwise it is run with the FMU of the release, if there is one.

    Raises:
        CoSimulationError: the FMU cannot be run.
        CredentialError: the experiment of the former FMU is damaged.
        SimulationError: the reference could not be simulated on any draw.
    """
    surrogate, recipe = release.surrogate, release.case.recipe
    experiment = None if release.former is None else read_experiment(release.former)
    if experiment is None and release.fmu is not None:
        experiment = make_experiment(release.fmu, surrogate, release.case, release.seed)
    entries = statements(surrogate, recipe, release.provenance)
    payload, name = surrogate.to_bytes(), surrogate.name
    found = {members.METADATA: resource_metadata(name, recipe.description, entries, payload)}
    if experiment is not None:
        found |= experiment_members(experiment)
    if PAGE in release.members:
        found[PAGE] = with_links(release.members[PAGE])
    there = {*release.members, *found, PROVENANCE}
    files = [file for file in KNOWN if file.member in there]
    found[members.MANIFEST] = write_manifest(files)
    shifted = forecasts(surrogate)
    found[members.REFERENCES_PAGE] = references_page(name, files, experiment, shifted)
    return found
