"""Messages about an unknown word suggest the known word that is most like it."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

ALIKE = 0.6
"""Smallest ratio of equal letters (``difflib``) from which a word is suggested."""


def nearest(word: str, known: Iterable[str], alike: float = ALIKE) -> str | None:
    """Return the known word that is most like another; None if no word is similar enough."""
    by_small = {name.lower(): name for name in known}
    near = difflib.get_close_matches(word.lower(), by_small, n=1, cutoff=alike)
    return by_small[near[0]] if near else None


def or_meant(words: str | Iterable[str], known: Iterable[str]) -> str:
    """Return an ending for a message about unknown words, such as ``; did you mean 'mass'?``."""
    choices = list(known)
    alike = [nearest(word, choices) for word in ([words] if isinstance(words, str) else words)]
    meant = list(dict.fromkeys(repr(name) for name in alike if name is not None))
    return f"; did you mean {' and '.join(meant)}?" if meant else ""
