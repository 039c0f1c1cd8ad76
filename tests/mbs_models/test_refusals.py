"""What all machines refuse: parameters, inputs and states that have no meaning; and blow-ups."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from mbs_models.mass_chain.mass_chain import MassChain
from mbs_models.oscillators.oscillators import DuffingOscillator
from mbs_models.robot_6r.robot_6r import Robot6R
from mbs_models.slider_crank.slider_crank import SliderCrank
from slide_fmu.systems.base import State
from slide_fmu.systems.errors import SimulationError
from slide_fmu.systems.simulation import simulate
from tests.refusals import refused

NAN, INFINITE = float("nan"), float("inf")

OF_SPRINGS: list[tuple[str, Any]] = [
    ("mass", 0.0),
    ("stiffness", -1.0),
    ("damping", -0.1),
    ("alpha", NAN),
    ("step", INFINITE),
    ("substeps", 0),
    ("substeps", 2.5),
    ("force_limit", -1.0),
]
BAD_PARAMETERS: dict[type[Any], list[tuple[str, Any]]] = {
    DuffingOscillator: OF_SPRINGS,
    MassChain: [*OF_SPRINGS, ("drag", -0.1)],
    SliderCrank: [
        ("proportional", -1.0),
        ("differential", NAN),
        ("bending_stiffness", 0.0),
        ("slider_mass", 0.0),
        ("elements", 5),
        ("elements", 0),
        ("elements", 2.5),
        ("step", 0.0),
        ("substeps", 0),
        ("speed_limit", 0.0),
        ("deflection_limit", -1.0),
    ],
    Robot6R: [
        ("socket", "rubber"),
        ("step", 0.0),
        ("substeps", 0),
        ("substeps", 1.5),
        ("tool_length", NAN),
        ("deviation_limit", -1.0),
    ],
}
"""Of each machine: the parameters and a value that each of them cannot have."""

BAD_INPUTS: list[tuple[type[Any], list[float], str]] = [
    (DuffingOscillator, [NAN], "input force"),
    (DuffingOscillator, [0.0, 0.0], "input force"),
    (MassChain, [NAN, 0.0], "input force_1, force_4"),
    (MassChain, [0.0], "input force_1, force_4"),
    (SliderCrank, [0.0, 0.0], "director_x, director_y"),
    (SliderCrank, [1e-9, 0.0], "director_x, director_y"),
    (SliderCrank, [NAN, 0.0], "director_x, director_y"),
    (Robot6R, [NAN] * 6, "input joint_1, joint_2"),
    (Robot6R, [0.0] * 5, "input joint_1, joint_2"),
]
"""A machine, inputs that it cannot have, and how it names them."""


@pytest.mark.parametrize(
    ("machine", "parameter", "value"),
    [(machine, *bad) for machine, bads in BAD_PARAMETERS.items() for bad in bads],
)
def test_parameter_without_a_meaning_is_named(
    machine: type[Any], parameter: str, value: float
) -> None:
    with pytest.raises(ValueError, match=parameter.removesuffix("_limit")):
        machine(**{parameter: value})


@pytest.mark.parametrize(("machine", "bad", "message"), BAD_INPUTS)
def test_input_without_a_meaning_is_named(
    machine: type[Any], bad: list[float], message: str
) -> None:
    system = machine()
    with pytest.raises(ValueError, match=message):
        system.advance(np.array(bad))
    with pytest.raises(ValueError, match=f"{message}|held input"):
        system.rest_state(np.array(bad))
    with pytest.raises(ValueError, match=message):
        system.advance(np.array([bad]))  # one axis too many


@pytest.mark.parametrize("machine", BAD_PARAMETERS)
def test_state_of_another_size_is_named_by_its_part(machine: type[Any]) -> None:
    system = machine()
    fits = system.get_state()
    for part in ("coordinates", "velocities", "last_input"):
        values = {
            name: getattr(fits, name) for name in ("coordinates", "velocities", "last_input")
        }
        for bad in (np.append(values[part], 0.0), values[part] * NAN):
            with pytest.raises(ValueError, match=part):
                system.set_state(State(**{**values, part: bad}))


@pytest.mark.parametrize("machine", [DuffingOscillator, MassChain])
def test_divergence_is_an_error_and_not_the_end(machine: type[Any]) -> None:
    system = machine()
    count, start = len(system.inputs), system.random_state(np.random.default_rng(1))
    with refused(SimulationError, "diverged"):
        simulate(system, np.full((5, count), 1e200), start)
    assert np.isfinite(simulate(system, np.zeros((5, count)), start).outputs).all()
