"""This module reads files of FMUs, and unpacks them once in every process."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, Literal, cast

import fmpy
from fmpy.model_description import CoSimulation, ModelDescription, ModelExchange
from pydantic import ConfigDict, Field, ValidationError

from slide_fmu.core.files import FullDiskError
from slide_fmu.core.mistakes import mistakes
from slide_fmu.core.toml_table import Table
from slide_fmu.core.unpacking import UnpackingError, unpack
from slide_fmu.core.zip_directory import open_archive
from slide_fmu.systems.declared import Parameter
from slide_fmu.systems.errors import LoadError
from slide_fmu.systems.user_code import find_file

Interface = Literal["co_simulation", "model_exchange"]
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
        return str(self.description.fmiVersion).startswith("3.")

    @property
    def type(self) -> CoSimulation | ModelExchange:
        """Give what the model description says about the interface that is used."""
        found = offered_interfaces(self.description)[self.interface]
        return cast("CoSimulation | ModelExchange", found)

    @property
    def interpolates(self) -> bool:
        """Tell whether it takes the slopes of its inputs in co-simulation, as of FMI 2.0 alone."""
        return not self.fmi_3 and bool(getattr(self.type, "canInterpolateInputs", False))

    @property
    def is_continuous(self) -> bool:
        """Tell whether it has continuous states alone, as far as its description says."""
        found = self.description
        discrete = any(
            v.variability == "discrete" and v.causality in ("local", "output")
            for v in found.modelVariables
        )
        return (
            self.interface == "model_exchange"
            and found.numberOfContinuousStates > 0
            and found.numberOfEventIndicators == 0
            and not discrete
        )

    @property
    def own_step(self) -> float | None:
        """The step in s that the user names, or the FMU: its internal one, or its experiment's."""
        if self.options.step is not None:
            return self.options.step
        internal = getattr(self.type, "fixedInternalStepSize", None)
        experiment = getattr(self.description.defaultExperiment, "stepSize", None)
        step = float(internal or experiment or 0.0)
        return step if step > 0.0 else None

    @property
    def held_step(self) -> float | None:
        """The step in s over which an importer holds the inputs; model exchange has none."""
        return self.own_step if self.interface == "co_simulation" else None


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
        with path.open("rb") as file:  # fmpy does not close a file that it cannot read
            description = fmpy.read_model_description(file, validate=False)
    except Exception as error:  # fmpy raises bare Exception, lxml a SyntaxError, dicts a KeyError
        raise LoadError(
            f"{label} is not an FMU that can be read: {error}; expected one of FMI 2.0 or 3.0"
        ) from error
    if str(description.fmiVersion)[:2] not in ("2.", "3."):
        raise LoadError(
            f"{label} is of FMI {description.fmiVersion}; expected FMI 2.0 or 3.0: export it anew"
        )
    found = FmuFile(path, description, _choose(label, description, options.interface), options)
    _require_library(label, found)
    return found


def unpacked(file: FmuFile) -> str:
    """Give the folder of an FMU, unpacked once in every process and removed when that ends.

    Raises:
        LoadError: it cannot be unpacked.
        FullDiskError: there is no room for its files.
    """
    stamp = file.path.stat()
    return _unpacked(file.path, stamp.st_mtime_ns, stamp.st_size).name


@cache
def _unpacked(path: Path, modified: int, size: int) -> tempfile.TemporaryDirectory[str]:
    """Unpack a file; another one of its name has another time or size."""
    folder = tempfile.TemporaryDirectory(prefix="slide_fmu_", ignore_cleanup_errors=True)
    try:
        unpack(path, folder.name)
    except FullDiskError:
        folder.cleanup()
        raise
    except UnpackingError as error:
        folder.cleanup()
        raise LoadError(f"FMU {str(path)!r} cannot be unpacked: {error}") from error
    return folder


def offered_interfaces(description: ModelDescription) -> dict[Interface, object]:
    """Give what an FMU says of its interfaces; the one comes first that nobody need choose."""
    found: dict[Interface, object] = {
        "co_simulation": description.coSimulation,
        "model_exchange": description.modelExchange,
    }
    return {name: type_ for name, type_ in found.items() if type_ is not None}


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
    library = f"{file.type.modelIdentifier}{fmpy.sharedLibraryExtension}"
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
