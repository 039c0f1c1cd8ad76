"""The second FMU of the loops: a controller, compiled from ``c/controller.c``."""

from __future__ import annotations

import math
from pathlib import Path

from slide_fmu.fmu.libraries.build import WARNINGS
from tests.own_models.quarter_car import compiled, write_fmu

SOURCE = Path(__file__).parent / "c" / "controller.c"
GAIN, AMPLITUDE, FREQUENCY, BEGIN = 150.0, 2.0, 2.0, 0.3
"""As in the C source: N/m, m, rad/s, s."""

DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="controller" guid="controller">
  <CoSimulation modelIdentifier="controller" canHandleVariableCommunicationStepSize="true"/>
  <ModelVariables>
    <ScalarVariable name="position" valueReference="0" causality="input">
      <Real start="0"/>
    </ScalarVariable>
    <ScalarVariable name="force" valueReference="1" causality="output"><Real/></ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Outputs><Unknown index="2" dependencies="1"/></Outputs>
    <InitialUnknowns><Unknown index="2" dependencies="1"/></InitialUnknowns>
  </ModelStructure>
</fmiModelDescription>
"""


def force_at(time: float, position: float) -> float:
    """What the controller gives out, in N."""
    target = 0.0 if time < BEGIN else AMPLITUDE * math.sin(FREQUENCY * (time - BEGIN))
    return GAIN * (target - position)


def build_controller(folder: Path) -> Path:
    """Compile and pack the controller for this platform."""
    source, library = SOURCE.read_text(encoding="utf-8"), folder / "controller.so"
    compiled(source, library, tuple(WARNINGS))
    return write_fmu(folder / "controller.fmu", DESCRIPTION, library, "controller", fmi=2)
