"""This module reads recipes from TOML files."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from slide_fmu.core.file_kinds import file_of_another_kind
from slide_fmu.core.files import reason_of
from slide_fmu.core.signals import UNUSABLE
from slide_fmu.core.suggestions import or_meant
from slide_fmu.recipe.open_recipe import OpenRecipe
from slide_fmu.recipe.quick import with_at_most
from slide_fmu.recipe.recipe import Recipe, RecipeError

DECIMAL_COMMA = re.compile(r"(?<![\w.])(\d+),(\d+)(?![\w.])")
"""A number as in 0,015; a list of numbers has a blank behind its commas."""


def parse_recipe(text: str, source: str | Path) -> Recipe:
    """Read a recipe without open keys, as ``parse_open_recipe`` does.

    Raises:
        RecipeError: as in ``parse_open_recipe``, or a key is open.
    """
    return parse_open_recipe(text, source).resolved()


def parse_open_recipe(
    text: str, source: str | Path, at_most: Mapping[str, int] | None = None
) -> OpenRecipe:
    """Read a recipe from TOML text, which messages call ``source``.

    Where the source is a path, messages give the line of a mistake. Numbers of a quick run are at
    most those of ``at_most``, by dotted key (``slide_fmu.recipe.quick``).

    Raises:
        RecipeError: the text is no TOML or no recipe; there is one line per mistake.
    """
    try:
        tables = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise RecipeError(f"{source}: not valid TOML: {error}{_comma(text, error)}") from error
    for place, content in _texts(tables, ()):
        if UNUSABLE.search(content):
            raise RecipeError(
                f"{source}: {place} holds {content!r}; expected text without control characters "
                "and in UTF-8, since the XML files of an FMU can hold nothing else: rename what "
                "has this name"
            )
    try:
        tables = with_at_most(tables, at_most or {})
    except ValueError as error:
        raise RecipeError(f"{source}: {error}") from error
    return OpenRecipe.of(tables, str(source), text if isinstance(source, Path) else "")


def _comma(text: str, error: tomllib.TOMLDecodeError) -> str:
    """Return an ending that names a decimal comma, if the line of a mistake has one."""
    place = re.search(r"\(at line (\d+)", str(error))
    lines = text.splitlines()[int(place[1]) - 1 :][:1] if place else []
    match = DECIMAL_COMMA.search(lines[0]) if lines else None
    if match is None:
        return ""
    return f"; numbers have a decimal point: write {match[1]}.{match[2]}, not {match[0]}"


def _texts(value: Any, place: tuple[str, ...]) -> Iterator[tuple[str, str]]:
    """Return all keys and texts of a TOML file, each with the place at which it stands."""
    if isinstance(value, str):
        yield ".".join(place), value
    elif isinstance(value, dict):
        for key, inner in value.items():
            yield ".".join(place) or "the file", key
            yield from _texts(inner, (*place, key))
    elif isinstance(value, list):
        for inner in value:
            yield from _texts(inner, place)


def load_recipe(path: str | Path) -> Recipe:
    """Read a recipe file such as ``training/duffing.toml``; keys that it lacks have defaults.

    Raises:
        RecipeError: the file cannot be read, it is no recipe, or a key is open;
            there is one line per mistake.
    """
    return load_open_recipe(path).resolved()


def load_open_recipe(path: str | Path) -> OpenRecipe:
    """Read a recipe file, which may leave keys to be found.

    Raises:
        RecipeError: the file cannot be read, or it is no recipe; there is one line per mistake.
    """
    return parse_open_recipe(read_recipe_text(Path(path)), Path(path))


def read_recipe_text(path: Path) -> str:
    """Return the text of a recipe file.

    Raises:
        RecipeError: the file cannot be read, or is another by its name.
    """
    other = file_of_another_kind(path, "a TOML file")
    if other is not None and path.suffix != ".toml":
        raise RecipeError(f"recipe {str(path)!r} {other}")
    try:
        return path.read_text(encoding="utf-8-sig")  # some editors begin files with a mark
    except OSError as error:
        others = [str(other) for other in path.parent.glob("*.toml")] if path.name else []
        raise RecipeError(
            f"recipe {str(path)!r} cannot be read ({reason_of(error)}); expected a TOML file "
            f"such as training/duffing.toml{or_meant(str(path), others)}"
        ) from error
    except UnicodeDecodeError as error:
        raise RecipeError(
            f"recipe {str(path)!r} is no text ({error.reason}); expected a TOML file such as "
            "training/duffing.toml"
        ) from error
