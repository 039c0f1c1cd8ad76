"""A model of exudyn for tests, as text to be changed, and the systems that such files make."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.declared import SignalTable
from slide_fmu.systems.exudyn.model import describe
from slide_fmu.systems.loading import load_system
from slide_fmu.systems.specification import Specification

STEP = 0.01

OSCILLATOR = """
import exudyn as exu
import exudyn.itemInterface as item

inputs = {"force": "N"}
outputs = {"position": "m", "acceleration": "m/s^2"}
parameters = {"mass": 2.0, "stiffness": 50.0, "damping": 3.0}
OF = exu.OutputVariableType


def build(mbs, p):
    ground = mbs.AddNode(item.NodePointGround())
    node = mbs.AddNode(item.Node1D(referenceCoordinates=[0.0]))
    mbs.AddObject(item.Mass1D(nodeNumber=node, mass=p.mass))
    ends = [item.MarkerNodeCoordinate(nodeNumber=n, coordinate=0) for n in (ground, node)]
    wall, mark = (mbs.AddMarker(end) for end in ends)
    spring = item.CoordinateSpringDamper("spring", [wall, mark], p.stiffness, p.damping)
    mbs.AddObject(spring)
    mbs.AddLoad(item.LoadCoordinate("force", mark))
    mbs.AddSensor(item.SensorNode("position", node, outputVariableType=OF.Coordinates))
    mbs.AddSensor(item.SensorNode("acceleration", node, outputVariableType=OF.Coordinates_tt))
"""
"""m x'' + d x' + k x = F."""
LOAD = 'mbs.AddLoad(item.LoadCoordinate("force", mark))'
SPRING = 'item.CoordinateSpringDamper("spring", [wall, mark], p.stiffness, p.damping)'


def model(folder: Path, text: str, *changes: tuple[str, str], name: str = "model.py") -> str:
    """Write a model file and return what a recipe calls it; every change replaces a text."""
    for before, after in changes:
        assert before in text
        text = text.replace(before, after)
    (folder / name).write_text(text)
    return str(folder / name)


def specification(path: str, hold: Any = None, **parameters: Any) -> Specification:
    """All signals of a model, each in a range that plays no part."""
    found = describe(path)
    inputs, outputs = (
        {n: SignalTable(range=(-100.0, 100.0), hold=h).over(table) for n, table in tables.items()}
        for tables, h in ((found.inputs, hold), (found.outputs, None))
    )
    return Specification(path, parameters, STEP, "exudyn", inputs, outputs)


def system_of(path: str, hold: Any = None, **parameters: Any) -> Any:
    return load_system(specification(path, hold, **parameters))


def noise(count: int, seed: int = 0, size: float = 1.0) -> FloatArray:
    return size * np.random.default_rng(seed).uniform(-1, 1, (count, 1))
