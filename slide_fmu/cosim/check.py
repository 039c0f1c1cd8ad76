"""An FMU file is checked; the result is a list of problems, empty if there are none."""

from __future__ import annotations

from itertools import zip_longest
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import numpy as np
from fmpy.model_description import ModelDescription
from fmpy.validation import validate_fmu

from slide_fmu.core.files import reason_of
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.xml_differences import differences
from slide_fmu.core.zip_directory import open_archive
from slide_fmu.cosim.archive import archive_problems, library_problems, source_problems
from slide_fmu.cosim.bound_check import bound_problems
from slide_fmu.cosim.whole_run import run_fmu
from slide_fmu.fmu.description.fmi2 import guid_of, model_description
from slide_fmu.fmu.description.fmi3 import model_description3
from slide_fmu.fmu.description.surrogate_variables import fmu_variables, memory_lengths
from slide_fmu.fmu.description.variables import (
    ERROR_ESTIMATE,
    IN_RANGE,
    OUTPUTS_IN_RANGE,
    TRUNCATION_ERROR,
    known_inputs,
)
from slide_fmu.fmu.export import DESCRIPTION, SURROGATE, read_fmu, read_member
from slide_fmu.fmu.libraries.platforms import FmiVersion, library_members
from slide_fmu.fmu.libraries.sources import FOLDER, compiled_files
from slide_fmu.importer.description import is_fmi_3
from slide_fmu.importer.errors import CoSimulationError, FmuError
from slide_fmu.importer.file import unpacked
from slide_fmu.network.state_space.cell import in_double
from slide_fmu.network.state_space.equations import ByRole, Equations, outputs
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.surrogate.surrogate import Surrogate

OUTPUT_TOLERANCE = 2e-6
"""Largest deviation of the library from numpy, relative to the output's range: the rounding of
single precision."""

ERROR_TOLERANCE = 1e-4
"""Largest relative deviation of error estimates: the exponential in their map magnifies
rounding."""

WIDE, STEPS_OF_WIDE = 1000.0, 300
"""Factor on the largest rounding, above which a library has another fault; and the number of steps
of random inputs that show it."""

MAGNIFIED = 0.1
"""Part of a deviation which rounding within numpy must come to for the network to be its cause."""

SHOWN = 5
"""Largest number of differences of a document that are named."""

FILLED_TOLERANCE = 1e-12
"""Largest deviation of the filled part of the inputs, which is a quotient of two counts."""


def check_fmu(path: Path, run_unknown: bool = False) -> list[str]:
    """Check that an FMU is complete and consistent, and gives the results of its surrogate.

    Its library for this platform is loaded and run if it is the one of this version of slide-fmu.
    Any other library is unknown code, and runs with ``run_unknown`` only.

    Returns:
        The problems, each one sentence with its remedy where there is one.
    """
    try:
        surrogate, _ = read_fmu(path)
        problems = archive_problems(path) or _unreadable(path)
    except FmuError as error:
        return [str(error)]
    except OSError as error:
        return [reason_of(error)]
    if problems:
        return problems
    try:
        problems += [f"fmpy: {problem}" for problem in validate_fmu(str(path))]
        description = fmpy.read_model_description(str(path))
        fmi = _version(description)
        problems += library_problems(path, surrogate.name, fmi, run_unknown)
        problems += [] if run_unknown else source_problems(path, surrogate.name, fmi)
        problems += _compare_description(path, surrogate, description, fmi)
    except Exception as error:  # fmpy raises bare Exception for invalid XML
        problems.append(f"{DESCRIPTION}: {error}")
    if not problems:
        problems = _compare_run(path, surrogate, fmi)
    return problems


def fmi_version(path: Path) -> FmiVersion:
    """Return the version of the standard of an FMU without problems."""
    return _version(fmpy.read_model_description(str(path)))


def _version(description: ModelDescription) -> FmiVersion:
    return 3 if is_fmi_3(description) else 2


def steps_of_check(surrogate: Surrogate) -> int:
    """Return the number of steps for which the library is compared with numpy."""
    return max(surrogate.window.n_in, *memory_lengths(surrogate).values()) + 10


def runs_here(surrogate: Surrogate, fmi: FmiVersion) -> bool:
    """Tell whether FMUs of a surrogate have a library for this computer."""
    platform = fmpy.platform if fmi == 2 else fmpy.platform_tuple
    return any(f"/{platform}/" in name for name in library_members(surrogate.name, fmi))


def _unreadable(path: Path) -> list[str]:
    """Return the reasons why the model description cannot be read."""
    content = read_member(path, DESCRIPTION)
    if content is None:
        return [f"{DESCRIPTION} is missing; export again"]
    builder = _Builder()
    try:
        root = ElementTree.fromstring(content, ElementTree.XMLParser(target=builder))
    except (ElementTree.ParseError, LookupError, ValueError) as error:
        return [f"{DESCRIPTION} is no XML: {error}; export again"]
    if builder.has_document_type:
        return [
            f"{DESCRIPTION} has a document type, by which importers may read other files; "
            "expected none: export again"
        ]
    if root.tag != "fmiModelDescription" or "fmiVersion" not in root.attrib:
        return [
            f"{DESCRIPTION} begins with <{root.tag}>; expected <fmiModelDescription> with the "
            "attribute fmiVersion, export again"
        ]
    return []


class _Builder(ElementTree.TreeBuilder):
    """The builder notes whether a document has a type (``<!DOCTYPE``)."""

    has_document_type = False

    def doctype(self, name: str, public: str | None, system: str | None) -> None:
        self.has_document_type = True


def _compare_description(
    path: Path, surrogate: Surrogate, description: ModelDescription, fmi: FmiVersion
) -> list[str]:
    problems = []
    guid = guid_of(read_member(path, SURROGATE) or b"")
    given_guid = description.guid if fmi == 2 else description.instantiationToken
    if given_guid != guid:
        problems.append(f"GUID {given_guid}; expected {guid}, derived from {SURROGATE}")
    if description.coSimulation is None:
        return [*problems, "no co-simulation interface; expected one"]
    if description.coSimulation.modelIdentifier != surrogate.name:
        problems.append(
            f"model identifier {description.coSimulation.modelIdentifier!r}; "
            f"expected {surrogate.name!r}"
        )
    problems += _compare_variables(surrogate, description, fmi)
    return problems or _compare_attributes(path, surrogate, fmi)


def _compare_variables(
    surrogate: Surrogate, description: ModelDescription, fmi: FmiVersion
) -> list[str]:
    """Return at most one problem: the first variable that differs, and the number of others."""
    types = {"Real": "Real" if fmi == 2 else "Float64", "Boolean": "Boolean"}
    expected = [
        (v.name, v.reference, types[v.type], v.unit, v.causality)
        for v in fmu_variables(surrogate, fmi)
    ]
    written = [
        (v.name, v.valueReference, v.type, v.unit, v.causality) for v in description.modelVariables
    ]
    pairs = [pair for pair in zip_longest(written, expected) if pair[0] != pair[1]]
    if not pairs:
        return []
    first = f"variable {_described(pairs[0][0])}; expected {_described(pairs[0][1])}"
    return [
        f"{len(pairs)} of {len(expected)} variables are not those of this version of slide-fmu. "
        f"The first: {first}. The FMU was made by another version, or {DESCRIPTION} was edited; "
        "make the FMU again with slide-fmu export OLD.fmu -o NEW.fmu, and connect its variables "
        "by their names"
    ]


def _compare_attributes(path: Path, surrogate: Surrogate, fmi: FmiVersion) -> list[str]:
    """Compare all elements and attributes with those that ``export_fmu`` would write."""
    payload = read_member(path, SURROGATE) or b""
    if fmi == 3:
        written = model_description3(surrogate, guid_of(payload))
    else:
        with open_archive(path) as archive:
            sources = any(name.startswith(f"{FOLDER}/") for name in archive.namelist())
        files = compiled_files() if sources else ()
        written = model_description(surrogate, guid_of(payload), files)
    root = ElementTree.fromstring(read_member(path, DESCRIPTION) or b"")
    others = list(differences(root, ElementTree.fromstring(written)))
    more = [f"{DESCRIPTION}: {len(others) - SHOWN} further differences"] * (len(others) > SHOWN)
    return [
        f"{DESCRIPTION}: {other}: it was edited, or another version of slide-fmu made it; export "
        "again"
        for other in others[:SHOWN]
    ] + more


def _described(variable: tuple[str, int, str, str | None, str] | None) -> str:
    if variable is None:
        return "none"
    name, reference, type_name, unit, causality = variable
    in_unit = "without a unit" if unit is None else f"in {unit}"
    return f"{name!r} with value reference {reference}, {causality}, {type_name} {in_unit}"


def _compare_run(path: Path, surrogate: Surrogate, fmi: FmiVersion) -> list[str]:
    """Run the native library of this platform against numpy, on inputs within their ranges."""
    inputs = random_inputs(surrogate, steps_of_check(surrogate))
    native = _library_run(path, surrogate, fmi, inputs)
    if not isinstance(native, dict):
        return native
    problems = [
        f"{name}: native library and numpy differ by {deviation:.3g}; expected at most "
        f"{allowed:.3g}, export again"
        for name, (deviation, allowed) in _deviations(surrogate, native, inputs).items()
        if not deviation <= allowed
    ]
    return [*problems, *bound_problems(surrogate, native, inputs)]


def wide_differences(path: Path) -> list[str]:
    """Return the outputs in which the library of a new FMU differs widely from numpy.

    Rounding is never that large; the cause may be a mistake in the runtime, or a network that
    magnifies rounding.
    """
    surrogate, _ = read_fmu(path)
    inputs = random_inputs(surrogate, STEPS_OF_WIDE)
    native = _library_run(path, surrogate, 2, inputs)
    if not isinstance(native, dict):
        return native
    wide = {
        name: deviation
        for name, (deviation, allowed) in _deviations(surrogate, native, inputs).items()
        if name in {signal.name for signal in surrogate.outputs}
        and not deviation <= WIDE * allowed
    }
    rounded = _rounding_of(surrogate, inputs) if wide else {}
    return [
        f"{name}: native library and numpy differ by {deviation:.3g} on random inputs"
        + (
            f", since the network magnifies rounding: it moves numpy's own values by "
            f"{rounded[name]:.3g}"
            if rounded.get(name, 0.0) > MAGNIFIED * deviation
            else ""
        )
        for name, deviation in wide.items()
    ]


def _rounding_of(surrogate: Surrogate, inputs: FloatArray) -> dict[str, float]:
    """Return by how much rounding to single precision moves each output of a state-space network.

    Of other networks nothing is known: they are empty.
    """
    network = surrogate.network
    if not isinstance(network, StateSpace):
        return {}
    features = network.features.exactly_along(surrogate.input_scaling.apply(inputs)[None])
    rows = np.moveaxis(features, 1, 0)
    values = []
    for cell, kind in ((network.cell, np.float32), (in_double(network.cell), np.float64)):
        of_roles = ByRole.of(network.roles, rows.astype(kind))
        states = np.zeros((1, len(cell.a)), kind)
        after = Equations(cell, of_roles, network.turned, np).run(states)
        values.append(outputs(cell, after, of_roles)[:, 0].astype(np.float64))
    moved = np.abs(values[0] - values[1]).max(axis=0) * surrogate.output_scaling.scale
    return {signal.name: float(y) for signal, y in zip(surrogate.outputs, moved, strict=True)}


def _library_run(
    path: Path, surrogate: Surrogate, fmi: FmiVersion, inputs: FloatArray
) -> dict[str, FloatArray] | list[str]:
    """Run the native library; or return the reason why not, empty if there is no library."""
    if not runs_here(surrogate, fmi):
        return []
    outputs = [v.name for v in fmu_variables(surrogate) if v.causality == "output"]
    columns = {one.name: row for one, row in zip(surrogate.inputs, inputs.T, strict=True)}
    try:
        with unpacked(path) as fmu:
            known = {known_inputs(fmu.references): 1.0}  # no forecast
            values = run_fmu(fmu, columns, outputs, known, surrogate.window.step).values
    except (CoSimulationError, FmuError, ValueError) as error:
        return [f"the native library failed: {error}"]
    return dict(zip(outputs, values[1:].T, strict=True))


def _deviations(
    surrogate: Surrogate, native: dict[str, FloatArray], inputs: FloatArray
) -> dict[str, tuple[float, float]]:
    """Return the largest deviation of the library, and the largest allowed, by output variable."""
    return {
        name: (float(np.abs(native[name] - values).max()), allowed)
        for name, (values, allowed) in _expected(surrogate, inputs).items()
    }


def _expected(surrogate: Surrogate, inputs: FloatArray) -> dict[str, tuple[FloatArray, float]]:
    """Return numpy's values of every output variable, (steps,), and the allowed deviation.

    Variables of an error bound are compared by ``bound_problems``.
    """
    steps, outputs = np.arange(1, len(inputs) + 1), surrogate.predict_newest(inputs)
    estimates = None if surrogate.estimator is None else surrogate.estimate_error(inputs)
    tables = {
        "{signal}": outputs,
        ERROR_ESTIMATE: estimates,
        TRUNCATION_ERROR: surrogate.truncation_errors(inputs),
    }
    expected = {
        name: (np.minimum(1, steps / count), FILLED_TOLERANCE)
        for name, count in memory_lengths(surrogate).items()
    }
    expected[IN_RANGE] = surrogate.inputs_in_range(inputs).astype(np.float64), 0.0
    if surrogate.output_ranges is not None:
        inside = surrogate.outputs_in_range(outputs)
        expected[OUTPUTS_IN_RANGE] = inside.astype(np.float64), 0.0
    for kind, table in tables.items():
        if table is None:
            continue
        for signal, values, y in zip(surrogate.outputs, table.T, outputs.T, strict=True):
            rounding = OUTPUT_TOLERANCE * max(signal.high - signal.low, np.abs(y).max())
            allowed = ERROR_TOLERANCE * values.max() if kind == ERROR_ESTIMATE else rounding
            expected[kind.format(signal=signal.name)] = values, float(allowed)
    return expected


def random_inputs(surrogate: Surrogate, samples: int) -> FloatArray:
    """Draw inputs within their ranges, shape (samples, n_inputs), in their units."""
    low = np.array([signal.low for signal in surrogate.inputs])
    high = np.array([signal.high for signal in surrogate.inputs])
    return np.random.default_rng(0).uniform(low, high, (samples, len(low)))
