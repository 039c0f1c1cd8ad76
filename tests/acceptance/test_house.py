"""The house stays small: rooms, files and names keep to the rules of ``docs/contributing.md``."""

from __future__ import annotations

import ast
from pathlib import Path

import grimp
import pytest

from slide_fmu.excitation.base import Kind
from slide_fmu.excitation.loop import LoopRecipe
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.recipe.reference import sections_of

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "slide_fmu"
ROOMS = sorted(path.parent for path in PACKAGE.glob("*/__init__.py"))
APPS = sorted(path.parent for path in PACKAGE.glob("apps/*/__init__.py"))
ALL_APPS = len(list((ROOT / "tests" / "apps").glob("*/__init__.py")))

MOST_LINES = 5000
"""A room or an app of more lines than this holds two of them."""
SMALL = 60
"""A file of fewer lines, which one other file alone imports, belongs into that file."""
SMALL_FILES = {
    "slide_fmu.records.answer_table": "the one list of what records answer otherwise",
    "slide_fmu.apps.compare.baselines.candidates": "the one list of candidates",
    "slide_fmu.apps.compare.baselines.linear": "each kind of baseline has a file",
    "slide_fmu.apps.credentials.agreement": "it compares with the provenance, and reads nothing",
    "slide_fmu.fmu.description.build_description": "each document of a standard has a file",
    "slide_fmu.fmu.description.twincat": "each document of a standard has a file",
    "slide_fmu.network.state_space.parameter_slopes": "it belongs to the family, not to its user",
    "slide_fmu.cli.completion": "the console script imports it before all others",
    "slide_fmu.propose.surrogate_model": "the one case of a model that is a surrogate",
    "slide_fmu.network.feed_forward.bytes": "each family has its bytes in a file of this name",
    "slide_fmu.network.feed_forward.gradient": "each family has its gradient in such a file",
}
"""Files that are small for a reason."""
MOST_OF_PIPELINE = 2_500
"""The stages of the way stand here alone; what they do is in other rooms."""
MOST_KEYS = 170
"""A recipe has no more keys than this, without the tables for experts. Which kind of excitation a
table is, and its weight, count for no key."""
NAMES = {
    *("measured", "given", "alike", "meeting", "patience", "lasting", "way", "grip", "lamp"),
    *("utils", "helpers", "misc", "common"),
}
"""These names do not say what is in a file."""


def lines_of(folder: Path) -> int:
    """The lines of Python below a folder."""
    return sum(len(path.read_text("utf-8").splitlines()) for path in folder.rglob("*.py"))


@pytest.mark.parametrize(
    "room", [r for r in ROOMS if r.name != "apps"] + APPS, ids=lambda path: path.name
)
def test_room_is_small_enough_to_be_known(room: Path) -> None:
    assert lines_of(room) <= {"pipeline": MOST_OF_PIPELINE}.get(room.name, MOST_LINES)


@pytest.mark.skipif(len(APPS) < ALL_APPS, reason="an app was removed, which used some files")
def test_small_files_have_more_than_one_user() -> None:
    graph = grimp.build_graph("slide_fmu", cache_dir=None)
    found = set()
    for module in graph.modules:
        path = ROOT.joinpath(*module.split(".")).with_suffix(".py")
        users = graph.find_modules_that_directly_import(module)
        if path.exists() and len(users) == 1 and len(path.read_text("utf-8").splitlines()) < SMALL:
            found.add(module)
    assert found <= SMALL_FILES.keys()


def test_names_of_files_say_what_is_in_them() -> None:
    files = [path for end in ("py", "js", "c", "h") for path in PACKAGE.rglob(f"*.{end}")]
    assert [str(path.relative_to(ROOT)) for path in files if path.stem in NAMES] == []


def test_public_names_of_classes_have_one_meaning() -> None:
    homes: dict[str, list[str]] = {}
    for path in PACKAGE.rglob("*.py"):
        for node in ast.parse(path.read_text("utf-8")).body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                homes.setdefault(node.name, []).append(str(path.relative_to(ROOT)))
    found = {name: sorted(files) for name, files in homes.items() if len(files) > 1}
    assert found == {}


def test_every_app_has_one_row_and_every_row_its_app() -> None:
    text = (ROOT / "pyproject.toml").read_text("utf-8")
    _, _, rest = text.partition('[project.entry-points."slide_fmu.apps"]\n')
    rows = rest.split("\n\n")[0].strip().splitlines()
    assert rows == [f'{app.name} = "slide_fmu.apps.{app.name}.app:APP"' for app in APPS]


def test_recipes_have_few_keys() -> None:
    of_tables = {s.table: s.keys for s in sections_of(Recipe) if "expert" not in s.place}
    keys = [
        (table.__name__, key.name)
        for table, found in of_tables.items()
        for key in found
        if not (issubclass(table, Kind | LoopRecipe) and key.name in ("kind", "weight"))
    ]
    assert len(keys) <= MOST_KEYS, keys
