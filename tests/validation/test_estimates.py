"""The figures of error estimates and tolerances in a validation, and how tables show them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from slide_fmu.core.readable import quantity
from slide_fmu.report.trust_sections import estimate_table, tolerance_table
from slide_fmu.surrogate.description import SurrogateDescription
from slide_fmu.validation.comparison import Comparison
from slide_fmu.validation.results import Validation
from tests.validation.handmade import bounded, comparison, trust_outputs, validation

STILL = [0.5, 0.5, 0.5, 0.5]
FIRST = comparison(
    [[1.0, 0.1], [-2.0, 0.1], [3.0, 0.2], [4.0, 0.1]],
    trust=trust_outputs([[2.0, 0.2], [3.0, 0.2], [2.0, 0.3], [5.0, 0.4]], STILL),
)
SECOND = comparison(
    [[-1.0, 0.1], [2.0, 0.9], [3.0, 0.9], [1.0, 0.1]],
    kind=1,
    trust=trust_outputs([[2.0, 0.2], [3.0, 0.3], [4.0, 0.4], [2.0, 0.5]], [0.5, 3.0, 3.0, 0.5]),
)
THIRD = replace(SECOND, trust=trust_outputs([[9.0, 9.0]] * 4, STILL))


def test_estimates_are_compared_without_floor_where_their_span_is_whole() -> None:
    nan = float("nan")
    some = comparison(
        [[0.0, 0.0]] * 3,
        estimate=np.array([[9.0, 9.0], [1.5, 2.0], [2.0, 2.0]]),
        true_error=np.array([[nan, nan], [1.0, 2.0], [2.0, 1.0]]),
    )
    first, second = validation(some).figures().error_estimate.without_floor
    assert first.name == "y0"
    assert first.mean == pytest.approx(0.25)
    assert first.constant_mean == pytest.approx(0.25)
    assert first.rank_correlation == pytest.approx(1)
    assert second.mean == pytest.approx(0.5)
    assert second.rank_correlation is None


def test_output_without_any_error_has_no_deviation_without_floor() -> None:
    some = comparison([[0.0, 0.0]] * 2, true_error=np.array([[0.0, 1.0], [0.0, 2.0]]))
    (only,) = validation(some).figures().error_estimate.without_floor
    assert only.name == "y1"


def test_rows_of_estimates_have_the_constant_next_to_them() -> None:
    figures = validation(FIRST, SECOND).figures()
    table = estimate_table({"in range": figures})
    heading, (first, second, norm) = table.heading, table.rows
    assert len(heading) == len(first)
    assert heading[4:6] == ("the best constant: mean", "the best constant: 95 % within")
    assert [row[:2] for row in (first, second, norm)] == [
        ("in range", name) for name in ("y0", "y1", "norm of the outputs")
    ]
    # estimated 0.5, true 0.25
    assert second[2:] == ("100 %", "100 %", "0 %", "0 %", "0 %", "0.5 times the estimate", "")


def tolerant(*comparisons: Comparison, **more: Any) -> Validation:
    """A validation of a surrogate with a bound: the last sample of each is not trusted."""
    found = bounded(*comparisons, **more)
    trusted = [
        replace(c, trust=replace(c.trust, trusted=np.array([1.0, 1.0, 1.0, 0.0])))
        for c in comparisons
        if c.trust is not None
    ]
    return replace(found, comparisons=tuple(trusted))


def test_tolerances_are_given_by_false_alarms_in_range() -> None:
    found = tolerant(FIRST, SECOND)
    rows = found.figures().tolerances
    assert [row.alarms for row in rows] == [0.005, 0.01, 0.02, 0.04, 0.08]
    assert {row.tolerances for row in rows} == {None}  # a quarter is outside of the domain
    inside = tolerant(FIRST, THIRD)
    described = SurrogateDescription.of(inside.surrogate)
    table = tolerance_table({"in range": inside.figures()}, described)
    start = inside.surrogate.error_tolerances
    factor = max(9.0 / start)  # the largest bounds are 9 and 9
    expected = tuple(quantity(value, "m") for value in factor * start)
    assert table.heading == (
        "false alarms on these trajectories",
        "tolerance of y0",
        "tolerance of y1",
    )
    assert table.rows[0][1:] == tuple(quantity(value, "m") for value in start)
    assert table.rows[1] == ("0.5 %", *expected)
    not_reached = tolerance_table({"in range": found.figures()}, described)
    assert not_reached.rows[1] == ("0.5 %", "not reached", "not reached")
    beyond = tolerant(FIRST, THIRD, amplitude=(1.0, 2.0)).figures()
    assert beyond.tolerances == ()
    assert tolerance_table({"beyond": beyond}, described).rows == ()


def test_all_that_stands_beside_a_sample_is_left_out_with_it() -> None:
    """Estimates would be drawn beside other samples else, or not at all."""
    arrays = {name: SECOND.reference + i for i, name in enumerate(("estimate", "free", "model"))}
    cut = replace(SECOND, first_trusted=2, **arrays).where_trusted()
    assert cut is not None
    for name, values in arrays.items():
        np.testing.assert_array_equal(getattr(cut, name), values[2:])
    assert cut.plain is None


@pytest.mark.parametrize(("first", "left"), [(0, 4), (3, 1), (4, None), (9, None)])
def test_bound_counts_where_a_sample_is_left_from_the_first_on_that_fills_it(
    first: int, left: int | None
) -> None:
    found = replace(SECOND, first_trusted=first).where_trusted()
    if left is None:
        assert found is None
    else:
        assert found is not None
        assert found.trust is not None
        assert (len(found.time), len(found.trust.novelty), found.first_trusted) == (left, left, 0)
        assert SECOND.trust is not None
        np.testing.assert_array_equal(found.trust.bounds, SECOND.trust.bounds[first:])
    assert replace(SECOND, trust=None, first_trusted=first).where_trusted() is None


def test_tolerances_are_those_of_the_motions_that_have_a_bound() -> None:
    """None is given where no motion is long enough for the bound to count."""
    bare = replace(FIRST, trust=None)
    assert tolerant(bare, THIRD).figures().tolerances == tolerant(THIRD).figures().tolerances
    short = replace(THIRD, first_trusted=4)
    assert tolerant(short, FIRST).figures().tolerances == tolerant(FIRST).figures().tolerances
    assert tolerant(bare, short).figures().tolerances == ()


def test_outputs_out_of_range_are_not_trusted_whatever_the_tolerances_are() -> None:
    found = tolerant(FIRST, THIRD)
    ranges = np.array([[-3.0, 20.0], [-9.0, 20.0]])  # the references are 3 and -4 in turns
    strayed = replace(found, surrogate=replace(found.surrogate, output_ranges=ranges))
    assert all(row.tolerances is not None for row in found.figures().tolerances)
    assert {row.tolerances for row in strayed.figures().tolerances} == {None}
    wide = replace(found.surrogate, output_ranges=np.array([[-20.0, 20.0], [-20.0, 20.0]]))
    assert replace(found, surrogate=wide).figures().tolerances == found.figures().tolerances
