"""Examples on pages are files of the repository, or run as they stand."""

from __future__ import annotations

import ast
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from slide_fmu.recipe.recipe import Recipe
from slide_fmu.recipe.reference import sections_of

ROOT = Path(__file__).parents[2]
TEMPLATES = ROOT / "slide_fmu" / "propose" / "templates"


def blocks(page: str, language: str) -> list[str]:
    """Return the blocks of code in a language on a page, in their order."""
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.DOTALL | re.MULTILINE)


def without_docstring(path: Path) -> str:
    """Return the text of a module from its first statement behind the docstring on."""
    text = path.read_text(encoding="utf-8")
    first = ast.parse(text).body[1]
    return "".join(text.splitlines(keepends=True)[first.lineno - 1 :])


@pytest.mark.parametrize(
    ("number", "path"),
    [
        (0, TEMPLATES / "function.py"),
        (1, ROOT / "tests/systems/function_models/first_order_lag.py"),
        (2, TEMPLATES / "exudyn.py"),
    ],
    ids=["function", "simulate", "exudyn"],
)
def test_model_on_the_page_is_that_of_its_file(number: int, path: Path) -> None:
    assert blocks("own_model.md", "python")[number] == without_docstring(path)


def test_class_on_the_page_simulates() -> None:
    names: dict[str, type] = {}
    (example,) = [block for block in blocks("api.md", "python") if "class Lag" in block]
    exec(example, names)
    outputs = names["Lag"](step=0.1).simulate(np.ones((50, 1)))
    assert outputs.shape == (51, 1)
    assert np.allclose(outputs, 1.0)


def test_recipe_of_an_fmu_on_the_page_is_toml() -> None:
    recipe, *_ = blocks("own_model.md", "toml")
    assert tomllib.loads(recipe)["system"]["kind"] == "fmu"


def test_job_array_on_the_page_is_that_of_its_file() -> None:
    (script,) = blocks("command_line.md", "bash")
    assert script == (ROOT / "docs/many_machines/array.sh").read_text(encoding="utf-8")


@pytest.mark.parametrize("page", ["own_model.md", "records.md", "parameters.md", "robots.md"])
def test_tables_of_recipes_on_pages_have_keys_that_there_are(page: str) -> None:
    known = {key.name for section in sections_of(Recipe) for key in section.keys}
    for block in blocks(page, "toml"):
        for table in tables_of(tomllib.loads(block)):
            assert set(table) <= known, block


def tables_of(tables: dict[str, Any], inside: str = "") -> Iterator[dict[str, Any]]:
    """Return the tables of a recipe that hold keys; the model's own names are no keys."""
    yield {key: value for key, value in tables.items() if not isinstance(value, dict)}
    for key, value in tables.items():
        of_the_model = key == "columns" or (inside, key) == ("system", "parameters")
        if isinstance(value, dict) and not of_the_model:
            yield from tables_of(value, key)
        if key == "excitation":
            yield from value
