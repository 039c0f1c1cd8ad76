"""SSP files (System Structure and Parameterization 1.0) hold coupled systems."""

from __future__ import annotations

import csv
import posixpath
import zipfile
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar
from urllib.parse import unquote
from xml.etree import ElementTree

import numpy as np

from slide_fmu.apps.couple.structure import BOOLEAN, CoupledSystem, Pin, coupled_system
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.zip_directory import LargeMemberError, open_archive, read_limited
from slide_fmu.cosim.ssp import DESCRIPTION, STRUCTURE, Connection, write_system
from slide_fmu.cosim.ssv import parameters_of, units_of
from slide_fmu.fmu.export import LARGEST, LARGEST_TEXT
from slide_fmu.importer.description import REALS
from slide_fmu.record_files.csv_file import read_fields

Value = TypeVar("Value")

SSD = f"{{{DESCRIPTION}}}"
SSV = "{http://ssp-standard.org/SSP1/SystemStructureParameterValues}"
FMU_KIND = "application/x-fmu-sharedlibrary"


@dataclass(frozen=True)
class SspSystem:
    """An SspSystem is what an SSP file says: arguments of ``couple``.

    Attributes:
        fmus: the unpacked FMUs by the names of the components.
        connections: pairs of ``COMPONENT.VARIABLE``.
        parameters: start values by ``COMPONENT.VARIABLE``.
        units: the units that it names for some of them.
        inputs: the inputs ``COMPONENT.VARIABLE`` that each connector of the system leads to.
        outputs: the output ``COMPONENT.VARIABLE`` of each connector of the system.
        stop: end time in s of its default experiment; None without one.
    """

    fmus: Mapping[str, Path]
    connections: list[tuple[str, str]]
    parameters: Mapping[str, float]
    units: Mapping[str, str]
    inputs: Mapping[str, Sequence[str]]
    outputs: Mapping[str, str]
    stop: float | None

    def with_components(self, values: Mapping[str, Value]) -> dict[str, Value]:
        """Return values of inputs by component, of which some are named by a connector."""
        return {
            place: value
            for name, value in values.items()
            for place in self.inputs.get(name, (name,))
        }


def read_ssp(path: Path, folder: Path) -> SspSystem:
    """Read an SSP file, and unpack its FMUs into a folder.

    Raises:
        ValueError: it is not an SSP file, or has something that coupled runs do not know.
    """
    try:
        with open_archive(path) as archive:
            size = sum(member.file_size for member in archive.infolist())
            if size > LARGEST:
                raise LargeMemberError(f"it unpacks to {size} bytes; expected at most {LARGEST}")
            root = ElementTree.fromstring(read_limited(archive, STRUCTURE, LARGEST_TEXT))
            return _read(path, root, archive, folder)
    except (zipfile.BadZipFile, KeyError, ElementTree.ParseError) as error:
        raise ValueError(
            f"{path} is not an SSP file that can be read ({error}); expected an archive with "
            f"{STRUCTURE}, as slide-fmu ssp writes one"
        ) from error


def _read(
    path: Path, root: ElementTree.Element, archive: zipfile.ZipFile, folder: Path
) -> SspSystem:
    system = root.find(f"{SSD}System")
    if system is None:
        raise ValueError(f"{path}: {STRUCTURE} has no System; expected one")
    if system.find(f"{SSD}ParameterBindings") is not None:
        raise ValueError(
            f"{path}: the system has ParameterBindings; expected them in components alone: move "
            "each one into its component, or give the values by --set"
        )
    for tag in ("System", "SignalDictionaryReference"):
        if (element := system.find(f"{SSD}Elements/{SSD}{tag}")) is not None:
            raise ValueError(
                f"{path}: the system has an element {tag} {element.get('name')!r}; expected "
                "components alone: move its components into the system"
            )
    fmus, parameters, units = {}, {}, {}
    components = system.findall(f"{SSD}Elements/{SSD}Component")
    if not components:
        raise ValueError(
            f"{path}: the system of {STRUCTURE} has no components; expected at least one FMU"
        )
    for component in components:
        name, source = str(component.get("name") or ""), str(component.get("source"))
        if not name.strip():
            raise ValueError(
                f"{path}: the component with the source {source!r} has no name; expected one: "
                "give it the attribute name"
            )
        source = posixpath.normpath(unquote(source))  # a URI, relative to the structure
        if component.get("type", FMU_KIND) != FMU_KIND or source not in archive.namelist():
            raise ValueError(
                f"{path}: component {name!r} has the source {source!r} of type "
                f"{component.get('type', FMU_KIND)!r}; expected an FMU inside the SSP"
            )
        if name in fmus:
            raise ValueError(
                f"{path}: there are two components {name!r}; expected one of each name: rename one"
            )
        fmus[name] = Path(archive.extract(source, folder))
        values, named = _parameters(path, component, archive)
        parameters.update({f"{name}.{key}": value for key, value in values.items()})
        units.update({f"{name}.{key}": unit for key, unit in named.items()})
    connections, inputs, outputs = _connections(path, system)
    return SspSystem(fmus, connections, parameters, units, inputs, outputs, _stop(path, root))


def _connections(
    path: Path, system: ElementTree.Element
) -> tuple[list[tuple[str, str]], dict[str, list[str]], dict[str, str]]:
    """Return connections of components, and those of the system's connectors, as SspSystem has."""
    connections, inputs, outputs = [], defaultdict[str, list[str]](list), dict[str, str]()
    for element in system.findall(f"{SSD}Connections/{SSD}Connection"):
        start, end = _connection(path, element)
        if element.get("startElement") is None:
            inputs[start].append(end)
        elif element.get("endElement") is None:
            outputs[end] = start
        else:
            connections.append((start, end))
    return connections, inputs, outputs


def _stop(path: Path, root: ElementTree.Element) -> float | None:
    """Return the end time in s of the default experiment, which must begin at 0."""
    experiment = root.find(f"{SSD}DefaultExperiment")
    if experiment is None:
        return None
    times: dict[str, float] = {}
    for key in ("startTime", "stopTime"):
        if (text := experiment.get(key)) is not None:
            try:
                times[key] = float(text)
            except ValueError:
                raise ValueError(
                    f"{path}: the default experiment has {key} = {text!r}; expected a number in "
                    "s: correct it"
                ) from None
    if times.get("startTime", 0.0) != 0:
        raise ValueError(
            f"{path}: the default experiment begins at {times['startTime']:g} s; expected 0, "
            "where coupled runs begin: set startTime to 0, and shift stopTime and the inputs"
        )
    return times.get("stopTime")


def _connection(path: Path, connection: ElementTree.Element) -> tuple[str, str]:
    """Return the ends of a connection; the end of which is an input is known later.

    A connector of the system has its name alone.
    """
    start, end = (
        (connection.get(f"{side}Element"), connection.get(f"{side}Connector"))
        for side in ("start", "end")
    )
    names = [f"{element}.{name}" if element else str(name) for element, name in (start, end)]
    if start[0] is None and end[0] is None:
        raise ValueError(
            f"{path}: the connection {names[0]} to {names[1]} has connectors of the system at "
            "both ends; expected a component at one of them: remove it"
        )
    if None in (start[1], end[1]):
        side = "startConnector" if start[1] is None else "endConnector"
        raise ValueError(
            f"{path}: the connection from {start[0]!r} to {end[0]!r} has no {side}; expected the "
            "name of a variable: add it"
        )
    if len(connection):
        raise ValueError(
            f"{path}: the connection {names[0]} to {names[1]} converts values; expected a plain "
            "one: convert in an FMU"
        )
    return names[0], names[1]


def _parameters(
    path: Path, component: ElementTree.Element, archive: zipfile.ZipFile
) -> tuple[dict[str, float], dict[str, str]]:
    """Return the start values of a component, from files and from what the SSP itself has.

    Also return the units that it names for some of them.
    """
    values: dict[str, float] = {}
    units: dict[str, str] = {}
    for binding in component.iter(f"{SSD}ParameterBinding"):
        if binding.get("prefix") or binding.find(f"{SSD}ParameterMapping") is not None:
            raise ValueError(
                f"{path}: a ParameterBinding of component {component.get('name')!r} has a prefix "
                "or a ParameterMapping; expected neither: write the names of the FMU into the "
                "parameter set"
            )
        source = binding.get("source")
        if source is not None and posixpath.normpath(unquote(source)) not in archive.namelist():
            raise ValueError(
                f"{path}: component {component.get('name')!r} has its parameters in {source!r}; "
                "expected this file inside the SSP: add it, or remove the ParameterBinding"
            )
        sets = []
        if source is not None:
            member = posixpath.normpath(unquote(source))
            sets.append((read_limited(archive, member, LARGEST_TEXT), f"{path}/{source}"))
        for inner in binding.iter(f"{SSV}ParameterSet"):
            sets.append((ElementTree.tostring(inner), f"{path}/{STRUCTURE}"))
        for content, place in sets:
            values |= parameters_of(content, place)
            units |= units_of(content)
    return values, units


def write_ssp(
    path: str | Path,
    fmus: Mapping[str, str | Path],
    connections: Iterable[tuple[str, str]],
    *,
    parameters: Mapping[str, Any] | None = None,
) -> Path:
    """Write several FMUs and their connections as one SSP file, for this and other tools.

    Args:
        path: file to write, ending in ``.ssp``; an old file is replaced as a whole.
        fmus: as in ``couple``.
        connections: as in ``couple``; they come from outputs.
        parameters: as in ``couple``. FMPy reads none from SSP files.

    Returns:
        The path.

    Raises:
        CoSimulationError: an FMU is not for co-simulation.
        FmuError: a file is no FMU.
        OSError: the file cannot be written.
        ValueError: the path does not end in ``.ssp``, or a name, a value, a unit or a connection
            is wrong.
    """
    path, system = Path(path), coupled_system(fmus, connections, parameters or {}, {})
    links = [Connection(link.source, link.target) for link in system.links]
    given = {
        name: {variable: _of_type(system, Pin(name, variable), value) for variable, value in pairs}
        for name, pairs in ((name, values.items()) for name, values in system.parameters.items())
    }
    return write_system(path, path.stem, system.paths, links, given)


def _of_type(system: CoupledSystem, pin: Pin, value: Any) -> float | bool:
    """Return a start value as the type of its variable, which SSP names.

    Raises:
        ValueError: it is no such value.
    """
    kind = str(system.variable(pin).type)
    number = bool if kind == BOOLEAN else float if kind in REALS else int
    try:
        typed = number(value)
        if kind != "String" and not isinstance(value, str) and typed == value:
            return typed
    except (TypeError, ValueError):
        pass
    raise ValueError(
        f"parameters: {pin} = {value!r}, of type {kind}; expected a number, or True or False for "
        "a Boolean: SSP files are written with these alone"
    )


def read_inputs(path: Path) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Read a table of inputs over time, as ``couple`` takes them; separators are found.

    Raises:
        ValueError: it has no column ``time`` first, two columns of one name, or a row with
            something else than numbers.
    """
    try:
        (heading, *rows), decimal = read_fields(path)
    except csv.Error as error:
        raise ValueError(
            f"{path} cannot be read ({error}); expected a table of separated values"
        ) from error
    if len(heading) < 2 or heading[0] != "time":
        raise ValueError(
            f"{path} begins with the columns {heading}; expected time, then COMPONENT.VARIABLE "
            "for each input, and rows of numbers below"
        )
    if twice := sorted({name for name in heading if heading.count(name) > 1}):
        raise ValueError(
            f"{path} has the columns {twice} more than once; expected one for each input: remove "
            "the others"
        )
    values = []
    for line, row in enumerate(rows, start=2):
        try:
            numbers = [float(cell.replace(decimal, ".")) for cell in row]
        except ValueError:
            numbers = []
        if len(numbers) != len(heading):
            raise ValueError(f"{path}, line {line}: {row}; expected {len(heading)} numbers")
        values.append(numbers)
    table = np.array(values)
    return {name: (table[:, 0], table[:, i]) for i, name in enumerate(heading) if i}
