"""An FMU and its reference system form one SSP, both with the same unseen inputs."""

from __future__ import annotations

import tempfile
from collections.abc import Collection, Mapping
from pathlib import Path

import numpy as np

from slide_fmu.apps.reference.input_source import write_input_source
from slide_fmu.apps.reference.reference_slave import write_reference_fmu
from slide_fmu.core.files import write_whole
from slide_fmu.core.search_path import make_models_importable
from slide_fmu.core.signals import FloatArray, cosines_of
from slide_fmu.cosim.ssp import Connection, write_system
from slide_fmu.data.draws import TEST, Draw, Stream, draw
from slide_fmu.fmu.description.variables import HELD
from slide_fmu.fmu.export import Provenance, export_fmu, read_fmu
from slide_fmu.fmu.libraries.platforms import FmiVersion
from slide_fmu.importer.description import read_description
from slide_fmu.pipeline.run_folder import recipe_of_provenance
from slide_fmu.recipe.case import Case, case_of
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import System
from slide_fmu.systems.errors import LoadError
from slide_fmu.systems.fmu.model import FmuSystem
from slide_fmu.validation.task import Task

FMI_3 = (
    "the surrogate is an FMU of FMI 3.0, which SSP 1.0 does not know: Ecos runs it, libcosim and "
    "FMPy's SSP simulator do not; for them export it with --fmi 2"
)
"""Remark on a system with a surrogate of FMI 3.0."""

OWN_FMU = (
    "the reference is your own FMU, whose parameters are set by the SSV file in the SSP: libcosim "
    "reads it, Ecos if its set 'parameters' is selected, FMPy does not"
)
"""Remark on a system whose reference has other start values than the surrogate."""

TOLD_TO_HOLD = (
    "the inputs are held over each step, which the SSV file in the SSP tells the surrogate "
    "(inputs_held = 1): libcosim reads it, Ecos if its set 'parameters' is selected, FMPy does not"
)
"""Remark on a system whose surrogate may go on from inputs that are held."""


def write_reference(case: Case, path: Path) -> Path:
    """Write the reference system of a recipe as FMU, and return its path.

    Physical parameters of the recipe are parameters of the FMU. A user's own FMU is copied.

    Raises:
        LoadError: the system cannot be made, or is an FMU that does not run by itself.
        RecipeError: it does not fit the system that makes the data.
        ValueError: the path does not end in ``.fmu``.
    """
    own = own_fmu(case.reference, case.recipe.parameters)
    if own is None:
        made = case.systems.reference_specification
        return write_reference_fmu(made, path, case.recipe.physical())
    if path.suffix != ".fmu":
        raise ValueError(f"FMU {str(path)!r}; expected a name ending in .fmu")
    write_whole(path, own.read_bytes())
    return path


def write_side_by_side(
    fmu: Path,
    path: Path,
    seed: int,
    duration: float | None,
    parameters: Mapping[str, float] | None = None,
    units: Mapping[str, str] | None = None,
) -> tuple[Path, str | None]:
    """Write an FMU and its reference system, driven by the same unseen inputs, as SSP.

    Its components are ``inputs``, ``reference`` and ``surrogate``. The inputs are those of the
    first trajectory of ``validate`` with this seed, with its burn-in as lead-in; both other
    components take them as values at the end of each step. The duration in s, without the lead-in,
    is the recipe's if None. Values of physical parameters, by name, are start values of both,
    since some importers read no SSV files; they are also in such files, where they can be changed.
    Such a file also tells an FMU of held inputs that they are held.
    Units that a file names for some of them must be those of the FMU.

    Returns:
        The path, and which importers do not run the SSP although they run others, if any.

    Raises:
        FmuError: the file is not an FMU of slide-fmu, or damaged.
        LoadError: the reference system cannot be made.
        ValueError: the path does not end in ``.ssp``, the duration is not positive, or a parameter
            is not one of the FMU's, or has another unit, or its value lies outside its range.
    """
    task = Task(seed, duration=duration)
    surrogate, provenance = read_fmu(fmu)
    surrogate = surrogate.starting_at(parameters or {})
    for parameter in surrogate.parameters:
        if (unit := (units or {}).get(parameter.name, parameter.unit)) != parameter.unit:
            raise ValueError(
                f"parameter {parameter.name!r} has the unit {unit!r}; expected "
                f"{parameter.unit!r}, as in {fmu}: convert the value"
            )
    values = {parameter.name: parameter.start_value for parameter in surrogate.parameters}
    make_models_importable(fmu)
    recipe = starting_at(recipe_of_provenance(provenance, str(fmu)), values)
    case = case_of(recipe)
    fmi = read_description(fmu).fmiVersion
    stream = Stream(TEST, task.seed, task.amplitude, task.duration_of(recipe))
    inputs = led_in(surrogate, draw(recipe, case.reference, stream, 0))
    with tempfile.TemporaryDirectory() as folder:
        reference = write_reference(case, Path(folder) / "reference.fmu")
        source = Path(folder) / "inputs.fmu"
        write_input_source(surrogate.inputs, surrogate.window.step, inputs, source)
        # no connectors of the system itself: some importers reject them
        connections = [
            Connection(("inputs", signal.name), (component, signal.name))
            for component in ("reference", "surrogate")
            for signal in surrogate.inputs
        ]
        alike = as_the_reference(fmu, surrogate, provenance, Path(folder) / "surrogate.fmu")
        components = {"inputs": source, "reference": reference, "surrogate": alike}
        held = {HELD: 1.0} if surrogate.hold == "zero_order" else {}
        given = {"reference": values, "surrogate": {**values, **held}}
        given = {name: some for name, some in given.items() if some}
        write_system(path, surrogate.name, components, connections, given)
    own = bool(values) and own_fmu(case.reference, values) is not None
    known = ((FMI_3, fmi.startswith("3.")), (OWN_FMU, own), (TOLD_TO_HOLD, bool(held)))
    remarks = [text for text, holds in known if holds]
    return path, "; ".join(remarks) or None


def own_fmu(system: System, settable: Collection[str] = ()) -> Path | None:
    """Return the FMU that a system is, where it is one that runs by itself as it does here.

    SSP 1.0 knows co-simulation FMUs of FMI 2.0 alone.

    Args:
        system: the reference system.
        settable: parameters that an importer sets; all others have their start values.

    Raises:
        LoadError: it is one, but does not run so: it is of another interface, or it has other
            parameters here than its start values.
    """
    if not isinstance(system, FmuSystem):
        return None
    file, parameters = system.plan.file, sorted(set(system.plan.parameters) - set(settable))
    if file.interface == "co_simulation" and not file.fmi_3 and not parameters:
        return file.path
    raise LoadError(
        f"FMU {file.path.name!r} of FMI {file.description.fmiVersion}, used for "
        f"{file.interface}, with parameters {parameters}; expected a co-simulation FMU of FMI "
        "2.0 without parameters, to run as reference beside a surrogate: export the model so, "
        "with its parameters as start values"
    )


def starting_at(recipe: Recipe, values: Mapping[str, float]) -> Recipe:
    """Return a recipe whose physical parameters start at values in their ranges, by name."""
    tables = {
        name: table.model_copy(update={"start": values[name]})
        for name, table in recipe.parameters.items()
    }
    return recipe.model_copy(update={"parameters": tables})


def as_the_reference(
    fmu: Path, surrogate: Surrogate, provenance: Provenance | None, path: Path
) -> Path:
    """Return an FMU that takes its inputs as the reference FMU does, and starts as the surrogate.

    A reference moves to the values that are set before a step, so both respond with the same
    delay. An FMU with moving inputs would forecast them instead. So it is written again, with its
    provenance, and starts with ``inputs_at_step_end`` = 1. An FMU with parameters is also written
    again, since it may start at other values.
    """
    if surrogate.hold == "zero_order" and not surrogate.parameters:
        return fmu
    surrogate = surrogate.reaching_inputs_by_step_end()
    fmi: FmiVersion = 3 if read_description(fmu).fmiVersion.startswith("3.") else 2
    return export_fmu(surrogate, path, fmi=fmi, provenance=provenance)


def led_in(surrogate: Surrogate, drawn: Draw) -> FloatArray:
    """Return the inputs of a draw, changed so that they leave the start values without a jump.

    Some importers step all FMUs once before they pass any values on, so that the first step gets
    start values, or zeros. If the second step had far other values, a prescribed motion would
    begin with a shock that is not in the training data. So the deviation from the start values
    grows smoothly over the burn-in. The cosine and sine of an angle stay as they were drawn: zero
    is not a direction, so there is no smooth way from there. The shape is (burn_in + N, n_inputs),
    in the units of the inputs.
    """
    passed = np.minimum(np.arange(len(drawn.inputs)) / max(1, drawn.burn_in), 1.0)[:, None]
    part = passed**3 * (10 - 15 * passed + 6 * passed**2)  # smooth at both ends, twice
    inputs = np.asarray(surrogate.starts + part * (drawn.inputs - surrogate.starts))
    turning = [index + i for index in cosines_of(surrogate.inputs) for i in (0, 1)]
    inputs[:, turning] = drawn.inputs[:, turning]
    return inputs
