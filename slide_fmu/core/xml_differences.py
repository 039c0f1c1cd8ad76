"""Two XML documents are compared element by element, attribute by attribute."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from itertools import zip_longest
from xml.etree.ElementTree import Element

NAMES = ("name", "keyword", "valueReference", "index")
"""The first of these attributes that an element has is its name in messages."""


def differences(found: Element, expected: Element) -> Iterator[str]:
    """Yield the differences between two elements and their children, one sentence part each.

    The order of attributes and white space around texts do not count; the order of elements does.

    Args:
        found: root of the document found.
        expected: root of the document expected.

    Yields:
        Sentence parts such as ``UnitDefinitions/Unit 'm'/BaseUnit: factor = '0.001'; expected
        none``.
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
            value, other = ("none" if each is None else repr(each) for each in values)
            yield f"{where}: {_local(key)} = {value}; expected {other}"
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
    """Name an element among its siblings, by an attribute or by its number from 1."""
    key = next((key for key in NAMES if key in element.attrib), None)
    if key is not None:
        return f"{_tag(element)} {element.get(key)!r}"
    return _tag(element) if number == 1 else f"{_tag(element)} {number}"


def apart(text: str, other: str, length: int = 60) -> str:
    """Return the part of a text around the first difference from another text."""
    pairs = enumerate(zip_longest(text, other))
    place = next((index for index, (ours, theirs) in pairs if ours != theirs), 0)
    start = max(0, place - length // 2)
    return text[start : start + length]


def _tag(element: Element) -> str:
    return _local(element.tag)


def _local(name: str) -> str:
    """Return a name without its namespace."""
    return name.rpartition("}")[2]
