"""The resource metadata of an FMU, by the published schema of SRMD and by what it says."""

from __future__ import annotations

import hashlib
from xml.etree import ElementTree

import pytest

from slide_fmu.apps.credentials.members import CLASSIFICATION, METADATA
from slide_fmu.apps.credentials.metadata import (
    COMMON,
    OWN,
    Entry,
    joined,
    resource_metadata,
    table,
)
from slide_fmu.apps.credentials.schema import CredentialError, parsed
from slide_fmu.fmu.export import SURROGATE, read_member
from tests.acceptance.importers import needs
from tests.apps.credentials.conftest import LINEAR
from tests.apps.credentials.standards import srmd_schema
from tests.refusals import refused

ENTRIES = [
    Entry("purpose", ["One sentence."]),
    Entry("limits", ["First & last.", "Second <one>."]),
    joined("accuracy", [table("Validation", "Output", [{"name": "y", "rmse": 1e-3, "no": None}])]),
]


@needs("pyssp_standard")
def test_metadata_is_valid_by_the_published_schema_and_by_our_own() -> None:
    content = resource_metadata("plant", "a plant", ENTRIES, b"payload")
    srmd_schema().validate(content.decode())
    parsed(content, "plant.srmd", "metadata")


@needs("pyssp_standard")
def test_metadata_of_a_released_fmu_is_valid_by_the_published_schema() -> None:
    content = read_member(LINEAR, METADATA)
    assert content is not None
    srmd_schema().validate(content.decode())


@needs("pyssp_standard")
@pytest.mark.parametrize(
    ("old", "new"),
    [
        (b'version="1.0.0"', b'version="one"'),
        (b' name="plant"', b""),
        (b"ClassificationEntry", b"OtherEntry"),
        (b' keyword="purpose"', b""),
        (b'description="a plant"', b'unknown="a plant"'),
        (b'checksum="', b'checksum="xyz'),
    ],
)
def test_both_schemas_refuse_the_same_mistakes(old: bytes, new: bytes) -> None:
    content = resource_metadata("plant", "a plant", ENTRIES, b"payload").replace(old, new)
    assert not srmd_schema().is_valid(content.decode())
    with refused(CredentialError, "plant.srmd, line", "as its schema says"):
        parsed(content, "plant.srmd", "metadata")


def test_metadata_has_the_sha3_256_checksum_of_the_surrogate_file() -> None:
    content, payload = read_member(LINEAR, METADATA), read_member(LINEAR, SURROGATE)
    assert content is not None
    assert payload is not None
    root = ElementTree.fromstring(content)
    assert root.get("checksum") == hashlib.sha3_256(payload).hexdigest()
    assert root.get("data") == "../../resources/surrogate.slide"


def test_entries_keep_their_texts_and_tables() -> None:
    content = resource_metadata("plant", "a plant", ENTRIES, b"payload")
    (classification,) = ElementTree.fromstring(content)
    assert classification.get("type") == CLASSIFICATION
    entries = {entry.get("keyword"): entry for entry in classification}
    assert all(entry.tag == f"{{{COMMON}}}ClassificationEntry" for entry in classification)
    assert (entries["purpose"].get("type"), entries["purpose"].text) == (
        "text/plain",
        "One sentence.",
    )
    assert entries["limits"].text == "\n- First & last.\n- Second <one>.\n"
    (output,) = entries["accuracy"].iter(f"{{{OWN}}}Output")
    assert output.attrib == {"name": "y", "rmse": "0.001"}


def test_metadata_of_the_same_arguments_has_the_same_bytes() -> None:
    arguments = ("plant", "a plant", ENTRIES, b"payload")
    assert resource_metadata(*arguments) == resource_metadata(*arguments)


def test_entities_of_a_document_are_not_resolved() -> None:
    """They could name files of whoever checks the FMU."""
    content = (
        b'<!DOCTYPE a [<!ENTITY secret SYSTEM "file:///etc/hostname">]>'
        b'<Experiments name="&secret;"><Experiment name="x"/></Experiments>'
    )
    with refused(CredentialError, "is no XML"):
        parsed(content, "x.exp", "experiments")
