"""This module compares a recipe with its systems, without data.

It also finds the features that the recipe's networks see.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from slide_fmu.core.scaling import range_scaling
from slide_fmu.core.signals import moves
from slide_fmu.excitation.clipping import clipped
from slide_fmu.excitation.kinds import Excitation
from slide_fmu.features.sets import feature_set
from slide_fmu.recipe.learning import NetworkTable, StateSpaceRecipe
from slide_fmu.recipe.loop_partner import own_partner
from slide_fmu.recipe.offers import offered_features
from slide_fmu.recipe.places import ordinal
from slide_fmu.recipe.recipe import Recipe, RecipeError
from slide_fmu.systems.base import Bending, Source, Stepping, System, chain_of
from slide_fmu.systems.errors import LoadError
from slide_fmu.systems.user_code import imported_function

GEOMETRY = ("prismatic", "theta", "steps", "alpha", "tool")
"""Parts of a serial chain that are no masses."""


def require_all_kinds(recipe: Recipe, system: Source) -> None:
    """Refuse excitations of all tables that cannot drive the system.

    Raises:
        RecipeError: a kind cannot drive the inputs.
    """
    for table, kinds in recipe.tables_of_kinds().items():
        require_driving(recipe, table, kinds, system)


def require_driving(
    recipe: Recipe, table: str, kinds: Sequence[Excitation], system: Source
) -> None:
    """Refuse kinds of excitation of a table that cannot drive the system.

    Raises:
        RecipeError: a kind cannot drive the inputs.
    """
    for index, kind in enumerate(kinds):
        try:
            kind.check(system.inputs)
        except ValueError as error:
            place = f"recipe {recipe.name!r}: {ordinal(index + 1)} [[{table}.excitation]]"
            raise RecipeError(f"{place}: {error}") from error


def require_jumps(recipe: Recipe, system: Source) -> None:
    """Refuse inputs that jump between samples for a system that cannot take them there.

    Raises:
        RecipeError: the message has the reason.
    """
    if not (recipe.data.jumps and isinstance(system, System) and moves(system.inputs)):
        return
    place = f"recipe {recipe.name!r}: data.jumps = true"
    if system.follows_rates:
        raise RecipeError(
            f"{place}, but the model follows the rates of its inputs, which a jump has not; "
            "expected false: remove it"
        )
    turning = [signal.name for signal in system.inputs if signal.angle is not None]
    if turning:
        raise RecipeError(
            f"{place} with inputs {turning}, which are cosine and sine of an angle; expected "
            "false, since an angle does not jump: remove it"
        )
    if not isinstance(system, Bending) and recipe.data.substeps == 1:
        raise RecipeError(
            f"{place} with data.substeps = 1; expected 2 or more, since this model takes a jump "
            "at the beginning of a part of a step: set data.substeps = 4"
        )


def require_loops(recipe: Recipe, system: Source) -> None:
    """Refuse loops whose signals or partners are missing, and loops around whole motions.

    Raises:
        RecipeError: the message has the loop and its fault.
    """
    for index, loop in enumerate(recipe.loop):
        place = f"recipe {recipe.name!r}: {ordinal(index + 1)} [[loop]]"
        if recipe.window.planned:
            raise RecipeError(
                f"{place} with window.planned = true; expected false, since the input "
                f"{loop.input!r} follows from an output and is not known ahead: remove one of them"
            )
        try:
            loop.interface(system.inputs, system.outputs)
        except ValueError as error:
            raise RecipeError(f"{place}: {error}") from error
        if not isinstance(system, Stepping):
            raise RecipeError(
                f"{place}: {recipe.system.model!r} simulates whole motions only; expected a "
                "system that goes on step by step: give f and g in place of simulate(t, u, p), or "
                "begin, output and advance in a class; or remove [[loop]]"
            )
        if loop.partner is not None:
            lowest = [(name, pair[0]) for name, pair in (loop.ranges or {}).items()]
            try:
                own_partner(loop, system, lowest)
            except LoadError as error:
                raise RecipeError(f"{place}: {error}") from error


def remarks_on_clipping(recipe: Recipe, system: Source) -> list[str]:
    """Say which kinds of excitation leave the ranges of the inputs often, a sentence each."""
    return [
        f"{table}.excitation, number {number} ({kind.kind}): {remark}"
        for table, kinds in recipe.tables_of_kinds().items()
        for number, kind in enumerate(kinds, 1)
        for remark in [clipped(kind, tuple(system.inputs), recipe.window.step)]
        if remark is not None
    ]


def require_same_signals(recipe: Recipe, made: System, reference: System) -> None:
    """Refuse a reference with other signals, or with outputs of another meaning.

    Raises:
        RecipeError: the message names the difference.
    """
    wanted = _interface(made)
    for what, own in _interface(reference).items():
        if own != wanted[what]:
            raise RecipeError(
                f"recipe {recipe.name!r}: system.reference = {recipe.system.reference} changes "
                f"the {what} to {own}; expected, as with system.parameters, {wanted[what]}: "
                "leave out what changes that, or give it in system.parameters too"
            )


def _interface(system: System) -> dict[str, object]:
    """Return the properties of a system that its surrogate relies on, by name."""
    chain = chain_of(system)
    return {
        "inputs": [(s.name, s.unit, s.low, s.high) for s in system.inputs],
        "outputs": [(s.name, s.unit, s.low, s.high) for s in system.outputs],
        "hold and angle of the inputs": [(s.hold, s.angle) for s in system.inputs],
        # outputs may depend on lengths, twists and tool point
        "geometry of the serial chain": None
        if chain is None
        else {name: getattr(chain, name).tolist() for name in GEOMETRY},
    }


def require_features(recipe: Recipe, system: Source) -> None:
    """Refuse networks with features that the system lacks, or with too many turned states.

    Raises:
        RecipeError: the message has the table and its fault.
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
    """Refuse to turn more pairs of states than exist, or features that are not a vector.

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


def load_picture(name: str) -> Callable[[System], bytes]:
    """Find the function that draws a system.

    Args:
        name: ``"package.module:function"``, importable in this environment.

    Returns:
        The function, which takes the system and gives the bytes of a PNG file.

    Raises:
        LoadError: the module cannot be imported, or has no such function.
    """
    expected = "takes the system and gives the bytes of a PNG file"
    return imported_function(f"system.picture = {name!r}", name, expected)
