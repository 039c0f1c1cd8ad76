"""Documents are checked by schemas that were written from the specifications of the formats."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

from lxml import etree

SCHEMAS = Path(__file__).parent / "schemas"


class CredentialError(ValueError):
    """A credential of an FMU cannot be read, or is not valid."""


def parsed(content: bytes, name: str, schema: str) -> Any:
    """Parse an XML document and check it by a schema, without resolving entities.

    Args:
        content: the document.
        name: its name in messages.
        schema: name of a file in ``schemas``, without its ending.

    Returns:
        Its root, an element of lxml.

    Raises:
        CredentialError: it is not XML, or violates the schema; the message has the first fault's
            line.
    """
    # entities could name files on the reader's computer
    parser = etree.XMLParser(resolve_entities=False, no_network=True, load_dtd=False)
    try:
        root = etree.fromstring(content, parser)
    except etree.XMLSyntaxError as error:
        raise CredentialError(f"{name} is no XML: {error}; expected a whole document") from error
    rules = _schema(schema)
    if not rules.validate(root):
        fault = rules.error_log[0]
        raise CredentialError(
            f"{name}, line {fault.line}: {fault.message} It is not as its schema says: write the "
            "FMU again with slide-fmu export"
        )
    return root


@cache
def _schema(name: str) -> Any:
    return etree.XMLSchema(etree.parse(str(SCHEMAS / f"{name}.xsd")))
