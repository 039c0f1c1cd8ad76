"""The table of a recipe for a file of the user's own inputs is written, alone or into a recipe."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from slide_fmu.excitation.recorded import Recorded
from slide_fmu.recipe.default_excitation import KindTable
from slide_fmu.recipe.model_rules import rules_of
from slide_fmu.recipe.reading import parse_open_recipe
from slide_fmu.recipe.recipe import Recipe, RecipeError
from slide_fmu.recipe.writing import comment_lines, kind_tables

LEARNT = 0.5
"""Part of the file, in time from its beginning, that is learnt; the rest judges."""

SHARE = 0.25
"""Share of a file among the motions that are drawn: about as many as of four usual kinds, since
these inputs are those that will come."""


def table_of_inputs(path: str, others: Sequence[Mapping[str, Any]]) -> KindTable:
    """Return the table of a file of inputs in a mix, next to the tables of the other kinds."""
    weight = sum(float(other["weight"]) for other in others) * SHARE / (1.0 - SHARE)
    return {"kind": "file", "weight": float(f"{weight:.2g}"), "path": path, "learnt": LEARNT}


def lines_of_inputs(table: KindTable) -> list[str]:
    """Write the table of a file of inputs with its comment."""
    comment = (
        "These are your inputs. The training learns from the first half of this file, in time. "
        "The second half is never learnt: it judges the FMU, as the first row of report and card."
    )
    return [*comment_lines(comment), *kind_tables("data.excitation", [table])]


def with_inputs(text: str, source: str | Path, path: str) -> str:
    """Return the text of a recipe with a file of inputs among the kinds of its data.

    A recipe that names no kinds gets those that follow from its step, too. One that names the same
    file already stays as it is.

    Args:
        text: the text of the recipe.
        source: its name in messages.
        path: the file of inputs, as the recipe shall name it.

    Raises:
        RecipeError: the text is no recipe, is about measured records, names another file that
            judges, or has kinds to which none can be added.
    """
    recipe = parse_open_recipe(text, source).guess
    known = [k for k in recipe.data.excitation if isinstance(k, Recorded) and k.judges]
    if any(Path(kind.path) == Path(path) for kind in known):
        return text
    _require_addable(recipe, source, [kind.path for kind in known], path)
    tables = [_written(kind) for kind in recipe.data.excitation]
    lines = []
    if "excitation" not in tomllib.loads(text).get("data", {}):
        lines = kind_tables("data.excitation", tables)
    lines += lines_of_inputs(table_of_inputs(path, tables))
    more = "\n".join([text.rstrip("\n"), "", *lines])
    try:
        tomllib.loads(more)
    except tomllib.TOMLDecodeError as error:
        raise RecipeError(
            f"{source}: --inputs {path} cannot be added to data.excitation ({error}); expected "
            "tables [[data.excitation]]: write its kinds so"
        ) from error
    return more


def _require_addable(recipe: Recipe, source: str | Path, known: Sequence[str], path: str) -> None:
    """Refuse a file for a recipe of records, or with another file that judges."""
    if not rules_of(recipe).simulated:
        raise RecipeError(
            f"{source}: --inputs {path} with system.kind = {recipe.system.kind!r}; expected a "
            "model that is simulated: records hold the inputs that judge, so leave it out"
        )
    if known:
        raise RecipeError(
            f"{source}: --inputs {path}, but the recipe names {known[0]!r} as your inputs; "
            "expected one of them: leave out --inputs, or remove its table of data.excitation"
        )


def _written(kind: Any) -> KindTable:
    """Return the table of a kind as a recipe may hold it, without keys that have defaults."""
    values = kind.model_dump(mode="json", exclude_defaults=True)
    return {key: value for key, value in values.items() if value is not None}
