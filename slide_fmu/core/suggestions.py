"""What somebody may have meant by a word that is none of those that are known."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

ALIKE = 0.6
"""Words are taken to be meant from this ratio of equal letters on (``difflib``)."""


def nearest(word: str, known: Iterable[str]) -> str | None:
    """Return the known word that is most like another, or None where none is like it."""
    by_small = {name.lower(): name for name in known}
    near = difflib.get_close_matches(word.lower(), by_small, n=1, cutoff=ALIKE)
    return by_small[near[0]] if near else None


def or_meant(words: str | Iterable[str], known: Iterable[str]) -> str:
    """Return what to add to a message about unknown words, as ``; did you mean 'mass'?``."""
    choices = list(known)
    found = [nearest(word, choices) for word in ([words] if isinstance(words, str) else words)]
    meant = list(dict.fromkeys(repr(name) for name in found if name is not None))
    return f"; did you mean {' and '.join(meant)}?" if meant else ""
