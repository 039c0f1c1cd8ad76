"""What the model card and the report show of a validation."""

from __future__ import annotations

from dataclasses import replace

import pytest

from slide_fmu.report.accuracy_sections import time_sections, validation_sections
from slide_fmu.report.model_card import model_card
from slide_fmu.report.run_figures import RunFigures
from slide_fmu.report.run_report import origin_sections
from slide_fmu.validation.error_figures import ValidationFigures
from slide_fmu.validation.results import Validation
from slide_fmu.validation.task import BEYOND
from tests.recipes import tiny_recipe
from tests.report.descriptions import described
from tests.report.made_rows import MEASURED, row, timing
from tests.validation.tiny_validation import figures_of

SCREEN = 60
"""Lines of a screen, on which a card fits."""


def test_card_has_verdict_picture_and_a_row_for_each_kind(finer: Validation) -> None:
    text = model_card(described(finer.surrogate, figures_of(finer, rows=MEASURED)), "picture.png")
    lines = text.splitlines()
    assert lines[0] == "# tiny.fmu"
    assert sum(line.startswith("- ") for line in lines) == 3
    assert "![tiny: error against communication step](picture.png)" in lines
    table = [line for line in lines if line.startswith("|")]
    assert len(table) == 2 + 3
    assert {line.count("|") for line in table} == {12}
    assert "slide-fmu validate tiny.fmu --trajectories 3 --seed 3" in lines


def test_card_of_many_kinds_fits_on_a_screen(finer: Validation) -> None:
    kinds = [row(f"kind {number}") for number in range(20)]
    beyond = [row(f"kind {number}", BEYOND) for number in range(20)]
    figures = figures_of(finer, rows=[*MEASURED, *kinds, *beyond, row(group=BEYOND)])
    text = model_card(described(finer.surrogate, figures), "picture.png", "mechanism.png")
    assert len(text.splitlines()) <= SCREEN


def test_card_of_a_record_has_the_remarks_of_its_run(finer: Validation) -> None:
    own, of_record = "the network has few samples", "two sensors drift"
    figures = replace(figures_of(finer, rows=MEASURED), remark=own, sizes_tried=())
    assert own not in model_card(described(finer.surrogate, figures)).lower()
    measured = replace(figures, record_remarks=(of_record,))
    text = model_card(described(finer.surrogate, measured)).lower()
    assert f"- {of_record}.\n- {own}.\n" in text


def test_card_says_once_how_fast_it_is_at_equal_accuracy(finer: Validation) -> None:
    one = described(finer.surrogate, figures_of(finer, rows=MEASURED))
    text = model_card(one, timing=timing(10.0))
    sentence = "A step takes 4 µs. At equal accuracy its model takes 10 times as long: RK45 with"
    assert text.count(sentence) == text.count("At equal accuracy") == 1
    assert "A step takes" not in model_card(one)  # on the card in the FMU


def test_report_has_times_and_errors_at_equal_accuracy(finer: Validation) -> None:
    speed = timing(10.0).speed
    timed = replace(finer, speed=speed).figures().timing
    assert timed is not None
    sections = time_sections(timed)
    (section,) = [one for one in sections if one.title == "Time at equal accuracy"]
    assert section.table is not None
    assert section.table.rows == (
        ("FMU", "2 %", "200 µs"),
        ("model at equal accuracy: RK45 with rtol = 1e-4", "1 %", "2 ms"),
        ("finest model, the truth: RK45 with rtol = 1e-9", "0 %", "200 ms"),
    )


def test_card_without_rows_has_no_picture(finer: Validation) -> None:
    text = model_card(described(finer.surrogate, figures_of(finer)))
    assert "![" not in text


def test_report_shows_the_error_of_the_model(finer: Validation) -> None:
    error = finer.figures().outputs[0].model_relative_rmse
    assert error is not None
    percent = f"{100 * error:.3g} %"
    sections = validation_sections({"in range": finer, "beyond": finer})
    (section,) = [one for one in sections if one.title.startswith("Side by side")]
    assert "finer model" in section.text
    assert section.table is not None
    assert section.table.heading[-1] == "relative RMSE of the data's model"
    assert [row[-1] for row in section.table.rows] == [percent] * 2


def test_report_shows_the_settings_of_every_kind_and_all_variables(finer: Validation) -> None:
    kinds = [
        {"kind": "moving_average_random", "weight": 1.0, "coefficients": [0.1, 0.9]},
        {"kind": "speed_ramps", "weight": 1.0, "speed": 8.0, "acceleration": 20.0},
        {"kind": "speed_ramps", "weight": 1.0, "speed": 1.0, "acceleration": 20.0},
    ]
    recipe = tiny_recipe(data={"excitation": kinds})
    sections = {s.title: s for s in origin_sections(finer.surrogate, recipe)}
    made, variables = sections["How it was made"].table, sections["Variables"].table
    assert made is not None
    assert variables is not None
    average, ramps, other = made.rows
    assert average[:2] == ("moving_average_random", "1")
    assert "coefficients 0.1, 0.9" in average[2]
    assert (ramps[0], other[0]) == ("speed_ramps 2", "speed_ramps 3")
    assert variables.rows[0][:2] == (finer.surrogate.inputs[0].name, "input")


def with_validations(figures: RunFigures, **validations: ValidationFigures) -> RunFigures:
    return replace(figures, validation=validations)


def test_texts_of_a_user_stay_texts_on_the_card(finer: Validation) -> None:
    figures = figures_of(finer, rows=[row("<img src=x> | y")])
    text = model_card(described(finer.surrogate, figures, "a <script>alert(1)</script> | b"))
    assert "a &lt;script&gt;alert(1)&lt;/script&gt; \\| b." in text
    assert "&lt;img src=x&gt; \\| y" in text
    assert "<img" not in text


@pytest.mark.parametrize(("error", "factor", "warned"), [(0.3, 2, 1), (0.1, 2, 0), (0.3, 1, 0)])
def test_card_warns_of_amplitudes_that_the_surrogate_does_not_know(
    finer: Validation, error: float, factor: float, warned: int
) -> None:
    figures = figures_of(finer)
    output = replace(figures.in_range.outputs[0], relative_rmse=error)
    beyond = replace(figures.in_range, outputs=(output,), amplitude=(1.0, float(factor)))
    figures = with_validations(
        figures, **{"in range": figures.in_range, "beyond the range": beyond}
    )
    text = model_card(described(finer.surrogate, figures))
    sentence = "**Do not use the surrogate there:** at 1.0 to 2.0 times the amplitude its"
    assert text.count("Do not use") == warned
    assert text.count(f"{sentence} relative RMSE is up to 30 %.") == warned


def test_card_shows_the_system_if_there_is_a_picture(finer: Validation) -> None:
    plain = model_card(described(finer.surrogate, figures_of(finer)))
    drawn = model_card(described(finer.surrogate, figures_of(finer)), None, "mechanism.png")
    shown = "![tiny: the system in motion](mechanism.png)\n\n"
    assert drawn.count(shown) == 1
    assert drawn.replace(shown, "") == plain
