"""Functions whose outputs follow the rates of inputs keep their word as others do."""

from __future__ import annotations

import numpy as np

from slide_fmu.data.contract import check_system
from slide_fmu.systems.declared import SignalTable
from slide_fmu.systems.function.system import FunctionSystem
from slide_fmu.systems.loading import load_system
from slide_fmu.systems.specification import Specification
from tests.own_models import quarter_car_corner

STEP = 0.005
SPECIFICATION = Specification(
    quarter_car_corner.__name__,
    kind="function",
    step=STEP,
    outputs={"force": SignalTable(range=(-2000.0, 2000.0))},
)
ROADS = 0.02 * np.sin(STEP * np.arange(60)[:, None] * [20.0, 35.0])


def test_function_with_rates_of_inputs_in_its_outputs_passes_its_check() -> None:
    check_system(load_system(SPECIFICATION), STEP, ROADS)


def test_state_knows_the_rate_of_the_step_that_ended_there() -> None:
    system = load_system(SPECIFICATION)
    assert isinstance(system, FunctionSystem)
    system.set_state(system.rest_state(ROADS[0]))
    output = np.array([system.advance(row) for row in ROADS[:20]])[-1]
    state = system.get_state()
    system.advance(ROADS[20])
    system.set_state(state)
    np.testing.assert_array_equal(system.output(), output)
    assert np.any(state.input_rate != 0)
