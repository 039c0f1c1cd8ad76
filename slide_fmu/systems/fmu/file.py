"""This module reads files of FMUs that can be reference systems."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal, cast

import fmpy
from fmpy.model_description import (
    CoSimulation,
    ModelDescription,
    ModelExchange,
    ModelVariable,
)
from pydantic import ConfigDict, Field, ValidationError

from slide_fmu.core.mistakes import mistakes
from slide_fmu.core.toml_table import Table
from slide_fmu.core.units import PINT_BASES, is_known_unit, unit_of_bases
from slide_fmu.core.zip_directory import open_archive
from slide_fmu.importer.description import (
    Interface,
    is_fmi_3,
    is_known_version,
    named_step,
    offered_interfaces,
    read_description,
    takes_any_step,
)
from slide_fmu.importer.errors import FmuError
from slide_fmu.systems.declared import Parameter
from slide_fmu.systems.errors import LoadError
from slide_fmu.systems.user_code import find_file

Solver = Literal["CVode", "Euler"]


PREFIX = "fmu-"
"""Prefix of the names of options among the parameters of a recipe."""


class FmuOptions(Table):
    """FmuOptions say how an FMU is simulated; they are no parameters of the FMU.

    In recipes they stand among the parameters, as ``fmu-interface`` and so on: no variable of an
    FMU has such a name, since structured names have no hyphen.

    Attributes:
        interface: which one is used of an FMU that has both; co-simulation if None, where it is.
        substeps: parts of a sample step. Co-simulation FMUs that cannot interpolate their inputs
            take a moving input as that many stairs; fmpy's Euler solver takes that many steps.
        step: step in s by which an importer runs a co-simulation FMU. Each input is then held over
            it, as it is when the step begins: so fmpy does, and most others. If None, its inputs
            move as smoothly as ``substeps`` show.
        solver: fmpy's solver of model exchange.
        tolerance: relative tolerance of CVode, 1e-8 if None, or of the FMU's own solver, which
            keeps its own if None.
    """

    model_config = ConfigDict(alias_generator=lambda name: PREFIX + name)

    interface: Interface | None = None
    substeps: int = Field(default=10, ge=1)
    step: Annotated[float, Field(gt=0)] | None = None
    solver: Solver = "CVode"
    tolerance: Annotated[float, Field(gt=0, lt=1)] | None = None


@dataclass(frozen=True, eq=False)
class FmuFile:
    """An FmuFile is an FMU that can be simulated here.

    Attributes:
        path: where it lies.
        description: its model description.
        interface: the one that is used.
        options: how it is simulated.
    """

    path: Path
    description: ModelDescription
    interface: Interface
    options: FmuOptions

    @property
    def fmi_3(self) -> bool:
        """Tell whether it is of FMI 3.0, else of FMI 2.0."""
        return is_fmi_3(self.description)

    @property
    def offer(self) -> CoSimulation | ModelExchange:
        """What the model description says about the interface that is used."""
        offer = offered_interfaces(self.description)[self.interface]
        return cast("CoSimulation | ModelExchange", offer)

    @cached_property
    def units(self) -> Mapping[str, str | None]:
        """Known units by the names of those that it defines or uses; None without one.

        A name that is not known here is known by its definition.
        """
        defined = {unit.name: unit.baseUnit for unit in self.description.unitDefinitions}
        used = {declared_in(variable, "unit") for variable in self.description.modelVariables}
        return {
            name: name if is_known_unit(name) else _by_definition(defined.get(name))
            for name in used
            if name
        }

    @property
    def interpolates(self) -> bool:
        """Tell whether it takes the slopes of its inputs in co-simulation, as of FMI 2.0 alone."""
        return not self.fmi_3 and bool(getattr(self.offer, "canInterpolateInputs", False))

    @property
    def is_continuous(self) -> bool:
        """Tell whether it has continuous states alone, as far as its description says."""
        description = self.description
        discrete = any(
            v.variability == "discrete" and v.causality in ("local", "output")
            for v in description.modelVariables
        )
        return (
            self.interface == "model_exchange"
            and description.numberOfContinuousStates > 0
            and description.numberOfEventIndicators == 0
            and not discrete
        )

    @property
    def own_step(self) -> float | None:
        """The step in s that the user names, or the FMU: its internal one, or its experiment's."""
        return self.options.step or named_step(self.description)

    @property
    def takes_any_step(self) -> bool:
        """Tell whether an importer may choose the steps; a solver of model exchange may."""
        return self.interface == "model_exchange" or takes_any_step(self.description)

    @property
    def importer_step(self) -> float | None:
        """The step in s by which an importer runs it, its inputs held over each.

        It is the one that the user names, or the only one that the FMU takes; None if it may be
        any, so that its inputs move as smoothly as ``fmu-substeps`` show.
        """
        return self.options.step if self.takes_any_step else self.own_step

    @property
    def held_step(self) -> float | None:
        """The step in s over which an importer holds the inputs; model exchange has none."""
        return self.own_step if self.interface == "co_simulation" else None


def declared_in(variable: ModelVariable, key: str) -> str | None:
    """Return what a variable's description says, or else its type; None if neither does."""
    declared = variable.declaredType
    return getattr(variable, key) or (declared and getattr(declared, key)) or None


def _by_definition(base: Any) -> str | None:
    """Return a known unit by what fmpy reads of its definition; None without one."""
    if base is None:
        return None
    exponents = {name: int(getattr(base, name) or 0) for name in PINT_BASES.values()}
    return unit_of_bases(exponents, float(base.factor or 1.0), float(base.offset or 0.0))


def split_options(
    label: str, parameters: Mapping[str, Parameter]
) -> tuple[FmuOptions, dict[str, Parameter]]:
    """Give the options among the parameters of a recipe, and the FMU's own parameters.

    Raises:
        LoadError: there is no such option, or it has another value; the label begins the message.
    """
    options = {key: value for key, value in parameters.items() if key.startswith(PREFIX)}
    own = {key: value for key, value in parameters.items() if key not in options}
    try:
        return FmuOptions.model_validate(options), own
    except ValidationError as error:
        known = {"": [PREFIX + name for name in FmuOptions.model_fields]}
        raise LoadError(mistakes(error, label, known)) from error


def read_fmu_file(model: str, options: FmuOptions) -> FmuFile:
    """Find and read an FMU; its library is not loaded.

    Raises:
        LoadError: there is no such file, it is no FMU of FMI 2.0 or 3.0, it has not the interface
            that is asked for, or no library for this platform.
    """
    label = f"FMU {model!r}"
    path = find_file(label, model)
    try:
        description = read_description(path, validate=False)
    except FmuError as error:
        raise LoadError(f"{label}: {error}") from error
    if not is_known_version(description):
        raise LoadError(
            f"{label} is of FMI {description.fmiVersion}; expected FMI 2.0 or 3.0: export it again"
        )
    file = FmuFile(path, description, _choose(label, description, options.interface), options)
    _require_library(label, file)
    return file


def _choose(label: str, description: ModelDescription, wanted: Interface | None) -> Interface:
    """Choose the interface: the one that is asked for, else co-simulation before the other."""
    offered = list(offered_interfaces(description))
    if not offered:
        raise LoadError(
            f"{label} is for scheduled execution; expected co-simulation or model exchange"
        )
    if wanted is not None and wanted not in offered:
        raise LoadError(
            f"{label}: {PREFIX}interface = {wanted!r}; expected one of {offered}, which it "
            "offers: correct or remove it"
        )
    return wanted or offered[0]


def _require_library(label: str, file: FmuFile) -> None:
    """Refuse an FMU that has no library for this platform."""
    platform = fmpy.platform_tuple if file.fmi_3 else fmpy.platform
    library = f"{file.offer.modelIdentifier}{fmpy.sharedLibraryExtension}"
    with open_archive(file.path) as archive:
        names = archive.namelist()
    if f"binaries/{platform}/{library}" in names:
        return
    parts = [name.split("/") for name in names if name.startswith("binaries/")]
    platforms = sorted({part[1] for part in parts if len(part) > 2})
    sources = any(name.startswith("sources/") and name.endswith(".c") for name in names)
    remedy = (
        "fmpy compile builds it from its sources" if sources else "export it for this platform"
    )
    raise LoadError(
        f"{label} has no library {library!r} for {platform!r}; it has some for "
        f"{platforms or 'no platform'}: {remedy}"
    )
