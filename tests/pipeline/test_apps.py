"""Apps that cannot be used are named, and what they take part in goes on without the others."""

from __future__ import annotations

from importlib.metadata import EntryPoint

import pytest

from slide_fmu.pipeline import apps as registry
from slide_fmu.pipeline.apps import App, AppError, apps, subcommands_of_apps

NOWHERE = "slide_fmu.report.quality"


@pytest.fixture(autouse=True)
def _apps_of_the_test_are_forgotten() -> object:
    apps.cache_clear()
    yield
    apps.cache_clear()


@pytest.mark.parametrize(
    ("value", "word"),
    [
        ("slide_fmu.nowhere:APP", "No module named"),
        (f"{NOWHERE}:APP", "has no attribute 'APP'"),
        (f"{NOWHERE}:QualityError", "QualityError"),
    ],
)
def test_app_that_cannot_be_loaded_is_named_with_the_remedy(
    monkeypatch: pytest.MonkeyPatch, value: str, word: str
) -> None:
    entry = EntryPoint("broken", value, registry.GROUP)
    monkeypatch.setattr(registry, "entry_points", lambda group: [entry])
    with pytest.raises(AppError) as error:
        apps()
    assert all(part in str(error.value) for part in ("'broken'", word, "uninstall it"))


@pytest.mark.parametrize(
    ("found", "word"),
    [
        ({"one": App(subcommands={"absent": NOWHERE})}, "absent"),
        (
            {
                "one": App(subcommands={"QualityError": NOWHERE}),
                "two": App(subcommands={"QualityError": NOWHERE}),
            },
            "is a subcommand",
        ),
    ],
)
def test_subcommand_that_is_not_there_or_there_twice_is_refused(
    monkeypatch: pytest.MonkeyPatch, found: dict[str, App], word: str
) -> None:
    monkeypatch.setattr(registry, "apps", lambda: found)
    with pytest.raises(AppError, match=word):
        subcommands_of_apps()
