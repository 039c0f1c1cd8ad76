"""A Case holds a recipe together with the systems that are made from it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TypeVar, final

from slide_fmu.core.parameters import corners_of
from slide_fmu.core.signals import Hold, moves
from slide_fmu.recipe.against_system import (
    require_driving,
    require_jumps,
    require_loops,
    require_same_signals,
)
from slide_fmu.recipe.model_rules import rules_of
from slide_fmu.recipe.places import Place, RecipeFile
from slide_fmu.recipe.recipe import Recipe, RecipeError
from slide_fmu.systems.base import Bending, Finer, Source, System
from slide_fmu.systems.declared import SignalTable
from slide_fmu.systems.errors import LoadError
from slide_fmu.systems.loading import load_source, load_system, require_system
from slide_fmu.systems.specification import Specification

FINER = 8
"""A model without a step of its own counts as running by itself at a step this many times finer
than the FMU's."""

Driven = TypeVar("Driven", bound=Source)


@final
class Systems:
    """The systems of a recipe, each made when it is first asked for, and once.

    A pickle holds only their specifications, so that every process makes systems of its own.
    """

    def __init__(
        self, recipe: Recipe, given: System | None = None, file: RecipeFile | None = None
    ) -> None:
        self._recipe, self._given, self._file = recipe, given, file

    def __reduce__(
        self,
    ) -> tuple[type[Systems], tuple[Recipe, System | None, RecipeFile | None]]:
        return Systems, (self._recipe, self._given, self._file)

    @cached_property
    def source(self) -> Source:
        """The source of the data."""
        with self._place_named():
            return self._drivable(load_source(self.specification), self.specification)

    @cached_property
    def reference(self) -> System:
        """The reference system of the FMU."""
        if not self._recipe.system.reference:
            return require_system(self.source, self._recipe.system.model)
        made = self.reference_specification
        with self._place_named():
            reference = self._drivable(load_system(made), made)
        own = require_system(self.source, self._recipe.system.model)
        require_same_signals(self._recipe, own, reference)
        return reference

    @cached_property
    def specification(self) -> Specification:
        """Specification of the source; physical parameters have their start values."""
        return _specification(self._recipe, self._given)

    @property
    def reference_specification(self) -> Specification:
        """Specification of the reference."""
        made = self.specification
        return replace(made, parameters={**made.parameters, **self._recipe.system.reference})

    def at(self, recipe: Recipe) -> Systems:
        """Return the systems of another recipe, which may use the same object of a session."""
        return Systems(recipe, self._given, self._file)

    @contextmanager
    def _place_named(self) -> Iterator[None]:
        """Begin the message about a parameter of the model with its place in the recipe."""
        try:
            yield
        except LoadError as error:
            name, system = error.parameter, self._recipe.system
            if self._file is None or name is None:
                raise
            place: Place = ("system", "parameters", name)
            if name in system.reference:
                place = ("system", "reference", name)
            elif name in self._recipe.parameters:
                place = ("parameters", name)
            raise LoadError(f"{self._file.about(place)}: {error}", name) from error

    def _drivable(self, source: Driven, made: Specification) -> Driven:
        """Refuse excitations that cannot drive a source; add the inputs between samples."""
        recipe, parts = self._recipe, self._recipe.data.substeps
        bends = parts > 1 and isinstance(source, System) and moves(source.inputs)
        if bends and not isinstance(source, Bending):
            assert isinstance(source, System)
            source.finer = Finer(parts, partial(_with_parts, made, recipe.window.step, parts))
        require_jumps(recipe, source)
        require_driving(recipe, "data", recipe.data.excitation, source)
        require_loops(recipe, source)
        return source


@dataclass(frozen=True, eq=False)
class Case:
    """A case is a recipe with its systems, which are made when they are first asked for.

    Attributes:
        recipe: the recipe.
        systems: its systems, or the systems of a recipe that agrees about them.
    """

    recipe: Recipe
    systems: Systems

    @property
    def source(self) -> Source:
        """The source of the data: a simulated system, or records of one.

        Raises:
            LoadError: model, class, parameters or files are missing, or cannot be used.
            RecipeError: an excitation of the recipe cannot drive the inputs, or the recipe gives
                the step as a parameter.
        """
        return self.systems.source

    @property
    def system(self) -> System:
        """The system that makes the data.

        Raises:
            LoadError, RecipeError: as in ``source``; or there are only records.
        """
        return require_system(self.source, self.recipe.system.model)

    @property
    def reference(self) -> System:
        """The system that the FMU is measured against.

        Raises:
            LoadError, RecipeError: as in ``system``; or signals or geometry differ from the system
                that makes the data.
        """
        return self.systems.reference

    def with_recipe(self, recipe: Recipe) -> Case:
        """Return the case of a recipe that agrees about its systems."""
        return replace(self, recipe=recipe)

    def at(self, values: Mapping[str, float]) -> Case:
        """Return the case with values of its physical parameters; itself without parameters."""
        if not values:
            return self
        recipe = self.recipe.at(values)
        return Case(recipe, self.systems.at(recipe))

    def corners(self) -> list[dict[str, float]]:
        """Return the corners of the box of its physical parameters; one, empty, without any."""
        return corners_of(self.recipe.physical())

    def at_ends(self, ends: Mapping[str, float]) -> Case:
        """Return the case at ends of the ranges of its parameters, whose source can be made.

        Raises:
            LoadError: as in ``source``; the message names the values of parameters.
            RecipeError: as in ``source``.
        """
        case = self.at(ends)
        try:
            _ = case.source
        except LoadError as error:
            if not ends:
                raise
            values = ", ".join(f"{name} = {value:g}" for name, value in ends.items())
            keys = " or ".join(f"parameters.{name}.range" for name in ends)
            raise LoadError(
                f"with {values}, at the ends of the ranges of the parameters: {error}; expected a "
                f"model that can be made there: narrow {keys}, or correct the model"
            ) from error
        return case

    def system_with_step(self, step: float) -> System:
        """Make the system of the data with another sample step in s.

        Raises:
            LoadError: it cannot be made with that step.
        """
        return load_system(replace(self.systems.specification, step=step))

    @property
    def finer_steps(self) -> int:
        """Number of the reference's own steps, or of fine steps, in a sample step.

        An FMU that names a step uses it; every other model has ``FINER`` steps.
        """
        own = self.reference.own_step
        return FINER if own is None else max(1, round(self.recipe.window.step / own))

    def reference_as_it_runs(self, hold: Hold | None = None, parts: int | None = None) -> System:
        """Make the reference with the step by which it runs by itself (``finer_steps``).

        Its inputs have the hold of the recipe, unless another one is given, over the shorter step.
        A system that names its own step has held inputs over this step, as from an importer that
        runs it.

        Args:
            hold: how its inputs act over a step.
            parts: number of its steps in a sample step; ``finer_steps`` if None.

        Raises:
            LoadError: its class has a step of its own.
        """
        made, times = self.systems.reference_specification, parts or self.finer_steps
        step, inputs = self.recipe.window.step / times, made.inputs
        hold = "zero_order" if self.reference.own_step is not None else hold
        if hold is not None:
            held = SignalTable(hold=hold)
            inputs = {
                signal.name: held.over(made.inputs.get(signal.name, SignalTable()))
                for signal in self.reference.inputs
            }
        system = load_system(replace(made, step=step, inputs=inputs, part_of=times))
        _require_part(system, made, step, times, "let the class take the step that it is given")
        return system


def case_of(recipe: Recipe, given: System | None = None, file: RecipeFile | None = None) -> Case:
    """Return the case of a recipe, which may use an object of a session.

    Where the recipe's file is given, errors about parameters of the model name it.
    """
    return Case(recipe, Systems(recipe, given, file))


def _with_parts(made: Specification, step: float, parts: int) -> System:
    """Make a system whose step is a part of a sample step in s.

    Raises:
        LoadError: its class has a step of its own.
    """
    system = load_system(replace(made, step=step / parts, part_of=parts))
    remedy = "let the class take the step that it is given, or set data.substeps = 1"
    _require_part(system, made, step / parts, parts, remedy)
    return system


def _require_part(
    system: System, made: Specification, step: float, parts: int, remedy: str
) -> None:
    """Refuse a system whose step in s is not the requested one."""
    if not math.isclose(system.step, step, rel_tol=1e-9):
        raise LoadError(
            f"system {made.model!r}: sample step {system.step:g} s; expected {step:g} s, which "
            f"is 1/{parts} of window.step: {remedy}"
        )


def _specification(recipe: Recipe, given: System | None) -> Specification:
    """Return the specification of the source of a recipe.

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
    starts = rules_of(recipe).starts(recipe)
    return Specification(
        system.model,
        {**starts, **system.parameters},
        recipe.window.step,
        system.kind,
        system.inputs,
        system.outputs,
        system.further,
        system.noise_record,
        given=given,
    )
