"""This module refuses faults of a recipe that are found before data are made."""

from __future__ import annotations

from collections.abc import Callable
from typing import Concatenate, ParamSpec, TypeVar

from slide_fmu.bounds.known_start import known_start
from slide_fmu.data.answers import asked_of_sources
from slide_fmu.data.contract import check_system
from slide_fmu.data.draws import probe_draws
from slide_fmu.data.isolated_process import crosses, guarded
from slide_fmu.fmu.description.surrogate_variables import require_free_names
from slide_fmu.memory.modes import UnstableModeError
from slide_fmu.pipeline.apps import check_app_tables
from slide_fmu.recipe.against_system import require_all_kinds, require_features
from slide_fmu.recipe.case import Case
from slide_fmu.recipe.recipe import Recipe, RecipeError
from slide_fmu.systems.base import Source, System
from slide_fmu.systems.errors import SimulationError

Result = TypeVar("Result")
Arguments = ParamSpec("Arguments")


def check_case(case: Case) -> None:
    """Refuse faults that are found before data are made.

    Raises:
        LoadError: one of the recipe's systems cannot be made, or records cannot be used.
        RecipeError: they do not fit each other or the excitation, a network has features that the
            system lacks, or the FMU that the training begins with does not fit.
        ContractError: the system that makes the data breaks its contract.
        SimulationError: it could not be simulated on a short motion, or its library crashes.
    """
    recipe, source = case.recipe, case.source
    check_app_tables(recipe)
    require_all_kinds(recipe, source)
    known_start(recipe, source)
    require_names_in_fmu(recipe, source)
    check_systems(source, case)


@asked_of_sources
def check_systems(system: System, case: Case) -> None:
    """Refuse systems that do not fit each other or the networks, or break their contract."""
    _ = case.reference
    require_features(case.recipe, system)
    guarded_case(case, _keep_their_word)


def require_names_in_fmu(recipe: Recipe, source: Source) -> None:
    """Refuse signals and parameters with the name of another variable of the FMU.

    Raises:
        RecipeError: a name is used twice; the message has the remedy.
    """
    parameters = [parameter.signal for parameter in recipe.physical()]
    try:
        require_free_names(source.inputs, source.outputs, parameters)
    except ValueError as error:
        raise RecipeError(f"recipe {recipe.name!r}: {error}") from error


def guarded_case(
    case: Case,
    function: Callable[Concatenate[Case, Arguments], Result],
    *arguments: Arguments.args,
    **named: Arguments.kwargs,
) -> Result:
    """Call a function with a case and arguments, in a separate program if its system may crash.

    Raises:
        SimulationError: the system ended the program that simulated it.
        Exception: raised by the function; errors that name no recipe get its name.
    """
    recipe, system = case.recipe, case.system
    model = recipe.system.model, recipe.system.kind
    try:
        if recipe.system.kind == "object" and not crosses(system):
            return function(case, *arguments, **named)
        return guarded(system, model, function, case, *arguments, **named)
    except ValueError as error:
        if type(error) not in (ValueError, UnstableModeError):
            raise
        raise type(error)(f"recipe {recipe.name!r}: {error}") from error


def _keep_their_word(case: Case) -> None:
    """Check the system of a recipe on the first short motion on which it does not fail."""
    recipe, system = case.recipe, case.system
    failure = SimulationError("no motion was drawn")
    for drawn in probe_draws(recipe, system):
        try:
            return check_system(system, recipe.window.step, drawn.inputs, recipe.system.model)
        except SimulationError as error:
            failure = error
    raise failure
