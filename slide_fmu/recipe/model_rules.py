"""This module holds the rules and defaults for recipes of simulated models."""

from __future__ import annotations

import math
from importlib import import_module
from typing import Any, Final, cast, final

from slide_fmu.core.signals import Signal, moves
from slide_fmu.excitation.base import Kind
from slide_fmu.excitation.kinds import names_of, reported_names_of
from slide_fmu.recipe.automatic import Tables
from slide_fmu.recipe.default_excitation import InputKind, default_excitation
from slide_fmu.recipe.kind_rules import KindRules, Motion, Words
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.systems.loading import UNSIMULATED


@final
class ModelRules(KindRules):
    """ModelRules are the rules for recipes with a simulated system."""

    words = Words(
        trained_on="excitations",
        stands_for="its reference model",
        truth="reference",
        reference="",
        inputs_seen="The surrogate was trained on these inputs (amplitude as a fraction of the "
        "range):",
        parameters="Every trajectory has values of the physical parameters that no training saw; "
        "one more is at each corner of their ranges, which the figures above do not count.",
    )

    def with_first_defaults(self, tables: Tables) -> Tables:
        """Fill in a missing excitation, which follows from the step and the inputs."""
        data, window = tables.get("data", {}), tables.get("window", {})
        step = window.get("step") if isinstance(window, dict) else None
        if not isinstance(data, dict) or "excitation" in data:
            return tables
        if not (isinstance(step, int | float) and math.isfinite(step) and step > 0):
            return tables  # the check of the step reports its mistake
        inputs = _declared_inputs(tables.get("system"))
        turning = any(table.get("angle") is not None for table in inputs)
        kind = _inputs_of(tables.get("system"), inputs)
        jumps = data.get("jumps") is True
        mix = default_excitation(float(step), kind, turning=turning, jumps=jumps)
        return {**tables, "data": {**data, "excitation": mix}}

    def require_fitting_tables(self, recipe: Recipe) -> None:
        system, data = recipe.system, recipe.data
        columns = [
            s.column for s in (*system.inputs.values(), *system.outputs.values()) if s.column
        ]
        given: dict[str, object] = {
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
                    f"system.kind = {' or '.join(map(repr, UNSIMULATED))} only: remove it"
                )
        if not data.excitation:
            raise ValueError(
                "data.excitation is empty; expected at least one kind of excitation, or none of "
                "the tables: then a mix follows from the step"
            )

    def require_parameters(self, recipe: Recipe) -> None:
        for name, table in recipe.parameters.items():
            if table.values:
                raise ValueError(
                    f"parameters.{name}.values = {list(table.values)} with system.kind = "
                    f"{recipe.system.kind!r}; expected a range: values are those of measured "
                    "records"
                )

    def motions(self, recipe: Recipe) -> list[Motion]:
        kinds = recipe.mix()
        own = (kind.kind for kind in kinds)
        named = zip(names_of(kinds), own, reported_names_of(kinds), strict=True)
        return [Motion(*each) for each in named]

    def described(
        self, recipe: Recipe, signals: tuple[Signal, ...], step: float, held_out: bool
    ) -> dict[str, str]:
        kinds = recipe.validation.excitation if held_out else recipe.mix()
        at_once = ""
        if moves(signals):
            at_once = (
                "; it jumps at any time"
                if recipe.data.jumps
                else f"; it goes straight to the next value within {step:g} s"
            )
        return {
            name: kind.described(signals, step)
            + (at_once if isinstance(kind, Kind) and kind.jumps else "")
            for name, kind in zip(names_of(kinds), kinds, strict=True)
        }

    def compared(self, recipe: Recipe, count: int, seed: int) -> str:
        return (
            f"{count} trajectories that no training saw (seed {seed}): the FMU, run by an "
            "importer, next to the reference system, simulated on the same inputs."
        )


SIMULATED: Final = ModelRules()


def rules_of(recipe: Recipe) -> KindRules:
    """Return the rules of the kind of a recipe's system."""
    return _rules(recipe.system.kind)


def rules_of_tables(tables: Tables) -> KindRules:
    """Return the rules of the kind in tables of a recipe that are not checked yet."""
    system = tables.get("system")
    return _rules(system.get("kind") if isinstance(system, dict) else None)


def _rules(kind: Any) -> KindRules:
    room = UNSIMULATED.get(kind) if isinstance(kind, str) else None
    return SIMULATED if room is None else cast(KindRules, import_module(f"{room}.rules").RULES)


def _declared_inputs(system: Any) -> list[Tables]:
    """Return the tables of inputs in the table ``system``, which is not checked yet."""
    inputs = system.get("inputs") if isinstance(system, dict) else None
    tables = inputs.values() if isinstance(inputs, dict) else ()
    return [table for table in tables if isinstance(table, dict)]


def _inputs_of(system: Any, known: list[Tables]) -> InputKind:
    """Return the kind of the inputs from the table ``system`` and the tables of its inputs."""
    if isinstance(system, dict) and system.get("chain") is not None:
        return "set_points"
    if [table.get("angle") for table in known] == ["cosine", "sine"]:
        return "angle"
    return "moving" if any(t.get("hold") == "first_order" for t in known) else "held"
