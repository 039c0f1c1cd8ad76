"""Loops close around exudyn models and FMUs, which go on step by step."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from slide_fmu.data.closed_loop import ClosedLoop
from slide_fmu.excitation.loop import LoopRecipe, Partner
from slide_fmu.systems.base import Stepping
from slide_fmu.systems.declared import SignalTable
from slide_fmu.systems.loading import load_system
from slide_fmu.systems.specification import Specification
from tests.data.test_closed_loop import frequency_of
from tests.own_models.halves.cut_car import write_halves

pytestmark = pytest.mark.extended

STEP, TRIED = 0.01, 500


def test_spring_on_an_exudyn_mass_has_the_natural_frequency_of_both(tmp_path: Path) -> None:
    """The template is a mass of 1 kg on a spring of 100 N/m, damped by 2 N.s/m."""
    text = files("slide_fmu.propose").joinpath("templates", "exudyn.py").read_text("utf-8")
    path = tmp_path / "mass.py"
    path.write_text(text, encoding="utf-8")
    wide = {"position": SignalTable(range=(-1.0, 1.0))}
    system = load_system(Specification(str(path), {}, STEP, "exudyn", {}, wide))
    assert isinstance(system, Stepping)
    loop = LoopRecipe(output="position", input="force", weight=1.0, stiffness=(100.0, 900.0))
    outer = np.zeros((TRIED, 1))
    outer[0] = 5.0
    way = ClosedLoop([(loop, Partner(0.0, 500.0, 0.0))], system).inputs(outer)[:, 0]
    true = np.sqrt(600.0 - 1.0) / (2 * np.pi)
    # its force is held over each step at the value of the step's end, half a step early
    assert frequency_of(way[:200]) == pytest.approx(true, rel=0.05)


def test_body_on_an_fmu_of_a_suspension_has_its_natural_frequency(tmp_path: Path) -> None:
    """A spring of 20 kN/m over a tyre of 200 kN/m carries it; the damper lets it come to rest."""
    lower = write_halves(tmp_path)["lower"]
    inputs = {
        name: SignalTable(range=(-0.05, 0.05), unit="m", hold="first_order")
        for name in ("road", "body")
    }
    force = {"force": SignalTable(range=(-9e3, 9e3), unit="N")}
    system = load_system(Specification(str(lower), {}, STEP, "fmu", inputs, force))
    assert isinstance(system, Stepping)
    loop = LoopRecipe(output="force", input="body", weight=1.0, mass=(100.0, 900.0))
    outer = np.zeros((TRIED, 2))
    outer[0, 1] = 1e-3
    way = ClosedLoop([(loop, Partner(600.0, 0.0, 0.0))], system).inputs(outer)[:, 1]
    true = np.sqrt(1 / (1 / 2e4 + 1 / 2e5) / 600.0) / (2 * np.pi)
    assert frequency_of(way[:250]) == pytest.approx(true, rel=0.1)
    assert np.abs(way[-50:]).max() < 0.1 * np.abs(way).max()
