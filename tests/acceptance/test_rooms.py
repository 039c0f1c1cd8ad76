"""The rooms of the house: imports between them, and what their docstrings say."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def measured() -> dict[str, Any]:
    """What the command measures now."""
    command = [sys.executable, str(ROOT / "docs" / "rooms.py"), "--json", "-"]
    result = subprocess.run(command, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    return dict(json.loads(result.stdout))


def test_neither_rooms_nor_files_import_each_other_in_a_circle(measured: dict[str, Any]) -> None:
    assert measured["circles of rooms"] == []
    assert measured["circles of files"] == []


def test_every_arrow_leads_down(measured: dict[str, Any]) -> None:
    floor = {room["name"]: room["floor"] for room in measured["rooms"]}
    assert set(floor) == {
        "mbs_models",
        *(path.parent.name for path in (ROOT / "slide_fmu").glob("*/__init__.py")),
    }
    up = [(a["from"], a["to"]) for a in measured["arrows"] if floor[a["from"]] <= floor[a["to"]]]
    assert up == []


def test_every_room_says_what_is_in_it_and_what_may_not_be(measured: dict[str, Any]) -> None:
    for room in measured["rooms"]:
        first, _, rest = room["says"].partition("\n\n")
        assert first.endswith("."), room["name"]
        assert rest, f"{room['name']}: its docstring does not say what may not be in it"
