"""FMUs of the user simulate what their equations say, by either interface and standard."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.export import export_fmu, read_fmu
from slide_fmu.systems.base import Linearizable, State, StateMatrix, Stepping, System
from slide_fmu.systems.declared import SignalTable
from slide_fmu.systems.errors import SimulationError
from slide_fmu.systems.loading import load_system
from slide_fmu.systems.simulation import simulate
from slide_fmu.systems.specification import Specification
from tests.own_models import quarter_car
from tests.own_models.tank import THRESHOLD
from tests.refusals import refused
from tests.systems.test_fmu_refusals import changed

equations = quarter_car.equations()

STEP = 0.005
ROAD = {"road": SignalTable(unit="m", range=(-0.1, 0.1))}
OUTPUTS = {
    name: SignalTable(range=(-10.0, 10.0))
    for name in ("body_acceleration", "suspension_travel", "tyre_deflection")
}
EXCHANGED = {"fmu-interface": "model_exchange"}


def made(fmu: str, hold: Any = "first_order", step: float = STEP, **parameters: Any) -> System:
    inputs = {"road": SignalTable(unit="m", range=(-0.1, 0.1), hold=hold)}
    return load_system(Specification(fmu, parameters, step, "fmu", inputs, OUTPUTS))


def road(count: int = 160) -> FloatArray:
    time = STEP * np.arange(count)
    return (0.02 * np.sin(7 * time + 0.3) + 0.01 * np.sin(31 * time))[:, None]


def true_car(inputs: FloatArray, ramped: bool) -> FloatArray:
    """Integrate the equations of the quarter car with scipy; outputs as of the FMU."""
    before, x = inputs[0, 0], np.array([inputs[0, 0], inputs[0, 0], 0.0, 0.0])
    rows = [(x, before)]
    for now in inputs[:, 0]:
        begin = before if ramped else now
        found = solve_ivp(
            lambda t, x, a, b: equations.rates(x, a + t / STEP * (b - a)),
            (0, STEP), x, rtol=1e-10, atol=1e-12, args=(begin, now),
        )  # fmt: skip
        x, before = found.y[:, -1], now
        rows.append((x, now))
    return np.array(
        [(-equations.forces(x, u)[0] / equations.BODY, x[0] - x[1], x[1] - u) for x, u in rows]
    )


def relative_error(found: FloatArray, true: FloatArray) -> float:
    return float(np.max(np.sqrt(np.mean((found - true) ** 2, axis=0) / np.mean(true**2, axis=0))))


@pytest.mark.parametrize("hold", ["zero_order", "first_order"])
@pytest.mark.parametrize("parameters", [{}, EXCHANGED], ids=["co_simulation", "model_exchange"])
def test_a_car_in_c_moves_as_its_equations_say(
    car: str, hold: str, parameters: dict[str, Any]
) -> None:
    found = simulate(made(car, hold, **parameters), road()).outputs
    assert relative_error(found, true_car(road(), hold == "first_order")) < 1e-5


def test_fmpys_euler_solver_comes_near_with_many_substeps(car: str) -> None:
    options = {**EXCHANGED, "fmu-solver": "Euler", "fmu-substeps": 50}
    found = simulate(made(car, **options), road()).outputs
    assert 1e-4 < relative_error(found, true_car(road(), True)) < 0.02


def test_a_slave_without_interpolation_follows_a_moving_input_in_stairs(python_car: str) -> None:
    true = true_car(road(), True)[:, :2]  # tyre deflection is computed in steps: half a stair late
    errors = {
        count: relative_error(
            simulate(made(python_car, **{"fmu-substeps": count}), road()).outputs[:, :2], true
        )
        for count in (1, 10)
    }
    assert errors[10] < 2e-4
    assert 20 < errors[1] / errors[10] < 200  # the error falls with the square of the stairs


OWN = 0.001


def run_by_steps(fmu: str, held: bool) -> FloatArray:
    """Run an FMU by fmpy alone, by steps of ``OWN`` s; two outputs, at the samples."""
    time = OWN * np.arange(5 * 160 + 1)
    known = np.append(road()[:1], road())
    inputs = np.interp(time, STEP * np.arange(161), known)
    if held:  # what acts in a step is set before it
        inputs = np.append(np.repeat(road(), 5), road()[-1])
    table = np.array(list(zip(time, inputs, strict=True)), [("time", float), ("road", float)])
    found = fmpy.simulate_fmu(
        fmu, fmi_type="CoSimulation", stop_time=time[-1], output_interval=OWN, input=table
    )
    return np.stack([found[name] for name in list(OUTPUTS)[:2]], axis=1)[::5]


@pytest.mark.parametrize("kind", ["python_car", "car"])
@pytest.mark.parametrize("hold", ["first_order", "zero_order"])
def test_a_slave_whose_step_is_named_moves_as_fmpy_runs_it(
    request: pytest.FixtureRequest, kind: str, hold: str
) -> None:
    """Each stair has the value with which it begins, also of an FMU that can interpolate."""
    fmu = request.getfixturevalue(kind)
    system = made(fmu, hold, **{"fmu-step": OWN})
    found = simulate(system, road()).outputs[:, :2]
    assert relative_error(found[:, 1:], run_by_steps(fmu, hold == "zero_order")[:, 1:]) < 1e-9


def test_a_slave_whose_step_is_named_is_late_by_half_of_it(python_car: str) -> None:
    smooth = simulate(made(python_car), road()).outputs[:, :2]
    assert relative_error(smooth, run_by_steps(python_car, held=False)) > 1e-2


def test_a_slave_holds_its_input_unless_told_otherwise(python_car: str) -> None:
    system = load_system(Specification(python_car, {}, STEP, "fmu", ROAD, OUTPUTS))
    assert system.inputs[0].hold == "zero_order"
    found = simulate(system, road()).outputs
    assert relative_error(found, true_car(road(), False)) < 1e-5


def true_level(inflow: FloatArray, step: float, threshold: float) -> FloatArray:
    """Integrate the level of the tank in fine steps; the input is held."""
    level, levels, parts = 0.0, [0.0], 400
    for k, value in enumerate(inflow[:, 0]):
        for part in range(parts):
            pump = 2.0 if (k + (part + 0.5) / parts) * step >= 0.5 else 1.0
            half = level
            for length in (0.5, 1.0):  # the midpoint rule
                rate = pump * value - half - (4 * (half - threshold) if half >= threshold else 0)
                half = level + length * step / parts * rate
            level = half
        levels.append(level)
    return np.array(levels)


@pytest.mark.parametrize("threshold", [THRESHOLD, 0.3])
def test_state_and_time_events_of_fmi_3_are_handled(tank: str, threshold: float) -> None:
    inputs = {"inflow": SignalTable(hold="zero_order")}
    outputs = {"level": SignalTable(), "outflow": SignalTable()}
    parameters = {} if threshold == THRESHOLD else {"threshold": threshold}
    system = load_system(Specification(tank, parameters, 0.02, "fmu", inputs, outputs))
    inflow = (0.4 + 0.4 * np.sin(0.3 * np.arange(80)))[:, None]
    found = simulate(system, inflow).outputs
    true = true_level(inflow, 0.02, threshold)
    assert np.max(true) > threshold + 0.03 > np.min(true) + 0.03
    np.testing.assert_allclose(found[:, 0], true, rtol=0, atol=2e-6)
    np.testing.assert_allclose(
        found[:, 1], true + 4 * np.maximum(true - threshold, 0), rtol=0, atol=1e-5
    )
    assert isinstance(system, Stepping)
    assert not isinstance(system, Linearizable)  # the valve is a state that no one sees


def true_lag(drive: FloatArray, step: float, lag: float, ramped: bool) -> FloatArray:
    """Give level and excess of a lag by its closed solution."""
    before, level, kept = drive[0], drive[0], np.exp(-step / lag)
    rows = [(level, 0.0)]
    for now in drive:
        slope = (now - before) / step if ramped else 0.0
        begin = before if ramped else now
        level = now - slope * lag + kept * (level - begin + slope * lag)
        rows.append((level, now - level))
        before = now
    return np.array(rows)


@pytest.mark.parametrize("hold", ["zero_order", "first_order"])
def test_a_slave_of_fmi_3_with_single_precision_follows_its_input(lag: str, hold: Any) -> None:
    drive = 0.5 * np.sin(0.3 * np.arange(60) + 0.2)
    errors = {}
    for count in (1, 10, 100):
        system = load_system(
            Specification(
                lag,
                {"lag": 0.1, "fmu-substeps": count},
                0.05,
                "fmu",
                {"drive": SignalTable(hold=hold)},
                {"level": SignalTable(), "excess": SignalTable()},
            )
        )
        found = simulate(system, drive[:, None]).outputs
        true = true_lag(drive, 0.05, 0.1, hold == "first_order")
        errors[count] = relative_error(found, true)
    if hold == "zero_order":
        assert max(errors.values()) < 2e-7  # that of single precision
        return
    assert 50 < errors[1] / errors[10] < 200  # the error falls with the square of the stairs
    assert errors[100] < 5e-6


def test_parameters_of_the_fmu_change_the_motion(car: str) -> None:
    soft = simulate(made(car, spring=9000.0), road()).outputs
    assert relative_error(soft, true_car(road(), True)) > 0.05


def test_the_first_input_has_always_acted(car: str) -> None:
    for parameters in ({}, EXCHANGED):
        found = simulate(made(car, **parameters), np.full((40, 1), 0.07)).outputs
        np.testing.assert_allclose(found, 0.0, rtol=0, atol=1e-9)


@pytest.mark.parametrize("parameters", [{}, EXCHANGED], ids=["co_simulation", "model_exchange"])
@pytest.mark.parametrize("fmu", ["car", "trap", "python_car"])
def test_records_do_not_depend_on_those_before(
    fmu: str, parameters: dict[str, Any], request: pytest.FixtureRequest
) -> None:
    if fmu == "python_car" and parameters:
        return  # it is for co-simulation alone
    path = request.getfixturevalue(fmu)
    system, fresh = made(path, **parameters), made(path, **parameters)
    other = -0.5 * road(90) + 0.01
    first = [simulate(system, record).outputs for record in (road(), other, road(), other)]
    np.testing.assert_array_equal(first[0], first[2])
    np.testing.assert_array_equal(first[1], first[3])
    np.testing.assert_array_equal(first[1], simulate(fresh, other).outputs)


def test_a_continuous_fmu_goes_on_from_a_saved_state(car: str) -> None:
    system = made(car, **EXCHANGED)
    assert isinstance(system, Linearizable)
    whole = simulate(system, road()).outputs
    system.begin(road()[0])
    for row in road()[:70]:
        system.advance(row)
    state = system.get_state()
    system.advance(road()[0])  # somewhere else
    again = simulate(system, road()[70:], state).outputs
    np.testing.assert_allclose(again, whole[70:], rtol=0, atol=1e-6)


def test_the_linearization_is_that_of_the_equations(car: str) -> None:
    system = made(car, **EXCHANGED)
    assert isinstance(system, Linearizable)
    system.begin(road()[0])
    for row in road()[:30]:
        system.advance(row)
    state = system.get_state()
    found = system.linearize(state)
    assert isinstance(found, StateMatrix)
    x, u, h = state.coordinates, float(state.last_input[0]), 1e-6
    expected = np.array(
        [
            np.subtract(equations.rates(x + h * e, u), equations.rates(x - h * e, u)) / (2 * h)
            for e in np.eye(4)
        ]
    ).T
    np.testing.assert_allclose(found.matrix, expected, rtol=1e-6, atol=1e-4)
    np.testing.assert_array_equal(system.get_state().coordinates, x)
    moved = system.advance(road()[30])
    np.testing.assert_allclose(moved, simulate(system, road()[30:31], state).outputs[1], atol=1e-7)


def test_directional_derivatives_of_the_fmu_are_more_exact_than_differences(
    car: str, slope_car: str
) -> None:
    found = []
    for system in (made(slope_car), made(car, **EXCHANGED)):
        assert isinstance(system, Linearizable)
        state = State(np.array([0.03, 0.01, 0.2, -0.1]), np.empty(0), np.array([0.02]))
        linearized = system.linearize(state)
        assert isinstance(linearized, StateMatrix)
        found.append(linearized.matrix)
    stiffness = 18e3 + 3 * 4e6 * 0.02**2
    damping = 1800 * (1 + 0.4 * 0.3 / np.hypot(0.3, 0.05))
    force = np.array([stiffness, -stiffness, damping, -damping])
    tyre = np.array([0.0, 180e3, 0.0, 0.0])
    true = np.array([[0, 0, 1, 0], [0, 0, 0, 1], -force / 300, (force - tyre) / 40])
    errors = [np.max(np.abs(matrix - true)) / np.max(np.abs(true)) for matrix in found]
    assert errors[0] < 1e-15 < 1e-12 < errors[1] < 1e-8


def test_derivatives_that_the_fmu_refuses_are_told(slope_car: str, tmp_path: Path) -> None:
    broken = changed(slope_car, tmp_path / "broken.fmu", **{'"30"': '"99"'})  # not der(body)
    system = made(broken)
    assert isinstance(system, Linearizable)
    with refused(SimulationError, "'broken.fmu' cannot be linearized", "fmu-interf"):
        system.linearize(system.rest_state(np.zeros(1)))


@pytest.mark.parametrize("parameters", [{}, EXCHANGED], ids=["co_simulation", "model_exchange"])
def test_a_step_that_fails_is_told_with_time_input_and_what_was_logged(
    trap: str, parameters: dict[str, Any]
) -> None:
    system = made(trap, "zero_order", **parameters, fail_above=0.02)
    inputs = np.zeros((20, 1))
    inputs[12:] = 0.03
    with pytest.raises(SimulationError, match=r"road = 0\.03 m.*the wheel leaves") as raised:
        simulate(system, inputs)
    assert raised.value.time == pytest.approx(12 * STEP)
    assert np.isfinite(simulate(system, np.full((20, 1), 0.01)).outputs).all()


@pytest.mark.parametrize("fmi", [2, 3])
def test_a_released_fmu_gives_the_outputs_of_its_surrogate(fmi: int, tmp_path: Path) -> None:
    surrogate, _ = read_fmu(Path(__file__).parents[2] / "fmus" / "linear" / "linear.fmu")
    path = tmp_path / "linear.fmu"
    export_fmu(surrogate, path, fmi=fmi)
    # outputs of a surrogate declare no range: nothing keeps them in one
    force = {"force": SignalTable(hold="zero_order")}
    outputs = {"position": SignalTable(range=(-2.0, 2.0))}
    step = surrogate.window.step
    system = load_system(Specification(str(path), {}, step, "fmu", force, outputs))
    signal = surrogate.inputs[0]
    assert (system.inputs[0].low, system.inputs[0].high) == (signal.low, signal.high)
    assert system.inputs[0].unit == signal.unit
    values = np.random.default_rng(1).uniform(signal.low, signal.high, (60, 1))
    inputs = np.repeat(values, 5, axis=0)
    found = simulate(system, inputs).outputs
    expected = surrogate.predict(inputs)
    np.testing.assert_allclose(found[1:], expected[-len(inputs) :], rtol=0, atol=1e-5)
