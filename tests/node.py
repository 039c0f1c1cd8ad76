"""Node runs JavaScript in tests."""

from __future__ import annotations

import shutil

import pytest


def node() -> str:
    """Return the path of Node; skip where there is none."""
    found = shutil.which("node")
    if found is None:
        pytest.skip("node is not installed, which runs WebAssembly here")
    return found
