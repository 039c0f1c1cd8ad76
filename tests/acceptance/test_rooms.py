"""The rooms of the house: their numbers, and the picture of them in ``docs``."""

from __future__ import annotations

import html
import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
AGAIN = "; draw it again: python docs/rooms.py"
LINES_APART = 0.2
"""Part by which lines and files may have changed since the picture was drawn."""


@pytest.fixture(scope="module")
def measured() -> dict[str, Any]:
    """What the command measures now."""
    command = [sys.executable, str(ROOT / "docs" / "rooms.py"), "--json", "-"]
    result = subprocess.run(command, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    return dict(json.loads(result.stdout))


@pytest.fixture(scope="module")
def drawn() -> dict[str, Any]:
    """What the committed picture shows."""
    picture = (ROOT / "docs" / "rooms.svg").read_text(encoding="utf-8")
    (data,) = re.findall(r"<metadata>(.*?)</metadata>", picture, re.DOTALL)
    return dict(json.loads(html.unescape(data)))


BESIDE = {"apps", "mbs_models", "records", "record_files"}
"""Rooms that are not on the way from a model to an FMU: nothing on it knows them."""


def test_way_has_few_rooms_floors_and_arrows_and_no_circle(measured: dict[str, Any]) -> None:
    way = [room for room in measured["rooms"] if room["name"] not in BESIDE]
    arrows = [a for a in measured["arrows"] if not BESIDE & {a["from"], a["to"]}]
    assert len(way) <= 18
    assert len({room["floor"] for room in way}) <= 12
    assert len(arrows) <= 100
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


def test_picture_shows_the_rooms_as_they_are(
    measured: dict[str, Any], drawn: dict[str, Any]
) -> None:
    """An app may be removed without drawing again."""
    for what in ("circles of rooms", "circles of files"):
        assert drawn[what] == measured[what], what + AGAIN
    pairs = [
        [(a["from"], a["to"]) for a in figures["arrows"] if a["from"] != "apps"]
        for figures in (drawn, measured)
    ]
    assert pairs[0] == pairs[1], AGAIN
    for shown, found in zip(drawn["rooms"], measured["rooms"], strict=True):
        same = ("name", "floor", "says")
        assert {key: shown[key] for key in same} == {key: found[key] for key in same}, AGAIN
        for key in ("files", "lines", "c_files", "c_lines") if found["name"] != "apps" else ():
            assert shown[key] == pytest.approx(found[key], rel=LINES_APART, abs=2), AGAIN
