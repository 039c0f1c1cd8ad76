"""The moving picture of the README shows the times that the code of today finds."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from PIL import Image

from tests.limits import HANGS
from tests.marks import needs_app

ROOT = Path(__file__).parents[2]
PICTURE = ROOT / "docs" / "moving_picture.gif"
AGAIN = "; draw it again: python docs/moving_picture.py"
LARGEST = 2e6
TIMES = (
    "import json, moving_picture as picture\n"
    "print(json.dumps(picture.settling_times(picture.solved_task())))"
)


def test_moving_picture_loops_for_ever_and_is_small() -> None:
    assert PICTURE.stat().st_size < LARGEST
    with Image.open(PICTURE) as picture:
        assert picture.size[0] == 800
        assert picture.n_frames > 50
        assert picture.info["loop"] == 0


@pytest.mark.extended
@needs_app("motion")
def test_moving_picture_shows_settling_times_of_today() -> None:
    found = subprocess.run(
        [sys.executable, "-c", TIMES],
        cwd=ROOT / "docs",
        capture_output=True,
        text=True,
        timeout=HANGS,
        check=True,
    )
    with Image.open(PICTURE) as picture:
        kept = json.loads(picture.info["comment"])
    assert kept == pytest.approx(json.loads(found.stdout), abs=1e-6), AGAIN
