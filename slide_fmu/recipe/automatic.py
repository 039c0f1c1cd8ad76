"""This module lists keys that may be ``"auto"``, and guesses them until they are found.

A key that is left out counts as ``"auto"``. The guesses complete the recipe, so that the system
can be made and its motions drawn; nothing is learnt from them.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeGuard

Tables = dict[str, Any]
"""The tables of a recipe as they were read; nothing in them is checked yet."""

Value = int | float | str
"""Type of a value that is found for a key."""

FoundValues = dict[str, dict[str, Value]]
"""Values that were found, by table and key of a recipe, as ``{"window": {"n_in": 96}}``."""

AUTO = "auto"
"""Value of a key in a recipe whose value is to be found."""

LENGTHS = ("window.n_in", "window.n_out", "data.duration", "data.burn_in")
"""Keys that follow from how long the system remembers, in the order in which they are guessed."""

NUMBERS = ("data.train", "data.validation", "data.estimator", "data.estimator_validation")
"""Numbers of trajectories, which follow from the time of a simulation or a learning curve."""

ESTIMATOR_NUMBERS = NUMBERS[2:]
"""Numbers of the error estimator; a recipe without one leaves no such number open."""

BOUND_NUMBERS = ("data.companion", "data.bound", "data.calibration")
"""Numbers of the error bound, which follow from the time of a simulation. A recipe that gives
``data.train`` and leaves them out has their defaults."""

AUTOMATIC = LENGTHS + NUMBERS + BOUND_NUMBERS
"""All keys that may be ``"auto"``; each has its first guess in ``_GUESSES`` below."""

GUESSED_NUMBER = 8
"""The first guess of a number of trajectories."""

LEAST_CALIBRATION = 20
"""The usual confidence of an error bound, 0.95, cannot be calibrated with fewer trajectories
(``slide_fmu.bounds.judge``)."""

GUESSED_N_OUT = 64
"""The first guess of an output window, in samples; an input window is three times as long."""


def automatic_keys(tables: Tables) -> tuple[str, ...]:
    """Return which of the ``AUTOMATIC`` keys are left to be found, given tables as read."""
    open_keys = []
    without_estimator = tables.get("estimator") is None
    for place in AUTOMATIC:
        if without_estimator and place in ESTIMATOR_NUMBERS:
            continue
        if place in BOUND_NUMBERS and tables.get("bound") is None:
            continue
        table, key = place.split(".")
        given = tables.get(table)
        left_out = None if place in BOUND_NUMBERS and "data.train" not in open_keys else AUTO
        if isinstance(given, dict) and given.get(key, left_out) == AUTO:
            open_keys.append(place)
    return tuple(open_keys)


def with_guesses(tables: Tables) -> tuple[Tables, tuple[str, ...]]:
    """Return tables with a first guess for each key that is left to be found, and these keys."""
    keys, guessed = automatic_keys(tables), dict(tables)
    for place in keys:
        table, key = place.split(".")
        guessed[table] = {**guessed[table], key: _GUESSES[place](guessed)}
    return guessed, keys


def nested(values: Mapping[str, Value]) -> FoundValues:
    """Return values by dotted key (``"window.n_in"``) as a table of tables."""
    by_table: FoundValues = {}
    for place, value in values.items():
        table, key = place.split(".")
        by_table.setdefault(table, {})[key] = value
    return by_table


def _guess_n_in(tables: Tables) -> int:
    n_out = tables["window"].get("n_out", AUTO)
    return 3 * (n_out if _is_count(n_out) else GUESSED_N_OUT)


def _guess_n_out(tables: Tables) -> int:
    n_in = tables["window"]["n_in"]  # guessed before, if it was not given
    return max(1, n_in // 3) if _is_count(n_in) else GUESSED_N_OUT


def _guess_time(tables: Tables) -> float:
    """Guess a duration or burn-in as one input window."""
    window = tables.get("window")
    if not isinstance(window, dict):
        return 1.0
    step, n_in = window.get("step"), window.get("n_in")
    if not (isinstance(step, float | int) and step > 0 and _is_count(n_in)):
        return 1.0
    return float(step * n_in)


def _is_count(value: Any) -> TypeGuard[int]:
    return isinstance(value, int) and not isinstance(value, bool) and value > 0


def _guess_number(tables: Tables) -> int:
    return GUESSED_NUMBER


def _guess_of_bound(tables: Tables) -> int:
    return LEAST_CALIBRATION


_GUESSES = {
    "window.n_in": _guess_n_in,
    "window.n_out": _guess_n_out,
    "data.duration": _guess_time,
    "data.burn_in": _guess_time,
    **dict.fromkeys(NUMBERS, _guess_number),
    **dict.fromkeys(BOUND_NUMBERS, _guess_of_bound),
}
