"""Quarter cars as FMUs: one in C, for both interfaces of FMI 2.0, and one in Python.

The equations are those of ``c/quarter_car.h``: a body on a spring with a cubic part and a damper
that resists extension more than compression, and a wheel on a tyre on a road. The slave in Python,
which has the same ones, is that of the tutorials.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import zipfile
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType

import fmpy

from tests.python_fmus import write_python_fmu

HERE = Path(__file__).parent
SLAVE = HERE.parents[1] / "docs" / "tutorials" / "quarter_car_slave.py"
HEADERS = Path(fmpy.__file__).parent / "c-code"
GUID = "{6f1c2a8e-quarter-car}"

_PARAMETERS = (
    ("body_mass", "kg", 300.0),
    ("wheel_mass", "kg", 40.0),
    ("spring", "N/m", 18000.0),
    ("bump_stop", "N/m3", 4.0e6),
    ("damper", "N.s/m", 1800.0),
    ("asymmetry", "1", 0.4),
    ("tyre", "N/m", 180000.0),
)
_OUTPUTS = (
    ("body_acceleration", "m/s2", "acceleration of the body"),
    ("suspension_travel", "m", "body above wheel"),
    ("tyre_deflection", "m", "wheel above road"),
)
_STATES = ("body", "wheel", "body_speed", "wheel_speed")


def build_in_c(
    path: Path,
    *,
    co_simulation: bool = False,
    traps: bool = False,
    crash_above: float = 1e9,
    slopes: bool = False,
) -> Path:
    """Compile the quarter car in C, and write it as FMU of FMI 2.0.

    Args:
        path: the file to write.
        co_simulation: whether it is for co-simulation too, beside model exchange.
        traps: whether it has parameters that say above which height of the road, in m, it fails
            (``fail_above``) and crashes (``crash_above``), refuses steps of less than 1 ms, and
            has a reset that changes nothing.
        crash_above: start value of the parameter of this name, in m.
        slopes: whether it says that it tells directional derivatives.
    """
    source = (HERE / "c" / "quarter_car_fmi2.c").read_text(encoding="utf-8")
    flags = ("-DTRAPS", f"-DCRASH_START={crash_above!r}") if traps else ()
    library = compiled(source, path.with_suffix(".so"), flags)
    text = description(co_simulation, traps)
    if slopes:
        text = text.replace(
            "<ModelExchange ", '<ModelExchange providesDirectionalDerivative="true" '
        )
    return write_fmu(path, text, library, "quarter_car", fmi=2)


def compiled(source: str, library: Path, flags: tuple[str, ...]) -> Path:
    """Compile C code into a library for this platform, with the headers of both standards.

    The compiler of the machine is the faster one; that of the module ``ziglang`` is always there.
    """
    found = shutil.which("cc")
    compiler = [found] if found else [sys.executable, "-m", "ziglang", "cc"]
    places = [f"-I{place}" for place in (HERE / "c", HEADERS)]
    flags = ("-std=c99", "-O2", "-shared", "-fPIC", *flags)
    code = ("-x", "c", "-", "-o", str(library), "-lm")
    subprocess.run([*compiler, *flags, *places, *code], input=source.encode(), check=True)
    return library


def write_fmu(path: Path, description: str, library: Path, identifier: str, fmi: int) -> Path:
    """Write an FMU of a model description and a library, which is removed."""
    platform = fmpy.platform if fmi == 2 else fmpy.platform_tuple
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", description)
        archive.write(library, f"binaries/{platform}/{identifier}{fmpy.sharedLibraryExtension}")
    library.unlink()
    return path


def build_in_python(path: Path) -> Path:
    """Write the quarter car as FMU of PythonFMU: co-simulation of FMI 2.0, in Python."""
    return write_python_fmu("QuarterCar", SLAVE, path)


def equations() -> ModuleType:
    """Import the equations of the slave in Python: functions ``forces`` and ``rates``."""
    spec = spec_from_file_location(SLAVE.stem, SLAVE)
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def description(co_simulation: bool, traps: bool) -> str:
    """Write the model description; value references are those of the C source."""
    parameters = [(10 + i, *parameter) for i, parameter in enumerate(_PARAMETERS)]
    if traps:
        parameters += [(40, "fail_above", "m", 1e9), (41, "crash_above", "m", 1e9)]
    variables = [
        '<ScalarVariable name="road" valueReference="0" causality="input" description="height of '
        'the road"><Real unit="m" min="-0.1" max="0.1" start="0"/></ScalarVariable>',
        *(
            f'<ScalarVariable name="{name}" valueReference="{1 + i}" causality="output" '
            f'description="{text}"><Real unit="{unit}"/></ScalarVariable>'
            for i, (name, unit, text) in enumerate(_OUTPUTS)
        ),
        *(
            f'<ScalarVariable name="{name}" valueReference="{number}" causality="parameter" '
            f'variability="fixed"><Real unit="{unit}" start="{start}"/></ScalarVariable>'
            for number, name, unit, start in parameters
        ),
        *(
            f'<ScalarVariable name="{name}" valueReference="{20 + i}" causality="local">'
            "<Real/></ScalarVariable>"
            for i, name in enumerate(_STATES)
        ),
    ]
    first = len(variables) + 1
    rates = [
        f'<ScalarVariable name="der({name})" valueReference="{30 + i}" causality="local">'
        f'<Real derivative="{first - 4 + i}"/></ScalarVariable>'
        for i, name in enumerate(_STATES)
    ]
    unknowns = "".join(f'<Unknown index="{first + i}"/>' for i in range(4))
    outputs = "".join(f'<Unknown index="{2 + i}"/>' for i in range(3))
    units = sorted({unit for _, _, unit, _ in parameters} | {unit for _, unit, _ in _OUTPUTS})
    slave = (
        '<CoSimulation modelIdentifier="quarter_car" canInterpolateInputs="true" '
        'canHandleVariableCommunicationStepSize="true"/>'
    )
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="quarter_car" guid="{GUID}"
    numberOfEventIndicators="0">
  <ModelExchange modelIdentifier="quarter_car" completedIntegratorStepNotNeeded="true"/>
  {slave if co_simulation else ""}
  <UnitDefinitions>{"".join(f'<Unit name="{unit}"/>' for unit in units)}</UnitDefinitions>
  <DefaultExperiment stepSize="0.005"/>
  <ModelVariables>
    {"    ".join(line + chr(10) for line in [*variables, *rates])}
  </ModelVariables>
  <ModelStructure>
    <Outputs>{outputs}</Outputs>
    <Derivatives>{unknowns}</Derivatives>
    <InitialUnknowns>{outputs}{unknowns}</InitialUnknowns>
  </ModelStructure>
</fmiModelDescription>
"""
