"""Inputs of a side by side run leave their start values smoothly."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from slide_fmu.apps.reference.side_by_side import as_the_reference, led_in
from slide_fmu.core.signals import FloatArray
from slide_fmu.data.draws import Draw
from slide_fmu.fmu.export import export_fmu, read_fmu
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import State
from tests.validation.test_moving_inputs import surrogate_of

FMUS = Path(__file__).parents[3] / "fmus"
BURN_IN, COUNT = 100, 50


def released(name: str) -> Surrogate:
    surrogate, _ = read_fmu(FMUS / name / f"{name}.fmu")
    return surrogate


def drawn(inputs: FloatArray, burn_in: int = BURN_IN) -> Draw:
    return Draw(0, 1.0, State(np.zeros(1), np.zeros(1), inputs[0]), inputs, burn_in)


@pytest.mark.parametrize("name", ["duffing", "robot_6r"])
def test_a_constant_is_reached_without_a_jump(name: str) -> None:
    surrogate = released(name)
    wanted = np.array([0.8 * signal.high for signal in surrogate.inputs])
    found = led_in(surrogate, drawn(np.tile(wanted, (BURN_IN + COUNT, 1))))
    part = (found - surrogate.starts) / (wanted - surrogate.starts)
    assert np.all(part[0] == 0)
    np.testing.assert_allclose(part[BURN_IN:], 1, rtol=0, atol=1e-12)
    assert np.all(np.diff(part, axis=0) >= 0)
    slopes = np.diff(part, axis=0) * BURN_IN
    bends = np.diff(slopes, axis=0) * BURN_IN
    for derivative, largest in ((slopes, 1.875), (bends, 5.78)):  # of the polynomial
        assert np.max(np.abs(derivative)) < 1.01 * largest
        assert np.max(np.abs(derivative[0])) < 0.15 * largest
        assert np.max(np.abs(derivative[BURN_IN - 2])) < 0.15 * largest


def test_without_burn_in_only_the_first_sample_is_the_start() -> None:
    surrogate = released("duffing")
    inputs = np.full((COUNT, 1), 500.0)
    found = led_in(surrogate, drawn(inputs, burn_in=0))
    assert found[0] == surrogate.starts
    np.testing.assert_array_equal(found[1:], inputs[1:])


def test_directors_stay_as_they_were_drawn() -> None:
    angles = np.linspace(1.0, 9.0, BURN_IN + COUNT)
    inputs = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    np.testing.assert_array_equal(led_in(released("slider_crank"), drawn(inputs)), inputs)


def test_side_by_side_system_has_an_fmu_that_takes_inputs_as_the_reference(
    tmp_path: Path,
) -> None:

    for at_step_end in (False, True):
        surrogate = surrogate_of(at_step_end)
        fmu = export_fmu(surrogate, tmp_path / f"{at_step_end}.fmu", fmi=3, provenance={"a": 1})
        alike = as_the_reference(fmu, surrogate, {"a": 1}, tmp_path / "alike.fmu")
        told, provenance = read_fmu(alike)
        assert told.inputs_at_step_end
        assert provenance == {"a": 1}
        assert alike != fmu
