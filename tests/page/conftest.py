"""Pages of released FMUs, written once."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from slide_fmu.page.page import write_page
from tests.page.browser import Browser, browser

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


@pytest.fixture(scope="module")
def chromium(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """A browser; its profile is removed with the other temporary folders."""
    with browser(tmp_path_factory.mktemp("profile")) as found:
        yield found
