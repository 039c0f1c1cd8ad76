"""The site builds from ``docs`` without warnings, and its pages need no network."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_site_is_built_strictly_and_loads_nothing_from_the_network(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(tmp_path)]
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    for page in (ROOT / "docs").glob("*.md"):
        text = (tmp_path / f"{page.stem}.html").read_text(encoding="utf-8")
        loaded = re.findall(r'<(?:script|link|img|iframe)[^>]*(?:src|href)="(https?:[^"]*)"', text)
        assert loaded == [], page.name


def test_files_that_the_pages_name_exist_or_are_to_be_made() -> None:
    """Rows of the tables on adding things name new files as ``(new)``, or with NAME."""
    for page in (ROOT / "docs").glob("*.md"):
        for line in page.read_text(encoding="utf-8").splitlines():
            named = re.findall(
                r"`((?:slide_fmu|mbs_models|tests|docs|fmus|training)/[\w./]+)`", line
            )
            for name in named:
                assert (ROOT / name).exists() or "NAME" in name or "(new)" in line, (page, name)
