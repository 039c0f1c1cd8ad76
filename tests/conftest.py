"""Shared settings of all tests."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator

import pytest
from hypothesis import settings

from slide_fmu.core.search_path import make_importable
from tests.browser import Browser, browser
from tests.few_motions import few_motions
from tests.time_log import (
    pytest_collection_modifyitems,
    pytest_configure,
    pytest_runtest_makereport,
    pytest_runtest_protocol,
)

__all__ = [
    "pytest_collection_modifyitems",
    "pytest_configure",
    "pytest_runtest_makereport",
    "pytest_runtest_protocol",
]

# One thread each: small matrices gain nothing from more, and lose much on a busy machine.
# Set before torch is loaded; subprocesses inherit it.
os.environ.setdefault("OMP_NUM_THREADS", "1")

# The same examples in every run: a failure comes back. No deadline: machines are shared. ``make
# test-all`` takes twice as many as others (``--hypothesis-profile thorough``).
settings.register_profile("quick", deadline=None, derandomize=True, max_examples=20)
settings.register_profile("thorough", deadline=None, derandomize=True, max_examples=40)
settings.load_profile("quick")


@pytest.fixture(scope="session", autouse=True)
def _temporary_folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """What importers leave in the folder of temporary files is removed with that of the tests."""
    folder = str(tmp_path_factory.mktemp("left"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tempfile, "tempdir", folder)
        for name in ("TMPDIR", "TEMP", "TMP"):  # for programs that tests start
            patch.setenv(name, folder)
        yield


@pytest.fixture(scope="session", autouse=True)
def _times_are_told_soon() -> Iterator[None]:
    """How long a simulation takes, by which runs say what is left, is measured for a moment."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("slide_fmu.data.simulation_time.TIMED", 0.1)
        yield


@pytest.fixture(name="few_motions")
def _few_motions() -> Iterator[None]:
    """The decay is measured on few motions, and an FMU under few tones."""
    with few_motions():
        yield


@pytest.fixture(autouse=True)
def _no_recipe_is_used() -> None:
    """Files of former tests' recipes are not found."""
    make_importable()


@pytest.fixture(scope="session")
def _chromium(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """A browser; its profile is removed with the other temporary folders."""
    with browser(tmp_path_factory.mktemp("profile")) as found:
        yield found


@pytest.fixture(scope="module")
def chromium(_chromium: Browser) -> Browser:
    """A page of the browser, whose storage no other module's page has seen."""
    _chromium.begin_anew()
    return _chromium
