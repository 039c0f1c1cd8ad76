"""Every key of a recipe has a meaning, stands on the site's page, and is suggested for a typo."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

from slide_fmu.core.toml_table import Table
from slide_fmu.recipe.learning import METHODS
from slide_fmu.recipe.reading import parse_open_recipe
from slide_fmu.recipe.recipe import Recipe, RecipeError
from slide_fmu.recipe.reference import ITEM, NAME, Section, known_keys, sections_of
from tests.refusals import refused

ROOT = Path(__file__).parents[2]
SECTIONS = list(sections_of(Recipe))
PUMP = '[system]\nmodel = "pump:Pump"\n[window]\nstep = 0.01\n'
HEAD = 'name = "pump"\ndescription = "a pump"\n'


def place_of(section: Section) -> str:
    return ".".join(section.place) or "recipe"


PAGE = (ROOT / "docs/recipe.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("section", SECTIONS, ids=place_of)
def test_every_key_of_a_table_has_a_meaning(section: Section) -> None:
    assert section.keys
    for key in section.keys:
        assert len(key.meaning.split()) >= 3, f"{section.table.__name__}.{key.name}"
        assert key.type


def test_page_of_recipes_is_that_of_the_tables() -> None:
    sys.path.insert(0, str(ROOT / "docs"))
    try:
        from recipe_page import recipe_page
    finally:
        sys.path.pop(0)
    assert recipe_page() == PAGE, "write it again: python docs/recipe_page.py"


def test_every_key_stands_on_the_page_with_its_meaning() -> None:
    """Kind and weight of excitations stand once, and other kinds refer to the first amplitude."""
    parts = re.split(r"^###? ", PAGE, flags=re.MULTILINE)
    (shared,) = [part for part in parts if part.startswith("Excitation")]
    (first,) = [part for part in parts if part.startswith('Kind `"held_random"`')]
    parts = [part + first * ('As for `"held_random"`' in part) for part in parts]
    for section in SECTIONS:
        is_kind = section.tag is not None and section.tag[0] == "kind"
        keys = [key for key in section.keys if not is_kind or key.name not in ("kind", "weight")]
        found = [part for part in parts if all(f"| `{key.name}` | " in part for key in keys)]
        assert [
            part for part in found if all(key.meaning.replace("|", r"\|") in part for key in keys)
        ]
        for key in set(section.keys) - set(keys):
            assert f"| `{key.name}` | " in shared
            assert key.meaning in shared


def test_page_names_tables_as_files_write_them() -> None:
    headings = [line for line in PAGE.splitlines() if line.startswith("## `[")]
    assert any("`[training.expert]`" in heading for heading in headings)
    assert not [h for h in headings if any(method in h for method in METHODS.values())]


FILLED_IN = {"method", "digest"}
"""No file has these: they follow from the family, and from the content of a file."""


def test_sections_are_all_tables_that_a_recipe_can_have() -> None:
    """An independent way to the same classes: whatever pydantic has built for the recipe."""
    schema = Recipe.model_json_schema()
    assert {section.table.__name__ for section in SECTIONS} == {*schema["$defs"], "Recipe"}
    for section in SECTIONS:
        named = schema if section.table is Recipe else schema["$defs"][section.table.__name__]
        names = set(named["properties"]) - FILLED_IN
        assert {key.name for key in section.keys} == names


def test_keys_are_those_of_a_place_with_names_and_items() -> None:
    assert "urdf" in known_keys(Recipe, ("system", "chain"))
    assert "hold" in known_keys(Recipe, ("system", "inputs", "speed"))
    assert "components" in known_keys(Recipe, ("data", "excitation", 3, "multisine"))
    assert known_keys(Recipe, ("nowhere",)) == []
    assert {NAME, ITEM} <= {part for section in SECTIONS for part in section.place}


MISSPELT = {
    "in a table": ("[data]\ntrian = 3\n", "data.trian is not a known key; did you mean train?"),
    "of a table": ("[dta]\ntrain = 3\n", "dta is not a known key; did you mean data?"),
    "in a form": (
        "[network]\nhiden = 3\n",
        "network.hiden is not a known key; did you mean hidden?",
    ),
    "in a kind": (
        '[[data.excitation]]\nkind = "sweep"\nweight = 1\nangular_frequncy = [1, 2]\n'
        "angular_frequency = [1, 2]\n",
        "1st [[data.excitation]] (sweep), key angular_frequncy is not a known key; did you mean "
        "angular_frequency?",
    ),
    "in another table": (
        "[data]\nn_in = 30\n",
        "data.n_in is not a known key; n_in is one of [window]: move or remove it",
    ),
    "of the table for experts": (
        "[training]\nkept = 3\n",
        "training.kept is not a known key; kept is one of [training.expert]: move or remove it",
    ),
    "nowhere": ("[data]\nxyz = 3\n", "data.xyz is not a known key; remove it or correct"),
    "a family": (
        '[network]\nfamily = "statespace"\n',
        "network.family = 'statespace'; expected one of 'feed_forward', 'state_space'; did you "
        "mean 'state_space'?",
    ),
    "a choice": (
        '[network]\nunits = "tahn"\n',
        "network.units = 'tahn': expected 'tanh', 'cubic', 'mixed', 'gated' or 'auto'; did you "
        "mean 'tanh'?",
    ),
    "a kind": (
        '[[data.excitation]]\nkind = "multisin"\nweight = 1\n',
        "; did you mean 'multisine'?",
    ),
    "a hold": (
        '[system.inputs.speed]\nhold = "linear"\n',
        "system.inputs.speed.hold = 'linear': expected 'zero_order' or 'first_order'",
    ),
}


@pytest.mark.parametrize("case", MISSPELT)
def test_misspelt_word_gets_a_suggestion(case: str) -> None:
    more, message = MISSPELT[case]
    with pytest.raises(RecipeError) as caught:
        parse_open_recipe(HEAD + PUMP + more, "pump.toml")
    assert f"pump.toml: {message}" in str(caught.value) or message in str(caught.value)
    assert str(caught.value).count("\n") == 0


OF_ANOTHER_TYPE = {
    "[data]\ntrain = true": "data.train = true: expected a whole number",
    '[data]\ntrain = "30"': "data.train = '30': expected a whole number",
    "[data]\ntrain = 30.0": "data.train = 30.0: expected a whole number",
    "[data]\nduration = true": "data.duration = true: expected a number",
    "[training.expert]\neven_out = 1": "training.expert.even_out = 1: expected true or false",
    '[training.expert]\neven_out = "yes"': (
        "training.expert.even_out = 'yes': expected true or false"
    ),
    "[estimator.expert]\nin_range = true": "estimator.expert.in_range = true: expected a number",
    "[network]\nunits = 3": "network.units = 3: expected 'tanh', 'cubic'",
    "[stability]\namplitudes = [1, true]": (
        "2nd value of stability.amplitudes = true: expected a number"
    ),
    '[[data.excitation]]\nkind = "rest"\nweight = true\nduration = [1, 2]': (
        "1st [[data.excitation]] (rest), key weight = true: expected a number"
    ),
}


@pytest.mark.parametrize("more", OF_ANOTHER_TYPE)
def test_value_of_another_type_is_refused(more: str) -> None:
    with pytest.raises(RecipeError) as caught:
        parse_open_recipe(f"{HEAD}{PUMP}{more}\n", "pump.toml")
    assert str(caught.value).startswith(f"pump.toml: {OF_ANOTHER_TYPE[more]}")


def test_step_of_another_type_is_refused() -> None:
    with refused(RecipeError, "window.step = true", "expected a number"):
        parse_open_recipe(HEAD + PUMP.replace("0.01", "true"), "pump.toml")


def test_name_of_another_form_is_refused_in_words() -> None:
    with refused(RecipeError, "name = 'my", "expected a letter first"):
        parse_open_recipe(HEAD.replace('"pump"', '"my pump"') + PUMP, "pump.toml")


def test_whole_numbers_count_as_numbers_and_lists_as_ranges() -> None:
    more = "[data]\nduration = 3\nburn_in = 0\nbeyond_factor = [1, 2]\n"
    data = parse_open_recipe(HEAD + PUMP + more, "pump.toml").guess.data
    assert (data.duration, data.beyond_factor) == (3.0, (1.0, 2.0))


def test_table_takes_tuples_as_well_as_lists() -> None:
    class Pair(Table):
        """Two numbers."""

        values: tuple[tuple[int, ...], ...]

    assert Pair(values=[[1, 2], [3]]).values == Pair(values=((1, 2), (3,))).values  # type: ignore[arg-type]
