"""Pages of released FMUs, written once."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from slide_fmu.apps.page.page import write_page
from tests.marks import APPS

collect_ignore = []
if not (APPS / "motion").exists():
    collect_ignore += ["test_moves.py"]
if not (APPS / "credentials").exists():  # pages show the experiment that FMUs carry
    collect_ignore += ["test_library.py", "test_page.py", "test_touch.py"]

FMUS = Path(__file__).parents[3] / "fmus"


@pytest.fixture(scope="session")
def page_of(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """The page of a released FMU, by its name."""
    folder = tmp_path_factory.mktemp("pages")

    def page(name: str) -> Path:
        path = folder / f"{name}.html"
        if not path.is_file():
            write_page(FMUS / name / f"{name}.fmu", path)
        return path

    return page
