"""A lag as FMU of FMI 3.0 for co-simulation, whose signals are of both types of real numbers."""

from __future__ import annotations

from pathlib import Path

from fmpy.fmi3 import FMU3Slave

from tests.own_models.fmi3 import build


def build_lag(path: Path) -> Path:
    """Compile the lag of ``c/lag_fmi3.c``, and write it as FMU."""
    return build(path, "lag", DESCRIPTION, FMU3Slave)


DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="lag" instantiationToken="{lag}">
  <CoSimulation modelIdentifier="lag" canHandleVariableCommunicationStepSize="true"/>
  <UnitDefinitions><Unit name="m"/><Unit name="s"/></UnitDefinitions>
  <ModelVariables>
    <Float32 name="drive" valueReference="0" causality="input" unit="m" min="-1" max="1"
        start="0"/>
    <Float32 name="level" valueReference="1" causality="output" unit="m" min="-1" max="1"/>
    <Float64 name="excess" valueReference="2" causality="output" unit="m" min="-2" max="2"/>
    <Float32 name="lag" valueReference="3" causality="parameter" variability="fixed" unit="s"
        start="0.5"/>
  </ModelVariables>
  <ModelStructure>
    <Output valueReference="1"/>
    <Output valueReference="2"/>
  </ModelStructure>
</fmiModelDescription>
"""
