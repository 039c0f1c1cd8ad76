"""The credentials of an FMU are files that it carries: metadata, manifest and an experiment."""

from __future__ import annotations

from collections.abc import Sequence

import jinja2

from slide_fmu.apps.credentials import members
from slide_fmu.apps.credentials.experiment import Experiment, experiment_members, read_experiment
from slide_fmu.apps.credentials.make_experiment import make_experiment
from slide_fmu.apps.credentials.manifest import RelatedFile, write_manifest
from slide_fmu.apps.credentials.metadata import resource_metadata
from slide_fmu.apps.credentials.statements import statements
from slide_fmu.cosim.check import OUTPUT_TOLERANCE
from slide_fmu.fmu.attachments.files import LICENSES
from slide_fmu.fmu.export import PROVENANCE
from slide_fmu.pipeline.apps import Release
from slide_fmu.pipeline.documents import CARD, PAGE
from slide_fmu.report.fmu_description import FmuDescription

FOOTER = "<!-- links of the FMU -->"
END = "</body>"

KNOWN = (
    RelatedFile(
        members.METADATA,
        members.SRMD,
        "meta-data",
        "Purpose, range of validity, reference, data, measured error and limits.",
    ),
    RelatedFile(
        members.EXPERIMENTS,
        members.EXPERIMENTS_TYPE,
        "experiment/smoke-test",
        "An experiment that any importer can repeat.",
    ),
    RelatedFile(members.INPUTS, members.CSV, "other", "Inputs of the experiment."),
    RelatedFile(members.PARAMETERS, members.SSV, "parameter", "Parameters of the experiment."),
    RelatedFile(members.RESULTS, members.CSV, "result", "What this FMU gave in the experiment."),
    RelatedFile(
        members.REFERENCE_MODEL,
        members.CSV,
        "result",
        "What the reference gave in the experiment, as far as both can be compared.",
    ),
    RelatedFile(PAGE, "text/html", "report", "Report of the training and validation."),
    RelatedFile(CARD, "text/markdown", "document", "Model card."),
    RelatedFile(
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
    described = FmuDescription.of(surrogate, release.provenance)
    entries = statements(described, recipe)
    payload, name = surrogate.to_bytes(), surrogate.name
    own = {members.METADATA: resource_metadata(name, recipe.description, entries, payload)}
    if experiment is not None:
        own |= experiment_members(experiment)
    if PAGE in release.members:
        own[PAGE] = with_links(release.members[PAGE])
    there = {*release.members, *own, PROVENANCE}
    files = [file for file in KNOWN if file.member in there]
    own[members.MANIFEST] = write_manifest(files)
    shifted = described.surrogate.forecasts_inputs
    own[members.REFERENCES_PAGE] = references_page(name, files, experiment, shifted)
    return own


def references_page(
    name: str, files: Sequence[RelatedFile], experiment: Experiment | None, shifted: bool
) -> bytes:
    """Write the page about related files as HTML.

    Args:
        name: name of the FMU.
        files: the files in the manifest.
        experiment: the experiment of the FMU, if it has one.
        shifted: whether the FMU forecasts its inputs within a step.
    """
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("slide_fmu.apps.credentials"),
        autoescape=True,
        trim_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    page = members.REFERENCES_PAGE
    begin = 0.0
    if experiment is not None:
        begin = experiment.step * (experiment.steps + 1 - experiment.compared)
    text = environment.get_template("references.html").render(
        name=name,
        files=[(members.link(file.member, page), file) for file in files],
        manifest=members.link(members.MANIFEST, page),
        experiment=experiment,
        tolerance=OUTPUT_TOLERANCE,
        begin=begin,
        shifted=shifted,
    )
    return text.encode("utf-8")


def with_links(page: bytes) -> bytes:
    """Return the main page of an FMU with links to the others; a page with links stays unchanged.

    A page without an end of its body stays unchanged too: there is no place for the links.
    """
    text = page.decode("utf-8")
    if FOOTER in text or END not in text:
        return page
    addresses = {
        "model card": CARD,
        "related files and an experiment to repeat": members.REFERENCES_PAGE,
        "credentials (SRMD)": members.METADATA,
        "licences": f"{LICENSES}/license.txt",
    }
    links = ", ".join(
        f'<a href="{members.link(name, PAGE)}">{text}</a>' for text, name in addresses.items()
    )
    before, end, rest = text.rpartition(END)
    return f"{before}{FOOTER}\n<p>In this FMU: {links}.</p>\n{end}{rest}".encode()
