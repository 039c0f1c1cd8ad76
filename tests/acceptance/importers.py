"""Real importers on one system: each gives what it read of the outputs along the run.

All of them step the components in parallel and exchange values afterwards (Jacobi).
"""

from __future__ import annotations

import ctypes
import importlib.util
import json
import subprocess
import sys
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import numpy as np
import pytest
from fmpy.ssp.simulation import simulate_ssp

from slide_fmu.core.signals import FloatArray

Outputs = list[tuple[str, str]]
"""Components and their outputs."""


def needs(module: str) -> pytest.MarkDecorator:
    """Skip where an importer is missing."""
    missing = importlib.util.find_spec(module) is None
    return pytest.mark.skipif(missing, reason=f"{module} is not installed")


def booleans(ssp: Path) -> set[tuple[str, str]]:
    """Components and their connectors of type Boolean, which some importers read otherwise."""
    with zipfile.ZipFile(ssp) as archive:
        root = ElementTree.fromstring(archive.read("SystemStructure.ssd"))
    return {
        (component.attrib["name"], connector.attrib["name"])
        for component in root.iterfind(".//{*}Component")
        for connector in component.iterfind(".//{*}Connector")
        if connector.find("{*}Boolean") is not None
    }


def run_fmpy(ssp: Path, outputs: Outputs, step: float, steps: int) -> FloatArray:
    """Outputs at the ends of the steps, shape (steps, n_outputs); all connectors start at 0."""
    result = simulate_ssp(str(ssp), stop_time=(steps - 0.5) * step, step_size=step)
    return np.stack([result[".".join(output)] for output in outputs], axis=1)


def run_libcosim(ssp: Path, outputs: Outputs, step: float, steps: int) -> FloatArray:
    """The same with libcosim, whose time counts nanoseconds."""
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimObserver import CosimObserver

    log_output_level(CosimLogLevel.WARNING)
    execution = CosimExecution.from_ssp_file(str(ssp), round(1e9 * step))
    observer = CosimObserver.create_last_value()
    execution.add_observer(observer)
    places = []
    read = {True: observer.last_boolean_values, False: observer.last_real_values}
    boolean = booleans(ssp)
    for component, name in outputs:
        index = execution.slave_index_from_instance_name(component)
        variables = execution.slave_variables(index)
        (reference,) = [v.reference for v in variables if v.name.decode() == name]
        places.append((read[(component, name) in boolean], index, reference))
    rows = []
    for _ in range(steps):
        assert execution.step(), "a step failed"
        rows.append([get(index, [reference])[0] for get, index, reference in places])
    return np.array(rows, dtype=np.float64)


def run_ecos(
    ssp: Path, outputs: Outputs, step: float, steps: int, parameter_set: str | None = None
) -> FloatArray:
    """The same with Ecos."""
    # its library finds TBB, a package of its own, when it is loaded already
    ctypes.CDLL(str(Path(sys.prefix) / "lib" / "libtbb.so.12"), mode=ctypes.RTLD_GLOBAL)
    from ecospy import EcosSimulation

    rows, boolean = [], booleans(ssp)
    with EcosSimulation(ssp_path=str(ssp), step_size=step) as simulation:
        simulation.init(parameter_set=parameter_set)
        for _ in range(steps):
            simulation.step(1)
            row = []
            for output in outputs:
                get = simulation.get_bool if output in boolean else simulation.get_real
                row.append(get("::".join(output)))
            rows.append(row)
        simulation.terminate()
    return np.array(rows, dtype=np.float64)


def write_container(
    folder: Path, links: list[tuple[str, str, str, str]], output: tuple[str, str], step: float
) -> Path:
    """Pack FMUs of a folder into one with ``fmucontainer``.

    Args:
        folder: holds the FMUs; the container goes there too.
        links: FMU and its output, FMU and its input.
        output: FMU and the output that the container gives.
        step: its step in s.
    """
    description = {
        "name": "container.fmu",
        "fmu": sorted({name for link in links for name in link[::2]}),
        "link": [list(link) for link in links],
        "output": [[*output, output[1]]],
        "step_size": step,
    }
    (folder / "container.json").write_text(json.dumps(description), encoding="utf-8")
    program = Path(sys.executable).with_name("fmucontainer")
    command = [program, "-container", "container.json", "-fmu-directory", "."]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder / "container.fmu"


def run_container(fmu: Path, output: str, step: float, steps: int) -> FloatArray:
    """An output of a container at the ends of its steps, shape (steps, 1)."""
    result = fmpy.simulate_fmu(
        str(fmu), stop_time=steps * step, output_interval=step, output=[output]
    )
    return np.asarray(result[output][1:, None])
