"""Model descriptions are read, and say how an FMU may be run."""

from __future__ import annotations

import math
import re
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from slide_fmu.core.zip_directory import open_archive, read_limited, require_size
from slide_fmu.importer.errors import CoSimulationError, FmuError

if TYPE_CHECKING:  # fmpy is of the extra "run": who only imports this module needs none
    from fmpy.model_description import ModelDescription

Interface = Literal["co_simulation", "model_exchange"]

REALS = ("Real", "Float64")
"""Types of real variables in double precision, of FMI 2.0 and FMI 3.0."""

MOST_BYTES = 100_000_000
"""A model description has at most so many bytes: enough for some 100 000 variables."""

WHOLE = 1e-6
"""Allowed rounding of a step from a multiple of an FMU's own step."""


def read_description(path: Path, validate: bool = True) -> ModelDescription:
    """Read the model description of an FMU, by any tool.

    Args:
        path: the FMU file.
        validate: also refuse files that violate the standard's schema.

    Raises:
        FmuError: the file is not an FMU, or is one of FMI 1.0, or its model description cannot be
            read, or lacks what no importer can do without.
    """
    try:
        description = _read(path, validate)
    except Exception as error:  # fmpy raises bare Exception, lxml a SyntaxError, dicts a KeyError
        if _is_of_fmi_1(path):
            raise FmuError(
                f"{path} is of FMI 1.0; expected FMI 2.0 or 3.0: export it again"
            ) from None
        raise FmuError(
            f"{path} is not an FMU that can be read: {_reason(path, error)}; expected an FMU: "
            "replace it"
        ) from error
    if (fault := next(_faults(description), None)) is not None:
        raise FmuError(
            f"{path} is not an FMU that can be run: in its modelDescription.xml, {fault}: export "
            "it again, or ask who made it"
        )
    return description


def _read(path: Path, validate: bool) -> ModelDescription:
    import fmpy

    with open_archive(path) as archive:  # it refuses what fmpy would read, or unpack elsewhere
        require_size(archive, "modelDescription.xml", MOST_BYTES)
    with path.open("rb") as file:  # fmpy does not close a file that it cannot read
        return fmpy.read_model_description(file, validate=validate)


def _reason(path: Path, error: Exception) -> str:
    """Say why a description cannot be read: fmpy stumbles over some faults, which schemas name."""
    from fmpy.model_description import ValidationError

    stumbled = isinstance(error, AttributeError | IndexError | TypeError | ValueError | KeyError)
    if not stumbled or "modelDescription.xml" in str(error):
        return str(error)
    try:
        _read(path, validate=True)
    except ValidationError as named:
        return str(named)
    except Exception:  # of schemas and reader, none has words for it
        pass
    return (
        "its modelDescription.xml is no model description of FMI 2.0 or 3.0, or refers to "
        f"variables that it does not have ({type(error).__name__}: {error})"
    )


def _faults(description: ModelDescription) -> Iterator[str]:
    """Say what is missing, or no number, without which no FMU can be instantiated and set up."""
    token = "instantiationToken" if is_fmi_3(description) else "guid"
    if getattr(description, token) is None:
        yield f"{token} is missing; expected that of its library"
    for name, offer in offered_interfaces(description).items():
        if not offer.modelIdentifier:
            yield f"modelIdentifier is missing for {name}; expected the name of its library"
    numbers = {
        f"{key} of the default experiment": getattr(description.defaultExperiment, key, None)
        for key in ("startTime", "stopTime", "stepSize")
    }
    for one in description.modelVariables:
        if one.type in (*REALS, "Float32") and not one.dimensions:
            keys = ("start", "min", "max", "nominal")
            numbers.update({f"{key} of {one.name!r}": getattr(one, key) for key in keys})
    for what, text in numbers.items():
        try:
            float(text or 0.0)
        except ValueError:
            yield f"{what} is {text!r}; expected a number"


def _is_of_fmi_1(path: Path) -> bool:
    """Return whether an FMU that fmpy cannot read is of FMI 1.0."""
    try:
        with open_archive(path) as archive:
            text = read_limited(archive, "modelDescription.xml", MOST_BYTES)
            version = re.search(rb'fmiVersion\s*=\s*"1\.', text)
    except (OSError, KeyError, zipfile.BadZipFile):
        return False
    return version is not None


def is_known_version(description: ModelDescription) -> bool:
    """Tell whether an FMU is of FMI 2.0 or FMI 3.0."""
    return str(description.fmiVersion)[:2] in ("2.", "3.")


def require_co_simulation(label: str, description: ModelDescription) -> None:
    """Refuse an FMU that is not for co-simulation of FMI 2.0 or FMI 3.0.

    Raises:
        CoSimulationError: it is of another version or interface; the label names it.
    """
    if not is_known_version(description) or description.coSimulation is None:
        kind = "model exchange" if description.modelExchange is not None else "another interface"
        raise CoSimulationError(
            f"{label} is of FMI {description.fmiVersion}, for {kind}; expected co-simulation of "
            "FMI 2.0 or 3.0: export it again for co-simulation"
        )


def is_fmi_3(description: ModelDescription) -> bool:
    """Tell whether an FMU is of FMI 3.0, else of FMI 2.0."""
    return str(description.fmiVersion).startswith("3.")


def offered_interfaces(description: ModelDescription) -> dict[Interface, Any]:
    """Return what an FMU says of each interface that it has, the default interface first."""
    offers: dict[Interface, Any] = {
        "co_simulation": description.coSimulation,
        "model_exchange": description.modelExchange,
    }
    return {name: offer for name, offer in offers.items() if offer is not None}


def experiment(description: ModelDescription, key: str) -> float | None:
    """Return a number of the default experiment, such as ``"stepSize"``; None without one."""
    text = getattr(description.defaultExperiment, key, None)
    return None if text is None else float(text)


def start_time(description: ModelDescription) -> float:
    """Return the time in s at which an FMU begins: that of its default experiment, else 0."""
    return experiment(description, "startTime") or 0.0


def named_step(description: ModelDescription) -> float | None:
    """Return the step in s that an FMU names: its internal one, or its default experiment's."""
    internal = getattr(description.coSimulation, "fixedInternalStepSize", None)
    step = float(internal or experiment(description, "stepSize") or 0.0)
    return step if step > 0.0 else None


def takes_any_step(description: ModelDescription) -> bool:
    """Tell whether an FMU for co-simulation takes steps of any length."""
    return bool(description.coSimulation.canHandleVariableCommunicationStepSize)


def only_step(description: ModelDescription) -> float | None:
    """Return the step in s whose multiples alone an FMU takes; None if it takes any.

    It is also None where the FMU does not name it.
    """
    return None if takes_any_step(description) else named_step(description)


def is_multiple(step: float, own: float) -> bool:
    """Tell whether a step is a multiple of another one, both in s."""
    count = step / own
    return round(count) >= 1 and math.isclose(count, round(count), rel_tol=WHOLE)


def require_step(label: str, description: ModelDescription, step: float) -> None:
    """Refuse a communication step in s that an FMU does not take.

    Raises:
        CoSimulationError: it is no multiple of the only step of the FMU, which the label names.
    """
    own = only_step(description)
    if own is not None and not is_multiple(step, own):
        raise CoSimulationError(
            f"{label}: a step of {step:g} s; expected a multiple of {own:g} s, since it takes no "
            "other one (canHandleVariableCommunicationStepSize)"
        )
