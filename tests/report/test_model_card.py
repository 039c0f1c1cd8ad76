"""What the model card, the report and their bars show of a validation."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from slide_fmu.excitation.mix import names_of
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.report.accuracy_sections import validation_sections
from slide_fmu.report.model_card import model_card
from slide_fmu.report.run_figures import RunFigures
from slide_fmu.validation.error_figures import ValidationFigures
from slide_fmu.validation.results import Validation
from tests.recipes import tiny_recipe
from tests.validation.tiny_validation import FINER, PLAIN, figures_of


def test_report_and_card_show_the_error_of_the_model(finer: Validation) -> None:
    error = finer.figures().outputs[0].model_relative_rmse
    assert error is not None
    percent = f"{100 * error:.3g} %"
    sections = validation_sections({"in range": finer, "beyond": finer})
    (section,) = [one for one in sections if one.title.startswith("Side by side")]
    assert "finer model" in section.text
    assert section.table is not None
    assert section.table.heading[-1] == "relative RMSE of the data's model"
    assert [row[-1] for row in section.table.rows] == [percent] * 2
    assert table_of(finer, FINER)[-1].endswith(f" | {percent} |")
    assert len({row.count("|") for row in table_of(finer, FINER)}) == 1
    plain = table_of(finer, PLAIN)
    assert {row.count("|") for row in plain} == {8}


def table_of(found: Validation, recipe: Recipe) -> list[str]:
    """Lines of the card's table of measured errors."""
    text = model_card(found.surrogate, recipe, figures_of(found), "picture.png")
    assert ("The reference is a finer model (substeps 24)" in text) == bool(
        recipe.system.reference
    )
    lines = text.split("## Measured error")[1].split("By kind of excitation")[0].splitlines()
    return [line for line in lines if line.startswith("|")]


def test_card_compares_with_the_reference_system_itself(finer: Validation) -> None:
    text = model_card(finer.surrogate, PLAIN, figures_of(finer), "picture.png")
    assert "\nCompared with the reference system, on trajectories that no training" in text
    assert "both FMUs" not in text


def test_card_shows_the_settings_of_every_kind(finer: Validation) -> None:
    kinds = [
        {"kind": "moving_average_random", "weight": 1.0, "coefficients": [0.1, 0.9]},
        {"kind": "speed_ramps", "weight": 1.0, "speed": 8.0, "acceleration": 20.0},
        {"kind": "point_to_point", "weight": 1.0, "speed": [1.5, 2.0]},
    ]
    recipe = tiny_recipe(data={"excitation": kinds})
    average, ramps, points = (kind.settings() for kind in recipe.data.excitation)
    assert average == {"amplitude": "1.0 .. 1.0", "coefficients": "0.1, 0.9"}
    assert ramps["speed"] == "8.0"
    assert ramps["samples"] == "20 .. 60"
    assert (points["speed"], points["acceleration"]) == ("1.5, 2.0", "none")
    text = model_card(finer.surrogate, recipe, figures_of(finer), "picture.png")
    assert "| moving_average_random | 1.0 | amplitude 1.0 .. 1.0; coefficients 0.1, 0.9 |" in text
    assert "| speed_ramps | 1.0 | speed 8.0; acceleration 20.0; samples 20 .. 60; " in text


def test_card_says_why_there_is_no_error_estimate(finer: Validation) -> None:
    figures = figures_of(finer)
    text = "the FMU has no error estimate, since it would say no more than a constant: on 9 | 8"
    said = "The FMU has no error estimate, since it would say no more than a constant: on 9"
    shown, plain = (
        model_card(finer.surrogate, PLAIN, replace(figures, no_error_estimate=why), "picture.png")
        for why in (text, None)
    )
    assert said in shown.split("## Measured error")[1]
    assert said not in plain


def with_validations(found: RunFigures, **validations: ValidationFigures) -> RunFigures:
    return replace(found, validation=validations)


TWO_OF_A_KIND: list[dict[str, Any]] = [
    {"kind": "held_random", "weight": 1.0, "amplitude": [0.1, 0.2]},
    {"kind": "sweep", "weight": 1.0, "angular_frequency": [1.0, 9.0]},
    {"kind": "held_random", "weight": 2.0},
]


def test_excitations_of_one_kind_have_names_of_their_own(finer: Validation) -> None:
    recipe = tiny_recipe(data={"excitation": TWO_OF_A_KIND})
    assert names_of(recipe.data.excitation) == ["held_random 1", "sweep", "held_random 3"]
    found = figures_of(finer)
    text = model_card(finer.surrogate, recipe, found, "picture.png")
    assert "| held_random 1 | 1.0 | amplitude 0.1 .. 0.2" in text
    assert "| sweep | 1.0 |" in text
    assert "| held_random 3 | 2.0 | " in text
    row, names = found.in_range.excitations[0], names_of(recipe.data.excitation)
    rows = [replace(row, name=names[i], relative_rmse=((i + 1) / 100,)) for i in range(3)]
    found = with_validations(
        found, **{"in range": replace(found.in_range, excitations=tuple(rows))}
    )
    text = model_card(finer.surrogate, recipe, found, "picture.png")
    assert (
        "By kind of excitation, in range: held_random 1 1 %, sweep 2 %, held_random 3 3 %.\n"
        in text
    )


def test_texts_of_a_user_stay_texts_on_the_card(finer: Validation) -> None:
    strange = FINER.model_copy(
        update={
            "description": "a <script>alert(1)</script> | b",
            "equations": "x = 1\n```\n# y <img src=x onerror=alert(1)></pre>",
        }
    )
    text = model_card(finer.surrogate, strange, figures_of(finer), "picture.png")
    assert "a &lt;script&gt;alert(1)&lt;/script&gt; \\| b." in text
    assert "# y &lt;img src=x onerror=alert(1)&gt;&lt;/pre&gt;\n</pre>" in text
    assert "<img" not in text


@pytest.mark.parametrize(("error", "factor", "warned"), [(0.3, 2, 1), (0.1, 2, 0), (0.3, 1, 0)])
def test_card_warns_of_amplitudes_that_the_surrogate_does_not_know(
    finer: Validation, error: float, factor: float, warned: int
) -> None:
    found = figures_of(finer)
    output = replace(found.in_range.outputs[0], relative_rmse=error)
    beyond = replace(found.in_range, outputs=(output,), amplitude=(1.0, float(factor)))
    found = with_validations(found, **{"in range": found.in_range, "beyond the range": beyond})
    text = model_card(finer.surrogate, FINER, found, "picture.png")
    sentence = "**Do not use the surrogate there:** at 1.0 to 2.0 times the amplitude its"
    assert text.count("Do not use") == warned
    assert text.count(f"{sentence} relative RMSE is up to 30 %.") == warned


def test_card_begins_with_the_range_whatever_the_order_of_the_figures(finer: Validation) -> None:
    """An FMU keeps its figures with sorted keys, where "beyond the range" is the first one."""
    found = figures_of(finer)
    main = found.in_range
    excitations = tuple(replace(row, relative_rmse=(0.5,)) for row in main.excitations)
    beyond = replace(main, excitations=excitations, amplitude=(1.0, 3.0))
    cards = []
    for order in ({"in range": main, "beyond the range": beyond}, {"beyond the range": beyond}):
        figures = with_validations(found, **{**order, "in range": main})
        cards.append(model_card(finer.surrogate, FINER, figures, "picture.png"))
    assert cards[0] == cards[1]
    measured = cards[1].split("## Measured error")[1].splitlines()
    rows = [line for line in measured if line.startswith(("| in r", "| beyond"))]
    assert [row.split(" | ")[0] for row in rows[:2]] == [
        "| in range",
        "| beyond the range (1.0 to 3.0 times the amplitude)",
    ]
    (by_kind,) = [
        line for line in cards[1].splitlines() if line.startswith("By kind of excitation")
    ]
    assert "50 %" not in by_kind


def test_card_shows_the_system_under_its_name_if_there_is_a_picture(finer: Validation) -> None:
    plain = model_card(finer.surrogate, PLAIN, figures_of(finer), "picture.png")
    drawn = model_card(finer.surrogate, PLAIN, figures_of(finer), "picture.png", "mechanism.png")
    shown = "![tiny: the system in motion](mechanism.png)\n\n"
    assert drawn.count(shown) == 1
    assert drawn.replace(shown, "") == plain
    assert drawn.index("# tiny.fmu") < drawn.index(shown) < drawn.index("| variable |")
