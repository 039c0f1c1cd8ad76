"""Loops close around exudyn models and FMUs, which go on step by step."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray, Signal
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


class Body(Stepping):
    """A mass that a force moves, as a class without states."""

    def __init__(self, step: float, mass: float = 1.0, start: float = 0.0) -> None:
        """Take the step, the mass in kg and the first place in m."""
        self.step, self._mass, self._start = step, mass, start
        self.inputs = (Signal("force", "N", -9e3, 9e3, hold="first_order"),)
        self.outputs = (Signal("place", "m", -1.0, 1.0),)

    def begin(self, held_input: FloatArray) -> None:
        """Begin at rest."""
        self._place, self._speed, self._force = self._start, 0.0, float(held_input[0])

    def output(self) -> FloatArray:
        """Give the place."""
        return np.array([self._place])

    def advance(self, inputs: FloatArray) -> FloatArray:
        """Move under a force that moves along a straight line."""
        before, now, h = self._force, float(inputs[0]), self.step
        self._place += h * self._speed + h**2 / self._mass * (before / 3 + now / 6)
        self._speed += 0.5 * h / self._mass * (before + now)
        self._force = now
        return self.output()


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


@pytest.mark.parametrize("partner", ["upper.fmu", "own body"])
def test_own_body_on_an_fmu_of_a_suspension_has_its_natural_frequency(
    tmp_path: Path, partner: str
) -> None:
    """It begins 1 mm above the rest. Neither the FMU nor the class can be taken back."""
    halves = write_halves(tmp_path)
    named = {
        "upper.fmu": {"partner": str(halves["upper"]), "through": ("force", "position")},
        "own body": {"partner": f"{__name__}:Body"},
    }
    inputs = {
        name: SignalTable(range=(-0.05, 0.05), unit="m", hold="first_order")
        for name in ("road", "body")
    }
    force = {"force": SignalTable(range=(-9e3, 9e3), unit="N")}
    system = load_system(Specification(str(halves["lower"]), {}, STEP, "fmu", inputs, force))
    assert isinstance(system, Stepping)
    loop = LoopRecipe(
        output="force", input="body", weight=1.0, ranges={"mass": (1.0, 999.0)}, **named[partner]
    )
    own = Partner(0.0, 0.0, 0.0, own=(("mass", 600.0), ("start", 1e-3)))
    way = ClosedLoop([(loop, own)], system).inputs(np.zeros((TRIED, 2)))[:, 1]
    true = np.sqrt(1 / (1 / 2e4 + 1 / 2e5) / 600.0) / (2 * np.pi)
    assert way[0] == pytest.approx(1e-3)
    assert frequency_of(way[:250]) == pytest.approx(true, rel=0.1)
    assert np.abs(way[-50:]).max() < 0.1 * np.abs(way).max()


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
