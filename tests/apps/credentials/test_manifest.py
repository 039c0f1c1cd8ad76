"""The manifest of related files."""

from __future__ import annotations

from xml.etree import ElementTree

from slide_fmu.apps.credentials.manifest import (
    DESCRIPTION,
    NAMESPACE,
    RelatedFile,
    is_relative,
    read_manifest,
    write_manifest,
)
from slide_fmu.apps.credentials.members import MANIFEST
from slide_fmu.apps.credentials.schema import CredentialError
from slide_fmu.fmu.export import read_member
from tests.apps.credentials.conftest import LINEAR
from tests.apps.credentials.standards import layered_standard_schema
from tests.refusals import refused

FILES = [
    RelatedFile("documentation/index.html", "text/html", "report", "Report & figures."),
    RelatedFile("extra/org.fmi-standard.fmi-ls-ref/a.csv", "text/csv", "result", "Results."),
]


def test_read_manifest_gives_what_was_written() -> None:
    assert read_manifest(write_manifest(FILES)) == FILES


def test_manifest_names_its_files_relative_to_itself() -> None:
    sources = [e.get("source") for e in ElementTree.fromstring(write_manifest(FILES))]
    assert sources == ["../../documentation/index.html", "a.csv"]


def test_manifest_has_the_attributes_that_fmi_3_publishes_for_layered_standards() -> None:
    known = {str(a.name) for a in layered_standard_schema().attributes.values()}
    attributes = ElementTree.fromstring(write_manifest(FILES)).attrib
    assert attributes == {
        f"{{{NAMESPACE}}}fmi-ls-name": "org.fmi-standard.fmi-ls-ref",
        f"{{{NAMESPACE}}}fmi-ls-version": "1.0.0-alpha.1",
        f"{{{NAMESPACE}}}fmi-ls-description": DESCRIPTION,
    }
    assert set(attributes) == known


def test_released_fmu_names_experiment_results_report_card_and_metadata() -> None:
    content = read_member(LINEAR, MANIFEST)
    assert content is not None
    roles = [file.role for file in read_manifest(content)]
    for role in ("experiment/smoke-test", "result", "report", "document", "meta-data", "method"):
        assert role in roles


def test_unknown_role_is_refused_with_the_line() -> None:
    content = write_manifest(FILES).replace(b'role="report"', b'role="repot"')
    with refused(CredentialError, "fmi-ls-manifest.xml, line 3", "'repot'"):
        read_manifest(content)


def test_addresses_outside_of_the_fmu_are_no_links() -> None:
    absolute = b'source="https://example.org/a.csv"'
    assert read_manifest(write_manifest(FILES).replace(b'source="a.csv"', absolute)) == FILES[:1]
    assert [is_relative(a) for a in ("a/b:c", "../a", "file:/a", "/a")] == [
        True,
        True,
        False,
        False,
    ]
