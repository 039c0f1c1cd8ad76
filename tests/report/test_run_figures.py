"""The figures of a run are read from what an FMU carries."""

from __future__ import annotations

from typing import Any

import pytest

from slide_fmu.report.run_figures import RunFigures, released_figures
from tests.figures import run_figures
from tests.report.made_rows import MEASURED

FIGURES = run_figures(
    name="car",
    versions={"numpy": "2.0"},
    validation={
        "in range": {
            "outputs": [{"name": "y", "plain_relative_rmse": 0.25}],
            "parameters": {
                "names": ["mass"],
                "corners": [{"values": {"mass": 2.0}, "relative_rmse": [0.5]}],
            },
        }
    },
    window={"decay_time_s": {"mean": 1.0}},
    rows=MEASURED,
)


def test_figures_are_those_of_their_dump() -> None:
    found = released_figures({"measured": FIGURES.dump()})
    assert found == FIGURES
    assert released_figures({}) is released_figures(None) is None


def test_dump_has_no_keys_of_what_there_is_not() -> None:
    dump = FIGURES.dump()
    assert not {"remark", "sizes_tried", "loops", "stability"} & dump.keys()
    in_range = dump["validation"]["in range"]
    assert in_range["error_estimate"] is None
    assert not {"failed", "held_out", "left_out"} & in_range.keys()
    assert in_range["parameters"]["corners"] == [{"mass": 2.0, "relative_rmse": [0.5]}]
    assert "free_relative_rmse" not in in_range["outputs"][0]


def test_in_range_is_not_chosen_by_the_order_of_names() -> None:
    outputs = [{"name": "y", "rmse": 1.0}]
    beyond = [{"name": "y", "rmse": 9.0}]
    found = run_figures(
        validation={
            "beyond the range": {"amplitude": (0.5, 1.0), "outputs": beyond},
            "in range": {"amplitude": (1.0, 1.0), "outputs": outputs},
        }
    )
    assert found.usual_error == 1.0


def test_remark_stands_beside_the_sizes_of_a_training_that_is_known() -> None:
    known: RunFigures = run_figures(sizes_tried=[])
    assert known.dump()["remark"] is None


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"parameters": None}, ("parameters", "slide-fmu run")),
        ({"validation": {"in range": {}}}, ("validation.in range.fmu", "more")),
        ({"name": 3}, ("name", "string")),
        ({"validation": {}}, ("validation: it is empty", "slide-fmu run")),
    ],
)
def test_figures_of_another_form_are_refused(
    changes: dict[str, Any], words: tuple[str, ...]
) -> None:
    with pytest.raises(ValueError, match="measured figures in the FMU") as caught:
        released_figures({"measured": {**FIGURES.dump(), **changes}})
    assert all(word in str(caught.value) for word in words)
    assert "\n" not in str(caught.value)
