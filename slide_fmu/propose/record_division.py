"""How a first recipe divides records into parts, so that no part has inputs of another one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.recipe.measured import PARTS, SHARES
from slide_fmu.records.alike import alike_inputs, groups_of_records
from slide_fmu.records.period_cuts import whole_periods
from slide_fmu.records.periods import find_period
from slide_fmu.records.record import Record

MANY = 10
"""So many records and more are divided as whole ones."""
FEW = "There are too few of them for an error estimator, which needs two parts of its own."


@dataclass(frozen=True)
class Division:
    """A Division is how a recipe divides records.

    Attributes:
        by: as of ``slide_fmu.records.blocks.Splitting``.
        origin: why, in sentences.
        groups: so many parts can be made; infinite where records are cut anywhere.
    """

    by: Literal["block", "each", "record", "period"]
    origin: str
    groups: float = math.inf


def proposed_division(records: Sequence[Record], names: tuple[str, ...]) -> Division:
    """Propose how records are divided, by what their inputs of these names repeat."""
    inputs: list[FloatArray] = [record.chosen(names) for record in records]
    periods = _different_periods(inputs)
    if periods >= len(SHARES):
        origin = "The inputs repeat periods: no part has one that another part has."
        return Division("period", _with_few(origin, periods), periods)
    alike = alike_inputs(inputs) if len(inputs) > 1 else []
    groups = max(groups_of_records(alike, len(inputs))) + 1
    if alike and groups >= len(SHARES):
        origin = "Records have the same inputs: those that are alike are in one part."
        return Division("record", _with_few(origin, groups), groups)
    lengths = [len(one) for one in inputs]
    if alike and all(one.together(lengths) for one in alike):
        return Division(
            "each",
            "Records have the same inputs and run together: each of them is cut in the order of "
            "time, so that no part has inputs that another part has.",
        )
    if len(records) >= MANY and not alike:
        return Division(
            "record", "There are many records: each of them is in one part as a whole.", groups
        )
    origin = "The records are cut in the order of time: training first, test last."
    if alike or periods:
        origin += " What is tested was learnt from in part: there are too few different inputs."
    return Division("block", origin)


def _with_few(origin: str, groups: int) -> str:
    return origin if groups >= len(PARTS) else f"{origin} {FEW}"


def _different_periods(inputs: Sequence[FloatArray]) -> int:
    """Return how many different periods inputs repeat; 0 if a record repeats none, or another."""
    if not all(np.isfinite(one).all() for one in inputs):
        return 0
    found = [find_period(one) for one in inputs]
    lengths = {None if period is None else period.samples for period in found}
    if len(lengths) > 1 or found[0] is None:
        return 0
    return len({one.number for one in whole_periods(inputs, found[0].samples)})
