"""A quick run learns from less, for a shorter time: its FMU has larger errors and wider bounds.

All that it stands for are the keys and values below. They take the place of what a recipe leaves
open, and of larger numbers in it.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any

from slide_fmu.recipe.automatic import AUTO, Tables
from slide_fmu.recipe.model_rules import rules_of_tables

QUICK: Mapping[str, int] = {
    "data.train": 32,
    "data.validation": 12,
    "data.companion": 0,
    "data.bound": 40,
    "data.calibration": 60,
    "data.estimator": 32,
    "data.estimator_validation": 12,
    "network.hidden": 12,
    "training.starts": 2,
    "training.iterations": 20,
    "training.expert.start_iterations": 10,
    "training.expert.kept": 1,
    "training.expert.kept_iterations": 10,
    "bound.expert.steps": 1500,
    "bound.expert.attempts": 1,
    "bound.expert.companion.iterations": 20,
    "validation.trajectories": 12,
    "validation.adversarial": 0,
}
"""The largest numbers of a quick run, by the keys of a recipe. A search for sizes does not take
place, and there is no learning curve."""

NEEDS_TABLE = {
    "bound.": "bound",
    "data.companion": "bound",
    "data.bound": "bound",
    "data.calibration": "bound",
    "data.estimator": "estimator",
}
"""Keys that begin so count only in a recipe with this table."""
SIZES = ("network.hidden",)
"""Keys whose value in a recipe stays, also a larger one: who chose a size knows why."""

REMARK = (
    "a quick run (--quick) has fewer trajectories and a shorter training, so errors are larger "
    "and error bounds are wider than those of a whole run: leave --quick out for the FMU that you "
    "use"
)
"""What is said of an FMU of a quick run, wherever it is described."""


def with_at_most(tables: Mapping[str, Any], most: Mapping[str, int]) -> Tables:
    """Return a recipe's tables with numbers of at most these, by dotted key.

    Raises:
        ValueError: the recipe has measured records, or another network than a state-space network.
    """
    changed: Tables = copy.deepcopy(dict(tables))
    if not most:
        return changed
    _require_quick_kind(changed)
    if changed.get("training", {}).get("start") is not None:  # its sizes are those of an FMU
        most = {key: value for key, value in most.items() if key not in SIZES}
    for key, value in most.items():
        needed = [table for begin, table in NEEDS_TABLE.items() if key.startswith(begin)]
        if all(table in changed for table in needed):
            _limit(changed, key, value)
    return changed


def _limit(tables: Tables, key: str, most: int) -> None:
    *places, name = key.split(".")
    for place in places:
        if isinstance(tables.get(place), str):  # the name of a family in the place of its table
            tables[place] = {"family": tables[place]}
        tables = tables.setdefault(place, {})
    given = tables.get(name, AUTO)
    if given == AUTO:
        tables[name] = most
    elif isinstance(given, int) and key not in SIZES:
        tables[name] = min(given, most)


def _require_quick_kind(tables: Tables) -> None:
    network = tables.get("network", {})
    family = network if isinstance(network, str) else network.get("family", "state_space")
    if family != "state_space" or not rules_of_tables(tables).simulated:
        what = "measured records" if family == "state_space" else f"the network {family!r}"
        raise ValueError(
            f"--quick with {what}; expected a state-space network and a system that is simulated, "
            "of which a quick run learns less: leave --quick out"
        )
