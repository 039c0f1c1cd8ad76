"""An FMU is unpacked, for some time or once in every process, so that it can be instantiated."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from slide_fmu.core.extras import require_running
from slide_fmu.core.files import FullDiskError, filling
from slide_fmu.importer.description import (
    Interface,
    offered_interfaces,
    read_description,
    require_co_simulation,
)
from slide_fmu.importer.errors import CoSimulationError

if TYPE_CHECKING:  # fmpy is of the extra "run": who only imports this module needs none
    from fmpy.model_description import ModelDescription, ModelVariable

REMEDY = "get the file again, or write it anew (slide-fmu export)"
"""The remedy for a damaged FMU."""


@dataclass(frozen=True, eq=False)
class UnpackedFmu:
    """An UnpackedFmu is ready to be instantiated.

    Attributes:
        path: the file it was unpacked from.
        folder: folder with its files.
        description: fmpy's model description.
        interface: the interface that is used.
    """

    path: Path
    folder: str
    description: ModelDescription
    interface: Interface = "co_simulation"

    @property
    def offer(self) -> Any:
        """What the model description says about the interface that is used."""
        return offered_interfaces(self.description)[self.interface]

    @cached_property
    def variables(self) -> Mapping[str, ModelVariable]:
        """All variables by name."""
        return {variable.name: variable for variable in self.description.modelVariables}

    @cached_property
    def references(self) -> Mapping[str, int]:
        """Value reference of every variable."""
        return {name: one.valueReference for name, one in self.variables.items()}

    @property
    def step(self) -> float:
        """The communication step in s in the FMU's DefaultExperiment."""
        return float(self.description.defaultExperiment.stepSize)

    def require(self, *names: str) -> None:
        """Raise a CoSimulationError, with all names, for variables that the FMU does not have."""
        unknown = [name for name in names if name not in self.variables]
        if unknown:
            raise CoSimulationError(
                f"{self.path.name} has no variables {unknown}; it has {sorted(self.variables)}"
            )


@contextmanager
def unpacked(path: Path) -> Iterator[UnpackedFmu]:
    """Unpack an FMU for co-simulation for the time of a ``with`` block.

    Raises:
        CoSimulationError: the file cannot be unpacked, or is not a co-simulation FMU of FMI 2.0 or
            FMI 3.0.
        FullDiskError: there is no space for its files.
        FmuError: the file is not an FMU, or its model description cannot be read.
    """
    description = read_description(path, validate=False)
    require_co_simulation(str(path), description)
    # a library that a process has loaded cannot be removed everywhere
    with TemporaryDirectory(prefix="slide_fmu_", ignore_cleanup_errors=True) as folder:
        _unpack(path, folder)
        yield UnpackedFmu(path, folder, description)


def folder_of_process(path: Path) -> str:
    """Return the folder of an FMU, unpacked once in every process and removed when that ends.

    Raises:
        CoSimulationError: it cannot be unpacked.
        FullDiskError: there is no space for its files.
    """
    stamp = path.stat()
    return _folder_of_process(path, stamp.st_mtime_ns, stamp.st_size).name


@cache
def _folder_of_process(path: Path, modified: int, size: int) -> TemporaryDirectory[str]:
    """Unpack a file; another one of its name has another time or size."""
    folder = TemporaryDirectory(prefix="slide_fmu_", ignore_cleanup_errors=True)
    try:
        _unpack(path, folder.name)
    except BaseException:
        folder.cleanup()
        raise
    return folder


def _unpack(path: Path, folder: str) -> None:
    """Unpack an FMU into a folder; raises a ModuleNotFoundError with its remedy without fmpy."""
    require_running()
    import fmpy

    try:
        with filling(Path(folder)):
            fmpy.extract(str(path), folder)
    except FullDiskError:
        raise
    except Exception as error:  # fmpy raises bare Exception for paths outside of the folder
        raise CoSimulationError(f"{path} cannot be unpacked: {error}; {REMEDY}") from error
