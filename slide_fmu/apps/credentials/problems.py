"""The credentials of an FMU are checked without running the FMU.

They must be valid and complete, and its metadata must be those that follow from its provenance.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

from slide_fmu.apps.credentials.experiment import read_experiment
from slide_fmu.apps.credentials.manifest import read_manifest
from slide_fmu.apps.credentials.members import MANIFEST, METADATA, member
from slide_fmu.apps.credentials.metadata import checksum, resource_metadata
from slide_fmu.apps.credentials.schema import CredentialError, parsed
from slide_fmu.apps.credentials.statements import statements
from slide_fmu.core.version import other_writer
from slide_fmu.core.xml_differences import differences
from slide_fmu.core.zip_directory import open_archive
from slide_fmu.fmu.description.surrogate_variables import fmu_variables
from slide_fmu.fmu.export import Provenance, read_member
from slide_fmu.pipeline.card_check import compared_with_provenance, disagreements
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.report.fmu_description import FmuDescription
from slide_fmu.surrogate.surrogate import Surrogate


def credential_problems(fmu: Path, surrogate: Surrogate) -> list[str]:
    """Check the credentials that an FMU carries; missing ones are not a problem.

    The metadata and manifest must follow their schemas. Checksums must match the files, linked
    files must exist, and the experiment's columns must be variables.

    Args:
        fmu: the file of an FMU.
        surrogate: the surrogate of the FMU.

    Returns:
        The problems, each one sentence with its remedy where there is one.

    Raises:
        FmuError: the file is not an FMU.
        OSError: the file cannot be read.
    """
    problems: list[str] = []
    for check in (_metadata, _links, _experiment):
        try:
            problems += check(fmu, surrogate)
        except CredentialError as error:
            problems.append(str(error))
    return problems


def metadata_problems(fmu: Path, surrogate: Surrogate, provenance: Provenance | None) -> list[str]:
    """Compare the metadata of an FMU with the metadata that its provenance gives.

    The metadata of another version have other words and are not compared.
    Arguments, result and errors are those of ``slide_fmu.pipeline.card_check.card_problems``.
    """

    content = read_member(fmu, METADATA)
    if content is None:
        return []

    def compare(recipe: Recipe) -> Iterator[str]:
        entries = statements(FmuDescription.of(surrogate, provenance), recipe)
        payload = surrogate.to_bytes()
        written = resource_metadata(surrogate.name, recipe.description, entries, payload)
        expected = ElementTree.fromstring(written)
        try:
            stated = ElementTree.fromstring(content)
        except ElementTree.ParseError:  # ``credential_problems`` says so
            return
        if other_writer(provenance) is None:
            yield from disagreements(METADATA, differences(stated, expected))

    return compared_with_provenance(fmu, provenance, compare)


def _metadata(fmu: Path, surrogate: Surrogate) -> Iterator[str]:
    content = read_member(fmu, METADATA)
    if content is None:
        return
    root = parsed(content, METADATA, "metadata")
    data, stated = root.get("data"), root.get("checksum")
    if data is None or stated is None:
        return
    name = member(data, METADATA)
    described = read_member(fmu, name)
    if described is None:
        yield f"{METADATA} describes {name}, which is missing; export again"
    elif checksum(described) != stated.lower():
        yield (
            f"{METADATA} describes another {name}: its SHA3-256 checksum is {stated[:12]}..., "
            f"expected {checksum(described)[:12]}...; the credentials are not those of this "
            "FMU; get the file again, or make it again (slide-fmu run)"
        )


def _links(fmu: Path, surrogate: Surrogate) -> Iterator[str]:
    content = read_member(fmu, MANIFEST)
    if content is None:
        return
    with open_archive(fmu) as archive:
        names = set(archive.namelist())
    for file in read_manifest(content):
        if file.member not in names:
            yield (
                f"{MANIFEST} names {file.member} ({file.role}), which is missing; restore it, or "
                "export again"
            )


def _experiment(fmu: Path, surrogate: Surrogate) -> Iterator[str]:
    experiment = read_experiment(fmu)
    if experiment is None:
        return
    variables = fmu_variables(surrogate)
    causalities = {variable.name: variable.causality for variable in variables}
    for causality, columns in (("input", experiment.inputs), ("output", experiment.results)):
        for name in columns:
            if causalities.get(name) != causality:
                known = [v.name for v in variables if v.causality == causality]
                yield (
                    f"the experiment has a column {name!r}, which is no {causality} of the FMU; "
                    f"expected one of {known}"
                )
