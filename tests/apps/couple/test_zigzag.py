"""A run whose values go to and fro from step to step says so, with the remedy."""

from __future__ import annotations

from pathlib import Path

import pytest

import slide_fmu as slide
from slide_fmu.apps.couple.result import CoupledRun
from slide_fmu.apps.reference.reference_slave import write_reference_fmu
from slide_fmu.core.signals import Hold
from slide_fmu.importer.errors import CoSimulationError
from slide_fmu.systems.declared import SignalTable
from slide_fmu.systems.specification import Specification
from tests.refusals import refused

STEP = 0.01
DAMPER = """
inputs = {"place": {"unit": "m", "range": [-1.0, 1.0]}}
outputs = {"force": {"unit": "N", "range": [-1e3, 1e3]}}
hold = "first_order"
start = [0.0]


def f(x, u, p, du):
    return [-x[0]]


def g(x, u, p, du):
    return [-100.0 * u[0] - 200.0 * du[0]]
"""
MASS = """
inputs = {"force": {"unit": "N", "range": [-1e3, 1e3]}}
outputs = {"place": {"unit": "m", "range": [-1.0, 1.0]}}
hold = "first_order"
start = [0.1, 0.0]


def f(x, u, p):
    return [x[1], u[0] / 0.2]  # a step is ten times the time in which the damper stops it


def g(x, u, p):
    return [x[0]]
"""


def ride(folder: Path, hold: Hold, stop: float) -> CoupledRun:
    """Couple a light mass and a damper, whose force moves or is held over each step."""
    fmus = {}
    for name, text in {"damper": DAMPER, "mass": MASS}.items():
        path = folder / f"{name}.py"
        path.write_text(text, encoding="utf-8")
        inputs = {"force": SignalTable(hold=hold)} if name == "mass" else {}
        made = Specification(str(path), {}, STEP, "function", inputs)
        fmus[name] = write_reference_fmu(made, folder / f"{name}.fmu")
    links = [("damper.force", "mass.force"), ("mass.place", "damper.place")]
    found: CoupledRun = slide.couple(fmus, links, step=STEP, stop=stop)
    taken = "reached" if hold == "first_order" else "held"  # as the models declare it
    assert found.figures.inputs == {"damper": "reached", "mass": taken}
    return found


@pytest.mark.extended
def test_force_of_a_damper_that_zigzags_is_named_with_the_remedy(tmp_path: Path) -> None:
    run = ride(tmp_path, "first_order", 0.15)
    (remark,) = [one for one in run.figures.remarks if "zigzag" in one]
    assert remark.startswith("a zigzag: damper.place and mass.force went to and fro from step")
    assert 'hold = "zero_order"' in remark
    with refused(CoSimulationError, "a zigzag: damper.place", "shorter steps"):
        ride(tmp_path, "first_order", 50.0)


def test_held_force_does_not_zigzag(tmp_path: Path) -> None:
    run = ride(tmp_path, "zero_order", 0.5)
    assert not [remark for remark in run.figures.remarks if "zigzag" in remark]
    assert 0.0 < run["mass.place"][-1] < 0.1
