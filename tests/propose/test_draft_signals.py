"""Ranges of outputs in a first recipe follow from what was seen."""

from __future__ import annotations

import numpy as np
import pytest

from slide_fmu.propose.draft_signals import draft_inputs, parse_range, ranged_outputs
from slide_fmu.propose.first_look import FirstLook
from slide_fmu.recipe.recipe import RecipeError
from slide_fmu.recipe.writing import DraftSignal
from slide_fmu.systems.declared import DeclaredModel, SignalTable

OUTPUTS = [DraftSignal(name, SignalTable(), "") for name in ("moves", "rests")]


def seen(motions: int, still: list[bool]) -> FirstLook:
    low, high = np.array([-1.0, 2.0]), np.array([1.0, 2.0])
    return FirstLook(0.1, "", low, high, np.array(still), motions, ())


def test_range_says_in_how_many_motions_it_was_seen() -> None:
    for motions, count in ((1, "one motion"), (7, "7 motions")):
        (output, _), _ = ranged_outputs(OUTPUTS, seen(motions, [False, False]), chosen=False)
        assert output.origin == f"Seen in {count}, and widened by 20 % at both ends."
        assert output.table.range == (-1.4, 1.4)


def test_output_that_rests_is_left_out_unless_it_was_chosen() -> None:
    kept, remarks = ranged_outputs(OUTPUTS, seen(3, [False, True]), chosen=False)
    assert [draft.name for draft in kept] == ["moves"]
    assert remarks == ["output 'rests' never moves and is left out; --output rests keeps it"]
    kept, remarks = ranged_outputs(OUTPUTS, seen(3, [False, True]), chosen=True)
    assert ([draft.name for draft in kept], remarks) == (["moves", "rests"], [])
    kept, _ = ranged_outputs(OUTPUTS, seen(3, [True, True]), chosen=False)
    assert len(kept) == 2


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
