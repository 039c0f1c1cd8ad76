"""Refusals are checked by key words of their messages, so that sentences can be mended."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager

import pytest


@contextmanager
def refused(kind: type[Exception], *words: str) -> Iterator[pytest.ExceptionInfo[Exception]]:
    """Expect an error whose message has all of these words, and shows no types of numpy."""
    with pytest.raises(kind) as caught:
        yield caught
    missing = [word for word in words if word not in str(caught.value)]
    assert not re.search(r"\bnp\.\w+\(", str(caught.value)), str(caught.value)
    assert not missing, f"{missing} not in {str(caught.value)!r}"
