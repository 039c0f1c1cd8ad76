"""FMU archives that are damaged, each in its own way."""

from __future__ import annotations

import io
import json
import re
import struct
import warnings
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from slide_fmu.fmu.export import DESCRIPTION, PROVENANCE, SURROGATE

Members = dict[str, bytes]

TEXTS = [b"", b"-1", b"0", b"1e999", b"nan", b"[/red]", b"&lt;", b"&none;", b"%s%n", b"9" * 400]
"""What stands where an attribute had its value."""

BOMB = (
    b'<?xml version="1.0"?><!DOCTYPE a [<!ENTITY b "bbbbbbbbbb">'
    + b"".join(
        b'<!ENTITY %c "%s">' % (c, b"&%c;" % (c - 1) * 10) for c in range(ord("c"), ord("l"))
    )
    + b"]><fmiModelDescription>&k;</fmiModelDescription>"
)
"""Entities that grow tenfold nine times."""


def members_of(path: Path) -> Members:
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def packed(members: Members, more: list[tuple[str, bytes]] | None = None) -> bytes:
    """A zip archive; more: members that may have names that are there already.

    Libraries, which are large, are not compressed: that would take most of the time of the tests.
    """
    content = io.BytesIO()
    with warnings.catch_warnings(), zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        warnings.simplefilter("ignore")  # names twice are the point
        for name, data in [*members.items(), *(more or [])]:
            how = (0, None) if name.startswith("binaries/") else (8, 1)
            archive.writestr(zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0)), data, *how)
    return content.getvalue()


def without(members: Members, name: str) -> Members:
    return {other: data for other, data in members.items() if other != name}


def sealed(payload: bytes) -> bytes:
    """A surrogate file with a checksum that fits."""
    return payload[:-4] + struct.pack("<I", zlib.crc32(payload[:-4]))


def in_directory(archive: bytes, offset: int, value: int) -> bytes:
    """With a 16-bit number in every entry of the archive's directory."""
    parts = archive.split(b"PK\1\2")
    at = offset - 4  # behind the signature
    entries = [part[:at] + struct.pack("<H", value) + part[at + 2 :] for part in parts[1:]]
    return b"PK\1\2".join([parts[0], *entries])


def with_metadata(payload: bytes, text: bytes) -> bytes:
    """A surrogate file with another text in its last section."""
    begin = payload.rindex(b"META")
    padded = text + b" " * (-len(text) % 4)
    return sealed(payload[:begin] + b"META" + struct.pack("<I", len(padded)) + padded + bytes(4))


def metadata_damages(payload: bytes) -> Iterator[tuple[str, bytes]]:
    """The same surrogate with metadata that is damaged, its other sections whole."""
    begin = payload.rindex(b"META") + 8
    good = json.loads(payload[begin:-4])
    signal = good["inputs"][0]
    for value in (3, None, ["a"], "", "\0", "\ud800", "[/red]"):
        for key in ("name", "unit", "low", "start", "description", "other"):
            inputs = [{**signal, key: value}, *good["inputs"][1:]]
            text = json.dumps({**good, "inputs": inputs}).encode()
            yield f"{key} {str(value)[:9]!r}", with_metadata(payload, text)
        text = json.dumps({**good, "name": value}).encode()
        yield f"model name {str(value)[:9]!r}", with_metadata(payload, text)
    for what, text in {
        "no json": b"{",
        "no text": b"\xff",
        "deep": b"[" * 100_000,
        "huge": json.dumps(good).encode().replace(b'"low": -2', b'"low": -1' + b"0" * 400),
        "nothing": b"",
    }.items():
        yield what, with_metadata(payload, text)


def named_damages(members: Members) -> Iterator[tuple[str, bytes]]:
    """Damages worth a name, of an archive with these members and of what slide-fmu puts in."""
    whole, xml = packed(members), members[DESCRIPTION]
    yield "empty file", b""
    yield "no zip", b"no zip archive at all"
    yield "cut off", whole[: len(whole) // 2]
    yield "begin is missing", whole[100:]
    for name in (DESCRIPTION, SURROGATE):
        yield f"{name} is missing", packed(without(members, name))
        yield f"{name} is empty", packed({**members, name: b""})
        yield f"{name} twice", packed(members, [(name, b"other")])
    libraries = [name for name in members if name.startswith("binaries/")]
    yield "libraries are missing", packed({n: d for n, d in members.items() if n not in libraries})
    yield "libraries are no libraries", packed({**members, **dict.fromkeys(libraries, b"none")})
    yield "member outside", packed(members, [("../outside", b"")])
    yield "absolute member", packed(members, [("/outside", b"")])
    yield "file in place of a folder", packed(members, [("resources", b"")])
    yield (
        "wrong size of a member",
        whole.replace(struct.pack("<I", len(xml)), struct.pack("<I", len(xml) - 7)),
    )
    yield (
        "huge size of a member",
        whole.replace(struct.pack("<I", len(xml)), struct.pack("<I", 0xFFFFFFF0)),
    )
    yield "encrypted", in_directory(whole, 8, 1)
    for method in (1, 99):
        yield f"compressed by method {method}", in_directory(whole, 10, method)
    for what, content in {
        "no json": b"{",
        "no text": b"\xff\xfe\xff",
        "no object": b"[1, 2]",
        "null": b"null",
        "deep": b"[" * 100_000,
        "long number": b'{"a": ' + b"9" * 5000 + b"}",
        "not a number": b'{"a": NaN, "b": Infinity}',
        "lone surrogate": b'{"a": "\\ud800"}',
        "other types": json.dumps({"recipe": 3, "errors": [], "seed": {}}).encode(),
    }.items():
        yield f"provenance: {what}", packed({**members, PROVENANCE: content})
    for what, payload in metadata_damages(members[SURROGATE]):
        yield f"metadata: {what}", packed({**members, SURROGATE: payload})


def description_damages(members: Members) -> Iterator[tuple[str, bytes]]:
    """The same of the model description."""
    xml = members[DESCRIPTION]
    for what, content in {
        "entities": BOMB,
        "not closed": xml[:-30],
        "no text": b"\xff" * 20,
        "other root": b"<a/>",
        "utf-16": xml.decode().replace("UTF-8", "UTF-16").encode("utf-16"),
        "unknown encoding": xml.replace(b"UTF-8", b"ebcdic-cp-none"),
        "no version": re.sub(rb' fmiVersion="[^"]*"', b"", xml),
        "version 1": re.sub(rb' fmiVersion="[^"]*"', b' fmiVersion="1.0"', xml),
        "version 9": re.sub(rb' fmiVersion="[^"]*"', b' fmiVersion="9.0"', xml),
        "no co-simulation": re.sub(rb"<CoSimulation.*?/>", b"", xml, flags=re.DOTALL),
        "no variables": re.sub(
            rb"<ModelVariables>.*</ModelVariables>", b"<ModelVariables/>", xml, flags=re.DOTALL
        ),
        "deep": b"<a>" * 20_000,
        "markup of the console": xml.replace(b'"u0"', b'"[/red]"'),
        "other GUID": xml.replace(b"slide-", b"slide-0"),
    }.items():
        yield f"model description: {what}", packed({**members, DESCRIPTION: content})


def damaged_text(text: bytes, rng: np.random.Generator) -> bytes:
    """Some edits of an XML document: values, tags, bytes."""
    for _ in range(rng.integers(1, 4)):
        places = [match.span(1) for match in re.finditer(rb'="([^"]*)"', text)] or [(0, 0)]
        tags = [match.span() for match in re.finditer(rb"<[^<>]*>", text)] or [(0, 0)]
        first, last = places[rng.integers(len(places))]
        begin, end = tags[rng.integers(len(tags))]
        place = int(rng.integers(len(text) + 1))
        kinds = [
            text[:first] + TEXTS[rng.integers(len(TEXTS))] + text[last:],
            text[: first - 2] + text[last:],
            text[:begin] + text[end:],
            text[:begin] + 2 * text[begin:end] + text[end:],
            text[:place] + bytes([rng.integers(256)]) + text[place + 1 :],
            text[:place],
        ]
        text = kinds[rng.choice(len(kinds), p=[0.4, 0.2, 0.15, 0.1, 0.1, 0.05])]
    return text


def damaged_bytes(data: bytes, rng: np.random.Generator) -> bytes:
    """Some bytes changed, taken out or doubled."""
    changed = bytearray(data)
    for _ in range(rng.integers(1, 5)):
        place, length = int(rng.integers(len(changed) + 1)), int(rng.integers(1, 9))
        kind = rng.integers(4)
        if kind < 2 and place < len(changed):
            changed[place] ^= 1 << int(rng.integers(8))
        elif kind == 2:
            del changed[place : place + length]
        else:
            changed[place:place] = changed[place : place + length]
    return bytes(changed)


def random_damage(members: Members, rng: np.random.Generator) -> bytes:
    """One of: model description, surrogate, provenance, or the archive's own bytes."""
    kind = rng.integers(4)
    if kind == 0:
        return packed({**members, DESCRIPTION: damaged_text(members[DESCRIPTION], rng)})
    if kind == 1:
        payload = sealed(damaged_bytes(members[SURROGATE], rng))
        return packed({**members, SURROGATE: payload})
    if kind == 2:
        return packed({**members, PROVENANCE: damaged_bytes(members[PROVENANCE], rng)})
    whole = packed(members)
    directory = whole.rindex(b"PK\1\2", 0, whole.index(b"PK\1\2") + 4)
    return whole[:directory] + damaged_bytes(whole[directory:], rng)
