"""What a row says of an FMU at the limits of each of its judgements, and the order of rows."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from slide_fmu.core.measures import FEWEST
from slide_fmu.validation.row import (
    ALL,
    AS_SET,
    CONSTANT,
    FAR_OFF,
    FLAGGED,
    LEAST_COVERED,
    MOST_HARMFUL,
    MOST_SILENT,
    SEARCH,
    SMOOTH,
    TONES,
    YOURS,
    kinds_of,
    row_at,
)
from slide_fmu.validation.task import BEYOND, HELD_OUT, IN_RANGE
from tests.report.made_rows import row, unfilled, without_bound

ABOVE = 1.001
"""Factor that takes a figure past a limit."""


def test_limits_are_those_that_the_documentation_promises() -> None:
    """A limit that moves changes verdicts of FMUs that have not changed."""
    limits = FAR_OFF, MOST_HARMFUL, MOST_SILENT, LEAST_COVERED, FLAGGED
    assert limits == (0.05, 0.02, 0.01, 0.88, 0.05)
    assert FEWEST == 12


@pytest.mark.parametrize(
    ("error", "far_off"),
    [(0.0, False), (FAR_OFF, False), (ABOVE * FAR_OFF, True), (math.inf, True), (math.nan, True)],
)
def test_outputs_are_far_off_above_the_limit_and_where_nothing_is_known(
    error: float, far_off: bool
) -> None:
    assert row(error=error).far_off is far_off


@pytest.mark.parametrize(
    ("shares", "valid", "honest"),
    [
        ({}, True, True),
        ({"harmful": MOST_HARMFUL}, True, True),
        ({"harmful": ABOVE * MOST_HARMFUL}, False, True),
        ({"silent": MOST_SILENT}, True, True),
        ({"silent": ABOVE * MOST_SILENT}, False, False),
        ({"covered": LEAST_COVERED}, True, True),
        ({"covered": LEAST_COVERED / ABOVE}, False, False),
        # inputs that are flagged throughout promise no coverage
        ({"covered": 0.1, "trusted": FLAGGED}, True, True),
        ({"covered": 0.1, "trusted": ABOVE * FLAGGED}, False, False),
    ],
)
def test_inputs_are_valid_up_to_each_limit(
    shares: dict[str, Any], valid: bool, honest: bool
) -> None:
    found = row(**shares)
    assert (found.valid, found.honest) == (valid, honest)


def test_fmu_without_a_bound_is_judged_by_harm_alone_and_one_that_never_fills_not_at_all() -> None:
    alone = without_bound()
    assert (alone.valid, alone.honest, alone.uncovered) == (True, None, False)
    assert without_bound(harmful=ABOVE * MOST_HARMFUL).valid is False
    nothing = unfilled()
    assert (nothing.valid, nothing.honest, nothing.uncovered) == (None, None, False)


@pytest.mark.parametrize("group", [IN_RANGE, SMOOTH, CONSTANT, TONES, AS_SET, HELD_OUT, BEYOND])
def test_too_few_motions_are_not_judged(group: str) -> None:
    assert row(group=group, trajectories=FEWEST).valid is True
    assert row(group=group, trajectories=FEWEST - 1).valid is None


@pytest.mark.parametrize("group", [SEARCH, YOURS])
def test_one_motion_is_enough_of_a_search_and_of_your_inputs(group: str) -> None:
    found = row(group=group, trajectories=1)
    assert found.few is False
    assert found.valid is True


def test_row_is_as_bad_as_the_worst_of_its_outputs() -> None:
    one = row(error=0.01)
    (good,) = one.outputs
    bad = replace(good, relative_rmse=0.07, covered=0.7, width=9.0)
    unknown = replace(good, covered=None, width=None)
    both = replace(one, outputs=(good, bad, unknown))
    assert (both.error, both.covered, both.width) == (0.07, 0.7, 9.0)
    assert (both.far_off, both.valid) == (True, False)
    neither = replace(one, outputs=(unknown,))
    assert (neither.covered, neither.width) == (None, None)


def test_row_is_found_by_group_inputs_call_and_step_but_for_rounding() -> None:
    rows = (
        row(),
        row(call="known"),
        row("steps"),
        row(group=SMOOTH),
        row(steps=4.0 * (1 + 1e-9)),
    )
    for index, key in enumerate(
        [
            (IN_RANGE, ALL, "plain", 1.0),
            (IN_RANGE, ALL, "known", 1.0),
            (IN_RANGE, "steps", "plain", 1.0),
            (SMOOTH, ALL, "plain", 1.0),
            (IN_RANGE, ALL, "plain", 4.0),
        ]
    ):
        assert row_at(rows, *key) is rows[index]
    assert row_at(rows, IN_RANGE, ALL, "plain", 2.0) is None
    assert row_at(rows, SMOOTH, "steps", "plain", 1.0) is None
    # steps are compared by their ratio, whether they are long or short
    assert row(steps=0.001).is_at("plain", 0.001 * (1 + 1e-5)) is False
    assert row(steps=1000.0).is_at("plain", 1000.0 * (1 + 1e-7)) is True


def test_groups_are_shown_in_one_order_and_all_kinds_before_each() -> None:
    """Your inputs come first. Groups of another version come last, as they stand."""
    groups = (YOURS, IN_RANGE, SMOOTH, CONSTANT, TONES, AS_SET, HELD_OUT, BEYOND, SEARCH)
    given = [row(group="of another version")]
    for group in reversed(groups):
        given += [row("b", group), row("a", group), row(group=group), row("a", group, steps=4.0)]
    order = [(group, inputs) for group in groups for inputs in (ALL, "b", "a")]
    assert kinds_of(given) == [*order, ("of another version", ALL)]
