"""The reference systems that a recipe names are made here, at the recipe's sample step.

What the recipe's networks see of their inputs is found here too, without data.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TypeVar

from slide_fmu.core.scaling import range_scaling
from slide_fmu.core.signals import moves
from slide_fmu.excitation.mix import Excitation
from slide_fmu.features.sets import feature_set
from slide_fmu.recipe.learning import NetworkTable, StateSpaceRecipe
from slide_fmu.recipe.offers import offered_features
from slide_fmu.recipe.places import ordinal
from slide_fmu.recipe.recipe import Recipe, RecipeError
from slide_fmu.systems.base import Finer, Source, System, chain_of
from slide_fmu.systems.declared import SignalTable
from slide_fmu.systems.errors import LoadError
from slide_fmu.systems.loading import load_source, load_system
from slide_fmu.systems.specification import Specification

Driven = TypeVar("Driven", bound=Source)

GEOMETRY = ("prismatic", "theta", "steps", "alpha", "tool")
"""Parts of a serial chain that are no masses."""


def recipe_system(recipe: Recipe) -> System:
    """Return the system that makes the data of a recipe.

    Raises:
        LoadError: model, class or parameters are not there, or there are only records.
        RecipeError: an excitation of the recipe cannot drive the system's inputs, or the recipe
            gives the step as a parameter.
    """
    made = data_specification(recipe)
    return _drivable(_with_finer(load_system(made), made, recipe), recipe)


def recipe_source(recipe: Recipe) -> Source:
    """Return what the data of a recipe come from: a system that makes them, or its records.

    Raises:
        LoadError, RecipeError: as of ``recipe_system``; or the records cannot be used.
    """
    made = data_specification(recipe)
    return _drivable(_with_finer(load_source(made), made, recipe), recipe)


def source_at(recipe: Recipe, ends: Mapping[str, float]) -> Source:
    """Return the source of a recipe with its physical parameters at the ends of their ranges.

    Raises:
        LoadError: as of ``recipe_source``; the message names the values, where there are some.
        RecipeError: as of ``recipe_source``.
    """
    try:
        return recipe_source(recipe.at(ends))
    except LoadError as error:
        if not ends:
            raise
        values = ", ".join(f"{name} = {value:g}" for name, value in ends.items())
        keys = " or ".join(f"parameters.{name}.range" for name in ends)
        raise LoadError(
            f"with {values}, at the ends of the ranges of the parameters: {error}; expected a "
            f"model that can be made there: narrow {keys}, or correct the model"
        ) from error


def reference_system(recipe: Recipe) -> System:
    """Return the system that the FMU of a recipe is measured against.

    Raises:
        LoadError: model, class or parameters are not there, or there are only records.
        RecipeError: as of ``recipe_system``; or signals or geometry are not those of the system
            that makes the data.
    """
    made = reference_specification(recipe)
    system = _drivable(_with_finer(load_system(made), made, recipe), recipe)
    if recipe.system.reference:
        _require_same_signals(recipe, recipe_system(recipe), system)
    return system


def _with_finer(source: Driven, made: Specification, recipe: Recipe) -> Driven:
    """Give a system what is the same between its samples, if a recipe's inputs bend there."""
    parts = recipe.data.substeps
    if parts > 1 and isinstance(source, System) and moves(source.inputs):
        source.finer = Finer(parts, lambda: _with_parts(made, recipe.window.step, parts))
    return source


def _with_parts(made: Specification, step: float, parts: int) -> System:
    """Make a system whose step is a part of a sample step in s.

    Raises:
        LoadError: its class has a step of its own.
    """
    system = load_system(replace(made, step=step / parts, part_of=parts))
    if not math.isclose(system.step, step / parts, rel_tol=1e-9):
        raise LoadError(
            f"system {made.model!r}: sample step {system.step:g} s; expected {step / parts:g} s, "
            f"which is 1/{parts} of window.step: let the class take the step that it is given, or "
            "set data.substeps = 1"
        )
    return system


FINER = 8
"""So much finer than the FMU's is the step at which a model counts as running by itself."""


def finer_steps(recipe: Recipe) -> int:
    """Return how many of the reference's own steps, or of fine steps, fit into a sample step.

    They are those of ``reference_at_finer_step``: an FMU that names a step goes on by that, and
    every other model by ``FINER`` steps.

    Raises:
        LoadError: model, class or parameters are not there, or there are only records.
    """
    own = load_system(reference_specification(recipe)).own_step
    return FINER if own is None else max(1, round(recipe.window.step / own))


def reference_at_finer_step(recipe: Recipe, times: int, as_it_runs: bool = False) -> System:
    """Return the reference system of a recipe with a sample step that is finer.

    Its inputs have the hold that they have in the recipe, over the shorter step.

    Args:
        recipe: whose reference system it is.
        times: number of its steps in a sample step of the recipe, at least 1.
        as_it_runs: whether inputs of a system that names its own step are held over it, as by an
            importer that runs it by itself.

    Raises:
        LoadError: as of ``finer_steps``, or its class has a step of its own.
    """
    made, step = reference_specification(recipe), recipe.window.step / times
    system = load_system(replace(made, step=step))
    if as_it_runs and system.own_step is not None:
        held = SignalTable(hold="zero_order")
        tables = {s.name: made.inputs.get(s.name, SignalTable()) for s in system.inputs}
        inputs = {name: held.over(table) for name, table in tables.items()}
        system = load_system(replace(made, step=step, inputs=inputs))
    if not math.isclose(system.step, step, rel_tol=1e-9):
        raise LoadError(
            f"system {made.model!r}: sample step {system.step:g} s; expected {step:g} s, which "
            f"is 1/{times} of window.step: let the class take the step that it is given"
        )
    return system


def _drivable(system: Driven, recipe: Recipe) -> Driven:
    """Return the system, if all excitations of the training can drive it."""
    _require_driving(recipe, "data", recipe.data.excitation, system)
    return system


def require_all_kinds(recipe: Recipe, system: Source) -> None:
    """Refuse excitations that cannot drive the system, of the bound and held out ones too.

    Raises:
        RecipeError: one of them cannot.
    """
    _require_driving(recipe, "bound", recipe.further_kinds(), system)
    _require_driving(recipe, "validation", recipe.validation.excitation, system)


def _require_driving(
    recipe: Recipe, table: str, kinds: Sequence[Excitation], system: Source
) -> None:
    for index, kind in enumerate(kinds):
        try:
            kind.check(system.inputs)
        except ValueError as error:
            place = f"recipe {recipe.name!r}: {ordinal(index + 1)} [[{table}.excitation]]"
            raise RecipeError(f"{place}: {error}") from error


def _require_same_signals(recipe: Recipe, made: System, reference: System) -> None:
    """Refuse a reference with other signals, or with outputs that mean something else."""
    wanted = _interface(made)
    for what, found in _interface(reference).items():
        if found != wanted[what]:
            raise RecipeError(
                f"recipe {recipe.name!r}: system.reference = {recipe.system.reference} changes "
                f"the {what} to {found}; expected, as with system.parameters, {wanted[what]}: "
                "leave out what changes that, or give it in system.parameters too"
            )


def _interface(system: System) -> dict[str, object]:
    """Return what the surrogate of a system relies on, by its name in messages."""
    chain = chain_of(system)
    return {
        "inputs": [(s.name, s.unit, s.low, s.high) for s in system.inputs],
        "outputs": [(s.name, s.unit, s.low, s.high) for s in system.outputs],
        "hold and angle of the inputs": [(s.hold, s.angle) for s in system.inputs],
        # the outputs may be about lengths, twists and tool point
        "geometry of the serial chain": None
        if chain is None
        else {name: getattr(chain, name).tolist() for name in GEOMETRY},
    }


def data_specification(recipe: Recipe) -> Specification:
    """Return what the system that makes the data is made from.

    Parameters that users of the FMU may set have their start values.

    Raises:
        RecipeError: the recipe gives the step as a parameter.
    """
    system = recipe.system
    for table in ("parameters", "reference"):
        values = getattr(system, table)
        if "step" in values:
            raise RecipeError(
                f"recipe {recipe.name!r}: system.{table}.step = {values['step']}; expected no "
                f"step there: samples are window.step = {recipe.window.step} s apart; remove it"
            )
    step, kind = recipe.window.step, system.kind
    parameters = () if system.is_record else recipe.physical()  # nobody sets those of records
    starts = {parameter.name: parameter.start_value for parameter in parameters}
    return Specification(
        system.model,
        {**starts, **system.parameters},
        step,
        kind,
        system.inputs,
        system.outputs,
        system.further,
        system.noise_record,
    )


def reference_specification(recipe: Recipe) -> Specification:
    """Return what the system is made from that an FMU is measured against.

    Raises:
        RecipeError: the recipe gives the step as a parameter.
    """
    made = data_specification(recipe)
    return replace(made, parameters={**made.parameters, **recipe.system.reference})


def require_features(recipe: Recipe, system: Source) -> None:
    """Refuse networks that see what the system has not, or turn more states than they have.

    Raises:
        RecipeError: the message has the table, and what is wrong in it.
    """
    tables: dict[str, NetworkTable] = {"network": recipe.network}
    if recipe.estimator is not None:
        tables["estimator.network"] = recipe.estimator.network
    offered = offered_features(recipe, system, range_scaling(system.inputs))
    for place, table in tables.items():
        try:
            features = feature_set(table.feature_names(), offered)
            if isinstance(table, StateSpaceRecipe) and table.turned_pairs:
                drives = len(features.indices(table.roles()["drive"]))
                require_turned_pairs(table.turned_pairs, table.order, drives, len(system.outputs))
        except ValueError as error:
            raise RecipeError(f"recipe {recipe.name!r}: {place}: {error}") from error


def require_turned_pairs(pairs: int, order: int | str, n_drive: int, n_outputs: int) -> None:
    """Refuse to turn more pairs of states than there are, or what is no vector.

    The order may be "auto"; ``n_drive`` is the number of signals of the state input.

    Raises:
        ValueError: the message has the remedy.
    """
    if isinstance(order, int) and 2 * pairs > order:
        raise ValueError(
            f"network.turned_pairs = {pairs} with an order of {order}; expected two states "
            "for each pair: set network.order, or turn fewer pairs"
        )
    if n_drive % 3 or n_outputs % 3:
        raise ValueError(
            f"network.turned_pairs = {pairs} with {n_drive} drives and {n_outputs} outputs; "
            "expected vectors (x, y, z) of both: set turned_pairs = 0, or choose another drive"
        )
