"""What a recipe says about measured records, and what only recipes of models say."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Literal, get_args

if TYPE_CHECKING:
    from slide_fmu.recipe.recipe import Recipe

KIND = "record"
"""The kind of system whose trajectories are measured."""

Part = Literal["train", "validation", "estimator", "estimator_validation", "test"]
"""What a part of records is used for."""

PARTS: tuple[Part, ...] = get_args(Part)
"""The parts of records in the order of time; the last one is what the FMU is measured on."""

SHARES: dict[Part, float] = {"train": 0.7, "validation": 0.15, "test": 0.15}
"""Parts of all samples where a recipe says nothing and has no error estimator."""

SHARES_WITH_ESTIMATOR: dict[Part, float] = {
    "train": 0.55,
    "validation": 0.12,
    "estimator": 0.15,
    "estimator_validation": 0.06,
    "test": 0.12,
}
"""Those where it has one, which learns from samples that the surrogate has not learnt from."""


def is_measured(tables: Mapping[str, Any]) -> bool:
    """Tell whether the tables of a recipe, which are not checked yet, are about records."""
    system = tables.get("system")
    return isinstance(system, Mapping) and system.get("kind") == KIND


def shares_of(recipe: Recipe) -> dict[Part, float]:
    """Return what part of all samples each of ``PARTS`` has, in their order."""
    default = SHARES if recipe.estimator is None else SHARES_WITH_ESTIMATOR
    given = recipe.data.shares or default
    return {part: given.get(part, 0.0) for part in PARTS}


def require_fitting_tables(recipe: Recipe) -> None:
    """Refuse what is said of models in a recipe of records, and the other way round.

    Raises:
        ValueError: the message names the key, its value, and the remedy.
    """
    if recipe.system.is_record:
        _require_no_model(recipe)
        _require_shares(recipe)
        _require_weights(recipe)
        return
    system, data = recipe.system, recipe.data
    columns = [s.column for s in (*system.inputs.values(), *system.outputs.values()) if s.column]
    given: dict[str, Any] = {
        "system.further": list(system.further),
        "system.noise_record": system.noise_record,
        "data.shares": dict(data.shares),
        "data.by": "" if data.by == "block" else data.by,
        "column": columns,
    }
    for key, value in given.items():
        if value:
            raise ValueError(
                f"{key} = {value!r} with system.kind = {system.kind!r}; expected it with "
                f"system.kind = {KIND!r} only: remove it"
            )
    if not data.excitation:
        raise ValueError(
            "data.excitation is empty; expected at least one kind of excitation, or none of the "
            "tables: then a mix follows from the step"
        )


def require_no_numbers(tables: Mapping[str, Any]) -> None:
    """Refuse numbers of trajectories where the samples of records decide about them.

    Raises:
        ValueError: the tables, as they were read, have one.
    """
    data = tables.get("data")
    given = [key for key in PARTS[:-1] if isinstance(data, Mapping) and key in data]
    if given:
        raise ValueError(
            f"data.{given[0]} = {data[given[0]]!r} with system.kind = {KIND!r}; expected none: "  # type: ignore[index]
            "the samples of the records decide; give data.shares, or remove it"
        )


def _require_no_model(recipe: Recipe) -> None:
    system, data = recipe.system, recipe.data
    given: dict[str, Any] = {
        "system.reference": dict(system.reference),
        "system.picture": system.picture,
        "data.excitation": [kind.kind for kind in data.excitation],
        "data.beyond": data.beyond,
        "validation.duration": recipe.validation.duration,
        "validation.excitation": [kind.kind for kind in recipe.validation.excitation],
    }
    for key, value in given.items():
        if value:
            raise ValueError(
                f"{key} = {value!r} with system.kind = {KIND!r}; expected none, since records "
                "cannot be simulated: remove it"
            )


def _require_weights(recipe: Recipe) -> None:
    """Refuse a noise record where no network is learnt by its spectrum."""
    family = recipe.network.family
    if recipe.system.noise_record is not None and family != "state_space":
        raise ValueError(
            f"system.noise_record = {recipe.system.noise_record!r} with network.family = "
            f"{family!r}; expected network.family = 'state_space', whose residuals alone are "
            "weighted by the spectrum of noise: choose it, or remove the key"
        )


def _require_shares(recipe: Recipe) -> None:
    shares = shares_of(recipe)
    wanted = [part for part in PARTS if recipe.estimator is not None or "estimator" not in part]
    lacking = [part for part in wanted if not shares[part]]
    idle = [part for part in PARTS if part not in wanted and shares[part]]
    total = sum(shares.values())
    if lacking or idle or abs(total - 1.0) > 1e-6:
        raise ValueError(
            f"data.shares = {dict(recipe.data.shares)}, {total:g} in all; expected positive "
            f"shares of {wanted}, 1 in all, and of nothing else: correct them, or remove the key"
        )
