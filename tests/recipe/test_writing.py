"""A proposed recipe is read again as it was meant."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from slide_fmu.recipe.default_excitation import default_excitation
from slide_fmu.recipe.reading import parse_open_recipe
from slide_fmu.recipe.writing import DraftSignal, ModelDraft, recipe_name, recipe_text
from slide_fmu.systems.declared import DeclaredModel, DeclaredParameter, SignalTable

ROAD = {
    "front.road [m]": SignalTable(
        unit="m", range=(-0.05, 0.05), description='height "under" the tyre', hold="first_order"
    )
}
TRAVEL = {"travel": SignalTable(unit="m", range=(-0.1, 0.2))}
FOUND = DeclaredModel(
    "fmu",
    "my models/car.fmu",
    (
        DeclaredParameter("mass", 300.0, "kg", "of the body\nwithout driver"),
        DeclaredParameter("stiff", True),
    ),
    ROAD,
    TRAVEL,
)


def draft(found: DeclaredModel = FOUND, name: str = "car", step: float = 0.01) -> ModelDraft:
    inputs = tuple(DraftSignal(*pair, "Given.") for pair in ROAD.items())
    outputs = tuple(DraftSignal(*pair, "Seen.") for pair in TRAVEL.items())
    said = name, 'a car, "quarter"', inputs, outputs, step, "It was\ngiven."
    return ModelDraft(*said, found, default_excitation(step))


def test_proposed_recipe_is_read_with_its_signals_and_defaults() -> None:
    read = parse_open_recipe(recipe_text(draft()), "draft")
    recipe = read.guess
    assert (recipe.name, recipe.description) == ("car", 'a car, "quarter"')
    assert (recipe.system.kind, recipe.system.model) == ("fmu", "my models/car.fmu")
    assert recipe.system.parameters == {}  # all are comments: the model has its own values
    assert recipe.system.inputs == ROAD
    assert recipe.system.outputs == TRAVEL
    assert recipe.window.step == 0.01
    assert recipe.estimator is None
    assert recipe.bound is not None
    expert = recipe.bound.expert
    spans = expert.short_span, expert.long_span, recipe.bound.estimate_span
    assert spans == (0.06, 0.6, 0.6)
    assert expert.companion.starts == 1
    assert {"data.companion", "data.bound", "data.calibration"} <= set(read.open_keys)
    assert "window.n_in" in read.open_keys


def test_commented_parameters_are_valid_when_the_mark_is_removed() -> None:
    text = recipe_text(draft())
    assert "# mass = 300.0  # kg of the body without driver\n" in text
    with_values = text.replace("# mass = ", "mass = ").replace("# stiff = ", "stiff = ")
    assert parse_open_recipe(with_values, "draft").guess.system.parameters == {
        "mass": 300.0,
        "stiff": True,
    }


def test_recipe_of_a_class_has_no_tables_of_signals() -> None:
    own = ModelDraft("car", "", (), (), 0.02, "Given.", FOUND, (), declares_signals=True)
    recipe = parse_open_recipe(recipe_text(own), "draft").guess
    assert (recipe.system.inputs, recipe.system.outputs) == ({}, {})


@given(
    text=st.text(st.characters(codec="utf-8", exclude_categories=["Cs", "Cc"]), min_size=1),
    step=st.floats(1e-6, 100.0),
)
def test_any_names_of_a_model_survive(text: str, step: float) -> None:
    found = DeclaredModel("fmu", text, (DeclaredParameter(text, 1.0, text, text),), ROAD, TRAVEL)
    recipe = parse_open_recipe(recipe_text(draft(found, step=step)), "draft").guess
    assert (recipe.system.model, recipe.window.step) == (text, step)


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("QuarterCar", "quarter_car"),
        ("my model-2", "my_model_2"),
        ("2nd", "model_2nd"),
        ("模型", "model"),
        ("a.b", "a_b"),
    ],
)
def test_recipe_name_is_an_identifier(text: str, name: str) -> None:
    assert recipe_name(text) == name
