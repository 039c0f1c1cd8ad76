"""Slips in recipes: each is told in one line of plain words, with what may be meant."""

from __future__ import annotations

from pathlib import Path

import pytest

from slide_fmu.core.units import require_unit
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.places import RecipeFile, in_words, line_of
from slide_fmu.recipe.reading import load_open_recipe, parse_open_recipe
from slide_fmu.recipe.recipe import RecipeError
from slide_fmu.systems.errors import LoadError
from tests.recipes import tiny_recipe
from tests.refusals import refused

PLAIN = """
name = "spring"
description = "a spring"

[system]
kind = "function"
model = "spring.py"

[system.parameters]
mass = 1.0

[system.inputs.force]
range = [-1.0, 1.0]

[window]
step = 0.1

[[data.excitation]]
kind = "held_random"
weight = 1.0
amplitude = [0.1, 1.0]
samples = [1, 5]
"""


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            "step = 0.1",
            'step = 0.1\nn_in = "atuo"',
            ("n_in = 'atuo'", "did you mean 'auto'?"),
        ),
        (
            "amplitude = [0.1, 1.0]",
            "amplitude = [0.1, 1.0, 2.0]",
            ("1st [[data.excitation]] (held_random), key amplitude", "2 values, not 3"),
        ),
        ("range = [-1.0, 1.0]", "range = [-1.0]", ("force.range = [-1.0]", "[LOW, HIGH]")),
        (
            "range = [-1.0, 1.0]",
            "range = [10, -10]",
            ("range = [10, -10]", "smaller one first"),
        ),
        ("mass = 1.0", "mass = inf", ("system.parameters.mass = inf", "a finite number")),
        (
            "[window]",
            "[training]\nbatch = 4\n\n[window]",
            (
                "training.batch",
                "network.family = 'state_space'",
                "only where it is 'feed_forward'",
            ),
        ),
        (
            "samples = [1, 5]",
            "samples = [1, 5]\ncoefficients = [3, 4]",
            (
                "key coefficients",
                "kind = 'held_random'",
                "only where it is 'moving_average_random'",
            ),
        ),
        (
            "[window]",
            "[validation]\nrequire = 5\n\n[window]",
            ("validation.require = 5", "at most 1"),
        ),
        ("name = ", "int = 3\nname = ", ("int is not a known key", "remove it")),
        (
            "range = [-1.0, 1.0]",
            'range = [-1.0, 1.0]\nunits = "N"',
            ("system.inputs.force.units", "did you mean unit?"),
        ),
        (
            "[[data.excitation]]",
            "[data.excitation]",
            ("data.excitation", "write [[data.ex"),
        ),
        ("samples = [1, 5]", "samples = 5", ("key samples = 5", "such as [5, 5]")),
        (
            "[window]",
            "[bound.expert]\nhidden = 3\n\n[window]",
            ("bound.expert.hidden = 3", "such as [3]"),
        ),
        (
            '"spring.py"',
            '"spring.py"\nfurther = "other.py"',
            ("system.further = 'other.py'", "such as ['other.py']"),
        ),
        ('"function"', '"functions"', ("system.kind = 'functions'", "did you mean 'function'?")),
        (
            "range = [-1.0, 1.0]",
            'range = [-1.0, 1.0]\nunit = "Nn"',
            ("system.inputs.force.unit", "unit 'Nn'", "write 'N' or 'nm', or '1'"),
        ),
        ("[window]", "[windows]", ("windows is not a known key", "did you mean window?")),
    ],
)
def test_slip_in_a_recipe_gives_one_line(old: str, new: str, words: tuple[str, ...]) -> None:
    assert old in PLAIN
    with refused(RecipeError, "spring.toml: ", *words) as caught:
        parse_open_recipe(PLAIN.replace(old, new, 1), "spring.toml")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("mark", [b"\xef\xbb\xbf", b""])
@pytest.mark.parametrize("ending", [b"\r\n", b"\n"])
def test_recipe_of_an_editor_of_windows_is_read(
    tmp_path: Path, mark: bytes, ending: bytes
) -> None:
    place = tmp_path / "spring.toml"
    place.write_bytes(mark + PLAIN.encode().replace(b"\n", ending))
    assert load_open_recipe(place).guess == parse_open_recipe(PLAIN, "spring.toml").guess


def test_unit_without_a_text_is_answered_once() -> None:
    with refused(ValueError, "'' is none", "number without"):
        require_unit("force", "")


SECOND = """
[[data.excitation]]  # the second of two
weight = 1.0
kind = "sweep"
rate = 3
"""


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("range = [-1.0, 1.0]", "range = [1.0, -1.0]", "line 13: system.inputs.force.range = "),
        ("amplitude = [0.1, 1.0]", "amplitude = [0.1]", "line 21: 1st [[data.excitation]] (held"),
        (
            "weight = 1.0\nkind",
            "weight = 0.0\nkind",
            "line 25: 2nd [[data.excitation]] (sweep), key w",
        ),
        (
            '"sweep"',
            '"swep"',
            "line 26: 2nd [[data.excitation]], key kind = 'swep'; expected one of",
        ),
        (
            "rate = 3",
            "",
            "line 24: 2nd [[data.excitation]] (sweep), key angular_frequency is missing",
        ),
        ("step = 0.1", "", "line 15: window.step is missing"),
        (
            "range = [-1.0, 1.0]",
            'range = [-1.0, 1.0]\nunit = "kNewton"',
            "line 14: system.inputs.force.unit: signal 'force': unit 'kNewton'",
        ),
    ],
)
def test_mistake_in_a_file_has_its_line(tmp_path: Path, old: str, new: str, line: str) -> None:
    place, text = tmp_path / "spring.toml", PLAIN + SECOND
    assert old in text
    place.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(RecipeError) as raised:
        load_open_recipe(place)
    assert any(told.startswith(f"{place}, {line}") for told in str(raised.value).splitlines())


def test_decimal_comma_is_named(tmp_path: Path) -> None:
    place = tmp_path / "spring.toml"
    place.write_text(PLAIN.replace("step = 0.1", "step = 0,015"), encoding="utf-8")
    with refused(RecipeError, "decimal point: write 0.015, not 0,015"):
        load_open_recipe(place)


def test_missing_recipe_has_the_nearest_name(tmp_path: Path) -> None:
    (tmp_path / "crane.toml").write_text(PLAIN, encoding="utf-8")
    with refused(RecipeError, "did you mean", "crane.toml"):
        load_open_recipe(tmp_path / "krane.toml")


@pytest.mark.parametrize(
    ("unit", "meant"),
    [("kNewton", "write 'kN', or"), ("lbs", "write 'lbf' or 'lb', or"), ("bars", "write 'bar',")],
)
def test_unit_written_in_full_or_in_the_plural_has_its_symbol(unit: str, meant: str) -> None:
    with refused(ValueError, meant):
        require_unit("load", unit)


def test_lines_are_found_below_inline_tables_and_tables_of_items() -> None:
    text = """a.b = { c = 1 }
[[list]]
[list.inner]
x = [
  [1, 2],
]
"key.part" = 2
[[list]]
  [[list.deep]]
  y = 1
"""
    found = {
        ("a", "b", "c"): 1,
        ("list", 0, "inner", "x", 0, 1): 4,
        ("list", 0, "other"): 2,
        ("list", 1, "deep", 0, "y"): 10,
        ("list", 1, "deep", 0, "z"): 9,
        ("none",): None,
    }
    assert {place: line_of(text, place) for place in found} == found


def test_places_in_lists_are_counted_from_one() -> None:
    assert in_words(("data", "excitation", 4, "samples", 0)) == (
        "5th [[data.excitation]], 1st value of samples"
    )
    assert in_words(("points", 10, 1)) == "2nd value in the 11th value of points"
    assert in_words(("window", "step")) == "window.step"


@pytest.mark.parametrize(
    ("table", "key", "text"),
    [
        ("system", "parameters", "[system]\nparameters = { stifness = 1.0 }\n"),
        ("system", "reference", "[system]\n[system.reference]\nstifness = 1.0\n"),
    ],
)
def test_parameter_that_the_model_does_not_have_is_named_with_its_line(
    table: str, key: str, text: str
) -> None:
    recipe = tiny_recipe(**{table: {key: {"stifness": 1.0}}})
    case = case_of(recipe, file=RecipeFile("spring.toml", text))
    line = 1 + text[: text.index("stifness")].count("\n")
    with refused(LoadError, f"spring.toml, line {line}: {table}.{key}.stifness: ", "'stiffness'?"):
        _ = case.reference
