"""A key that a recipe does not know is told with the one that may be meant."""

from __future__ import annotations

from slide_fmu.core.suggestions import nearest
from slide_fmu.core.toml_table import Table
from slide_fmu.recipe.reference import known_keys, sections_of


def unknown_key(place: tuple[str | int, ...], file: type[Table] | None) -> str:
    """Say that a key is not known, and which one may be meant.

    Args:
        place: the key's place in the file, its own name last.
        file: the outermost table of the file; nothing is suggested where there is none.
    """
    *table, key = place
    if file is not None and (other := _of_other_forms(tuple(table), str(key), file)):
        return other
    known = known_keys(file, tuple(table)) if file is not None else []
    elsewhere = [] if file is None else _tables_with(str(key), file)
    if elsewhere:
        return f"is not a known key; {key} is one of {' and '.join(elsewhere)}: move or remove it"
    meant = nearest(str(key), known)
    if meant is not None:
        return f"is not a known key; did you mean {meant}? Correct its spelling, or remove it"
    return "is not a known key; remove it or correct its spelling"


def _of_other_forms(table: tuple[str | int, ...], key: str, file: type[Table]) -> str | None:
    """Say that a key belongs to a table of another form, as of another family; else return None.

    Args:
        table: the table's place in the file, its form last, as ``("network", "state_space")``.
        key: the key that it does not have.
        file: the outermost table of the file.
    """
    alike = [s for s in sections_of(file) if s.tag and s.matches((*table[:-1], s.tag[1]))]
    forms = [s.tag[1] for s in alike if s.tag and key in [each.name for each in s.keys]]
    if not table or not forms or table[-1] not in [s.tag[1] for s in alike if s.tag]:
        return None
    (name,) = {s.tag[0] for s in alike if s.tag}
    switch = "network.family" if table[0] in ("network", "training") else name
    return (
        f"is not a known key where {name} = {table[-1]!r}, only where it is "
        f"{' or '.join(map(repr, forms))}: remove it, or choose another {switch}"
    )


def _tables_with(key: str, file: type[Table]) -> list[str]:
    """Return the names of a file's tables that have a key, without items of lists."""
    places = [s.place for s in sections_of(file) if key in [each.name for each in s.keys]]
    named = [f"[{place[0]}]" for place in places if len(place) == 1 or len(place) == 2]
    return list(dict.fromkeys(named))[:3]
