"""Pages of released FMUs, written once."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from slide_fmu.apps.page.page import write_page

FMUS = Path(__file__).parents[2] / "fmus"


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
