"""Sample by sample equals one run of exudyn over the whole record."""

from __future__ import annotations

from typing import Any

import exudyn as exu
import numpy as np
import pytest
from exudyn.itemInterface import (
    CoordinateConstraint,
    CoordinateSpringDamper,
    LoadCoordinate,
    MarkerNodeCoordinate,
    Mass1D,
    Node1D,
    NodePointGround,
    SensorNode,
)

from mbs_models.oscillators.oscillators import DuffingOscillator
from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.base import State
from slide_fmu.systems.errors import SimulationError
from slide_fmu.systems.exudyn.plant import Integrator, Plant
from slide_fmu.systems.simulation import simulate
from tests.refusals import refused

SAME = 1e-9
"""Of the RMS: time grows in one run and starts anew in the other, the rest is rounding."""


def one_run(inputs: FloatArray, x: float, v: float, step: float, substeps: int) -> FloatArray:
    """A Duffing oscillator from other items, in one solver run; positions, shape (N + 1,)."""
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    node = mbs.AddNode(
        Node1D(referenceCoordinates=[0.0], initialCoordinates=[x], initialVelocities=[v])
    )
    mbs.AddObject(Mass1D(nodeNumber=node, mass=1.0))
    ground = mbs.AddMarker(
        MarkerNodeCoordinate(nodeNumber=mbs.AddNode(NodePointGround()), coordinate=0)
    )
    mass = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=0))

    def spring(mbs: Any, t: float, item: int, u: float, v: float, *_: float) -> float:
        return 1600.0 * u + 800.0 * u**3 + 8.0 * v

    mbs.AddObject(
        CoordinateSpringDamper(markerNumbers=[ground, mass], springForceUserFunction=spring)
    )
    load = mbs.AddLoad(LoadCoordinate(markerNumber=mass, load=0.0))
    sensor = mbs.AddSensor(
        SensorNode(
            nodeNumber=node,
            storeInternal=True,
            writeToFile=False,
            outputVariableType=exu.OutputVariableType.Coordinates,
        )
    )

    def hold(mbs: Any, t: float) -> bool:
        # exudyn calls this before a step with the time at its end
        mbs.SetLoadParameter(load, "load", inputs[int((t - 1e-9) / step), 0])
        return True

    mbs.SetPreStepUserFunction(hold)
    mbs.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.endTime = len(inputs) * step
    settings.timeIntegration.numberOfSteps = len(inputs) * substeps
    settings.timeIntegration.automaticStepSize = False
    settings.timeIntegration.verboseMode = 0
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = step / substeps
    mbs.SolveDynamic(settings, solverType=exu.DynamicSolverType.RK67)
    stored: FloatArray = mbs.GetSensorStoredData(sensor)
    assert len(stored) == len(inputs) * substeps + 1
    return stored[::substeps, 1]


def test_stepwise_equals_all_at_once() -> None:
    system = DuffingOscillator()
    inputs = np.random.default_rng(3).uniform(-1000, 1000, (100, 1))
    start = State(np.array([0.4]), np.array([-3.0]), np.zeros(1))
    found = simulate(system, inputs, start).outputs[:, 0]
    expected = one_run(inputs, 0.4, -3.0, system.step, 24)
    assert np.max(np.abs(found - expected)) < SAME * np.sqrt(np.mean(expected**2))


STIFFNESS, DAMPING, RATE = 40.0, 0.4, 0.7
INTERRUPTED = 1e-4
"""In m and m/s: the method's own accelerations differ from the computed ones by its error, which
is 1e-2 here."""


class Towed:
    """Two carts of 1 and 3 kg joined by a rod; a moving end of a spring and damper tows them.

    Attributes:
        plant: the carts; the end moves with RATE from 0, in every sample anew.
        times: when the plant asked for the end's place.
    """

    def __init__(self, substeps: int = 8, integrator: Integrator = "generalized_alpha") -> None:
        container = exu.SystemContainer()
        self._mbs = container.AddSystem()
        carts = [self._mbs.AddNode(Node1D(referenceCoordinates=[0.0])) for _ in range(2)]
        for node, mass in zip(carts, (1.0, 3.0), strict=True):
            self._mbs.AddObject(Mass1D(nodeNumber=node, mass=mass))
        ground, first, last = (
            self._mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=0))
            for node in (self._mbs.AddNode(NodePointGround()), *carts)
        )
        self._mbs.AddObject(CoordinateConstraint(markerNumbers=[first, last]))
        spring = CoordinateSpringDamper(
            markerNumbers=[ground, first], stiffness=STIFFNESS, damping=DAMPING
        )
        self._spring = self._mbs.AddObject(spring)
        self._mbs.Assemble()
        self.times: list[float] = []
        self.begin = 0.0
        self.plant = Plant(container, self._mbs, 0.1, substeps, integrator)
        self.plant.before_substep = self._tow

    def _tow(self, time: float) -> None:
        self.times.append(time)
        self._mbs.SetObjectParameter(self._spring, "offset", self.begin + RATE * time)

    def advance(self) -> FloatArray:
        """Position and speed of the carts after one sample step."""
        self.plant.advance()
        self.begin += RATE * 0.1
        return np.array([self.plant.coordinates()[0], self.plant.velocities()[0]])


def towed_motion(count: int) -> FloatArray:
    """Closed form of position and speed from rest, shape (count, 2)."""
    decay, time = DAMPING / 8.0, 0.1 * np.arange(1, count + 1)
    turn = np.sqrt(STIFFNESS / 4.0 - decay**2)
    lag = -RATE * DAMPING / STIFFNESS  # the damper is fixed to the ground
    speed_share = (-RATE - decay * lag) / turn
    swing = np.exp(-decay * time)
    cosine, sine = np.cos(turn * time), np.sin(turn * time)
    position = RATE * time + lag + swing * (-lag * cosine + speed_share * sine)
    speed = RATE + swing * (
        -decay * (-lag * cosine + speed_share * sine) + turn * (lag * sine + speed_share * cosine)
    )
    return np.stack([position, speed], axis=1)


@pytest.mark.parametrize("integrator", ["trapezoidal", "generalized_alpha"])
def test_implicit_steps_have_second_order(integrator: Integrator) -> None:
    def error(substeps: int) -> float:
        towed = Towed(substeps, integrator)
        found = np.array([towed.advance() for _ in range(40)])
        return float(np.max(np.abs(found - towed_motion(40))))

    assert error(32) < 1e-3
    assert 3.6 < error(16) / error(32) < 4.4


def test_every_sample_step_begins_at_the_time_zero() -> None:
    towed = Towed()
    towed.advance()
    assert towed.times == pytest.approx([0.0, *(0.0125 * np.arange(1, 9))])
    towed.times.clear()
    for _ in range(2000):
        towed.advance()
    steps = np.reshape(towed.times, (2000, 8))
    assert np.array_equal(steps, np.tile(steps[0], (2000, 1)))
    assert steps[0, -1] == pytest.approx(0.1, abs=1e-15)


def test_implicit_motions_repeat_and_go_on_after_set_state() -> None:
    one, same, other = Towed(), Towed(), Towed()
    whole = np.array([one.advance() for _ in range(30)])
    assert np.array_equal([same.advance() for _ in range(30)], whole)
    for expected in whole:
        other.plant.set_state(other.plant.coordinates(), other.plant.velocities())
        assert other.advance() == pytest.approx(expected, abs=INTERRUPTED)
    other.plant.set_state(np.zeros(2), np.zeros(2))
    other.begin = 0.0
    assert np.array_equal([other.advance() for _ in range(30)], whole)


def test_implicit_linearization_has_constraints_and_leaves_the_motion() -> None:
    towed, same = Towed(), Towed()
    for towing in range(10):
        found = towed.plant.linearize(np.ones(2), np.ones(2))
        assert np.array_equal(towed.advance(), same.advance()), towing
    assert found.mass == pytest.approx(np.diag([1.0, 3.0]))
    assert found.stiffness == pytest.approx(np.diag([STIFFNESS, 0.0]), abs=1e-6)
    assert found.damping == pytest.approx(np.diag([DAMPING, 0.0]), abs=1e-6)
    assert np.abs(found.constraints) == pytest.approx(np.array([[1.0, 1.0]]))
    assert found.constraints.sum() == pytest.approx(0.0)


def test_an_implicit_failure_leaves_the_state() -> None:
    towed = Towed()
    towed.advance()
    kept = towed.plant.coordinates(), towed.plant.velocities()
    begin, towed.begin = towed.begin, float("nan")
    with refused(SimulationError, "substeps"):
        towed.plant.advance()
    assert np.array_equal((towed.plant.coordinates(), towed.plant.velocities()), kept)
    towed.begin = begin
    assert towed.advance() == pytest.approx(towed_motion(2)[1], abs=3e-3)
