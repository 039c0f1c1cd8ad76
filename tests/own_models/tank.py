"""A tank with a valve as FMU of FMI 3.0 for model exchange, with state and time events."""

from __future__ import annotations

from pathlib import Path

from fmpy.fmi3 import FMU3Model

from tests.own_models.fmi3 import build

THRESHOLD = 0.2


def build_tank(path: Path) -> Path:
    """Compile the tank of ``c/tank_fmi3.c``, and write it as FMU."""
    return build(path, "tank", DESCRIPTION, FMU3Model)


DESCRIPTION = f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="tank" instantiationToken="{{tank}}">
  <ModelExchange modelIdentifier="tank"/>
  <UnitDefinitions><Unit name="m"/><Unit name="m/s"/></UnitDefinitions>
  <TypeDefinitions>
    <Float64Type name="Flow" unit="m/s" min="-1" max="1"/>
  </TypeDefinitions>
  <ModelVariables>
    <Float64 name="inflow" valueReference="0" causality="input" declaredType="Flow" start="0"/>
    <Float64 name="outflow" valueReference="1" causality="output" declaredType="Flow"/>
    <Float64 name="threshold" valueReference="2" causality="parameter" variability="tunable"
        unit="m" start="{THRESHOLD}"/>
    <Float64 name="level" valueReference="3" causality="local" unit="m" min="0" max="2" start="0"/>
    <Float64 name="der(level)" valueReference="4" causality="local" derivative="3"/>
    <Float64 name="excess" valueReference="5" causality="local"/>
    <Boolean name="valve" valueReference="6" causality="output"/>
    <Float64 name="depths" valueReference="7" causality="input" start="0 0">
      <Dimension start="2"/>
    </Float64>
    <Int32 name="mode" valueReference="8" causality="input" start="0"/>
  </ModelVariables>
  <ModelStructure>
    <Output valueReference="1"/>
    <Output valueReference="6"/>
    <ContinuousStateDerivative valueReference="4"/>
    <EventIndicator valueReference="5"/>
  </ModelStructure>
</fmiModelDescription>
"""
