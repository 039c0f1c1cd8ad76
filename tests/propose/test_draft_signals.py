"""Ranges of outputs in a first recipe follow from what was seen."""

from __future__ import annotations

import math

import numpy as np
import pytest

from slide_fmu.propose.draft_signals import (
    draft_inputs,
    on_inputs,
    parse_range,
    ranged_outputs,
)
from slide_fmu.propose.first_look import FirstLook
from slide_fmu.recipe.recipe import RecipeError
from slide_fmu.recipe.writing import DraftSignal
from slide_fmu.systems.declared import DeclaredModel, SignalTable

OUTPUTS = [DraftSignal(name, SignalTable(), "") for name in ("moves", "rests")]


def seen(
    motions: int, still: list[bool], at_rest: tuple[bool, bool] = (False, False)
) -> FirstLook:
    low, high = np.array([-1.0, 2.0]), np.array([1.0, 2.0])
    rests = [np.array([end, False]) for end in at_rest]
    return FirstLook(0.1, "", low, high, np.array(still), motions, (), *rests)


def ranged(
    found: FirstLook, chosen: bool, **limits: tuple[float, float]
) -> tuple[list[DraftSignal], list[str]]:
    return ranged_outputs(OUTPUTS, found, chosen, limits)


def test_range_says_in_how_many_motions_it_was_seen() -> None:
    for motions, count in ((1, "one motion"), (7, "7 motions")):
        (output, _), _ = ranged(seen(motions, [False, False]), chosen=False)
        assert output.origin == f"Seen in {count}, and widened by 20 % at both ends."
        assert output.table.range == (-1.4, 1.4)


def test_output_that_rests_is_left_out_unless_it_was_chosen() -> None:
    kept, remarks = ranged(seen(3, [False, True]), chosen=False)
    assert [draft.name for draft in kept] == ["moves"]
    assert remarks == ["output 'rests' never moves and is left out; --output rests keeps it"]
    kept, remarks = ranged(seen(3, [False, True]), chosen=True)
    assert ([draft.name for draft in kept], remarks) == (["moves", "rests"], [])
    kept, _ = ranged(seen(3, [True, True]), chosen=False)
    assert len(kept) == 2


def test_end_that_the_model_declares_or_that_no_motion_passes_is_no_wider() -> None:
    """A temperature of a chip with a coolant is not below that of the coolant."""
    (output, _), remarks = ranged(seen(7, [False, False]), False, moves=(-1.1, math.inf))
    assert output.table.range == (-1.1, 1.4)
    assert output.origin == (
        "Seen in 7 motions, and widened by 20 % at the upper end. "
        "The model declares the lower end."
    )
    (output, _), _ = ranged(seen(7, [False, False], (True, False)), False)
    assert output.table.range == (-1.0, 1.4)
    assert "widened by 20 % at the upper end. The lower end is that at rest" in output.origin
    (output, _), _ = ranged(seen(7, [False, False], (True, True)), False)
    assert output.table.range == (-1.0, 1.0)
    assert remarks == []


def test_output_beyond_what_the_model_declares_is_reported() -> None:
    (output, _), remarks = ranged(seen(7, [False, False]), False, moves=(-0.5, math.inf))
    assert output.table.range == (-1.4, 1.4)
    (remark,) = remarks
    assert "'moves' goes from -1 to 1, beyond the range -0.5..inf that the model" in remark
    declared = DraftSignal("moves", SignalTable(range=(-0.5, 3.0)), "")
    (output,), (remark,) = ranged_outputs([declared], seen(7, [False, False]), False, {})
    assert output.table.range == (-0.5, 3.0)
    assert "beyond the range -0.5..3 that the model declares" in remark


def test_input_of_an_fmu_that_is_not_named_is_reported_with_its_value() -> None:
    inputs = {
        "heat": SignalTable(unit="W", range=(0.0, 9.0)),
        "coolant": SignalTable(unit="K", start=293.15),
        "fan": SignalTable(),
    }
    found = DeclaredModel("fmu", "chip.fmu", (), inputs, inputs_may_be_left_out=True)
    coolant, fan = on_inputs(found, {"heat": (0.0, 5.0)})
    assert "input 'coolant' is not named, so the model keeps its start value 293.15 K;" in coolant
    assert "--input coolant=LOW..HIGH" in coolant
    assert "input 'fan' is not named, so the model keeps its start value;" in fan
    assert on_inputs(found, {}) == []  # then all of them are inputs
    (beyond, *_) = on_inputs(found, {"heat": (-1.0, 5.0), "coolant": None, "fan": None})
    assert "'heat': the range -1..5 leaves that of the model, 0..9" in beyond


def test_start_value_outside_of_the_given_range_goes_to_its_end() -> None:
    """FMUs mostly start their inputs at 0, which a pressure or a temperature never is."""
    found = DeclaredModel("fmu", "boiler.fmu", (), {"heat": SignalTable(start=0.0)})
    [inside] = draft_inputs(found, {"heat": (-1.0, 1.0)})
    assert (inside.table.start, inside.origin.count("start value")) == (0.0, 0)
    for limits, start in (((280.0, 350.0), 280.0), ((-3.0, -2.0), -2.0)):
        [outside] = draft_inputs(found, {"heat": limits})
        assert outside.table.start == start
        assert "The model's start value, 0, lies outside" in outside.origin


@pytest.mark.parametrize("limits", ["0..1e308", "-1e308..1e308", "0..inf", "-inf..0", "-1e301..0"])
def test_given_range_that_is_not_finite_or_too_wide_is_refused(limits: str) -> None:
    with pytest.raises(RecipeError, match=rf"--input force={limits}; expected a range that is fi"):
        parse_range([f"force={limits}"])
    assert parse_range(["force=-1e300..1e300"]) == {"force": (-1e300, 1e300)}
