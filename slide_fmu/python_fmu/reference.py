"""Write a reference system as FMU, to run it side by side with its surrogate in any importer."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

from slide_fmu.python_fmu.writer import write_python_fmu
from slide_fmu.systems.base import Parameter
from slide_fmu.systems.loading import load_system

_SCRIPT = '''"""Reference FMU: names its system, which the Python environment must offer."""

from slide_fmu.python_fmu import reference_slave


class {class_name}(reference_slave.SystemSlave):
    MODEL = {model!r}
    PARAMETERS = {parameters!r}
'''


def write_reference_fmu(model: str, parameters: Mapping[str, Parameter], path: Path) -> Path:
    """Write a system as FMI 2.0 co-simulation FMU that runs in a Python environment.

    The FMU holds a small script only; slide_fmu and the system's package are imported from the
    environment of the importer. It starts at rest under its first inputs, or, with the parameter
    ``start_from_state``, from ``initial_coordinates[i]`` and ``initial_velocities[i]`` (and
    ``initial_last_input[i]`` for inputs with a first-order hold).

    Args:
        model: ``"package.module:Class"`` of a ``System``.
        parameters: keyword arguments of the class.
        path: file to write, ending in ``.fmu``.

    Returns:
        The path written.

    Raises:
        LoadError: the system cannot be made from model and parameters.
        ValueError: the path does not end in ``.fmu``.
    """
    load_system(model, parameters)
    class_name = re.sub(r"\W", "_", model.partition(":")[2]) + "Reference"
    script = _SCRIPT.format(class_name=class_name, model=model, parameters=dict(parameters))
    return write_python_fmu(class_name, script, Path(path))
