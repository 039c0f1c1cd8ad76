"""How two XML documents differ: element by element, attribute by attribute."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from itertools import zip_longest
from xml.etree.ElementTree import Element

NAMES = ("name", "keyword", "valueReference", "index")
"""An element is named by the first of these attributes that it has."""


def differences(found: Element, expected: Element) -> Iterator[str]:
    """Say what differs between two elements and those in them, one sentence part each.

    The order of attributes and the space around texts mean nothing; the order of elements does.

    Args:
        found: root of the document that is there.
        expected: root of the document that ought to be there.

    Yields:
        Parts as ``UnitDefinitions/Unit 'm'/BaseUnit: factor = '0.001'; expected none``.
    """
    yield from _of_element(found, expected, "")


def _of_element(found: Element, expected: Element, place: str) -> Iterator[str]:
    where = place or _tag(expected)
    if found.tag != expected.tag:
        yield f"{where}: <{_tag(found)}>; expected <{_tag(expected)}>"
        return
    for key in sorted({*found.keys(), *expected.keys()}):
        values = found.get(key), expected.get(key)
        if values[0] != values[1]:
            told, other = ("none" if value is None else repr(value) for value in values)
            yield f"{where}: {_local(key)} = {told}; expected {other}"
    text, wanted = (" ".join((element.text or "").split()) for element in (found, expected))
    if text != wanted:
        yield f"{where}: text {apart(text, wanted)!r}; expected {apart(wanted, text)!r}"
    yield from _of_children(found, expected, place)


def _of_children(found: Element, expected: Element, place: str) -> Iterator[str]:
    counts: Counter[str] = Counter()
    for ours, theirs in zip_longest(found, expected):
        named = theirs if theirs is not None else ours
        counts[named.tag] += 1
        below = f"{place}/{_called(named, counts[named.tag])}".lstrip("/")
        if ours is None:
            yield f"{below} is missing"
        elif theirs is None:
            yield f"{below} is there; expected none"
        else:
            yield from _of_element(ours, theirs, below)


def _called(element: Element, number: int) -> str:
    """Name an element among those beside it, by an attribute or by its number from 1."""
    key = next((key for key in NAMES if key in element.attrib), None)
    if key is not None:
        return f"{_tag(element)} {element.get(key)!r}"
    return _tag(element) if number == 1 else f"{_tag(element)} {number}"


def apart(text: str, other: str, length: int = 60) -> str:
    """Return the part of a text around the first place where another text differs."""
    pairs = enumerate(zip_longest(text, other))
    place = next((index for index, (ours, theirs) in pairs if ours != theirs), 0)
    start = max(0, place - length // 2)
    return text[start : start + length]


def _tag(element: Element) -> str:
    return _local(element.tag)


def _local(name: str) -> str:
    """Return a name without its namespace."""
    return name.rpartition("}")[2]
