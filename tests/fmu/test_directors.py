"""Surrogates of an angle, whose inputs are its cosine and sine: they move on the circle."""

from __future__ import annotations

import dataclasses
import math
from typing import get_args

import numpy as np
import pytest

from slide_fmu.core.scaling import Affine
from slide_fmu.core.signals import Angle, FloatArray, Hold, Signal
from slide_fmu.cosim.check import OUTPUT_TOLERANCE
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.any_step import outputs_of_steps
from tests.fmu.native import DISCARD, ERROR, OK, Load
from tests.fmu.plain import ResamplingOracle
from tests.fmu.samples import STEP, CellShape, Shape, random_surrogate, sum_surrogate

ALLOWED = 4 * OUTPUT_TOLERANCE * 8
LAYERS = Shape(n_inputs=2, features="director", hold="first_order", positions=3)
SHAPES = {
    "layers": LAYERS,
    "cell": dataclasses.replace(LAYERS, cell=CellShape(activation="gated", contraction=0.9)),
}


def unscaled(shape: Shape) -> Surrogate:
    """Whose network sees the director as it is."""
    signals = (
        Signal("c", "1", -1, 1, start=1.0, hold=shape.hold, angle="cosine"),
        Signal("s", "1", -1, 1, start=0.0, hold=shape.hold, angle="sine"),
    )
    scaling = Affine.of_channels([0.0, 0.0], [1.0, 1.0])
    return dataclasses.replace(random_surrogate(shape), inputs=signals, input_scaling=scaling)


def directors(angles: FloatArray, lengths: FloatArray) -> FloatArray:
    return np.stack([lengths * np.cos(angles), lengths * np.sin(angles)], axis=1)


@pytest.mark.parametrize("rate", [0.05, 0.7, -0.7])
@pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)
def test_director_in_a_step_of_four_samples_turns_on_the_circle(
    load: Load, shape: Shape, rate: float
) -> None:
    """As single steps to points on the circle; up to 2.8 rad in a step, across pi in all."""
    loaded = load(unscaled(shape))
    steps = np.maximum(np.arange(1, 121) - 4, 0)  # the first step holds
    inputs = directors(0.3 + rate * steps, 1 + 0.002 * steps)
    single = outputs_of_steps(loaded.instance().start(), inputs, 1)
    coarse = outputs_of_steps(loaded.instance().start(), inputs[3::4], 4)
    np.testing.assert_allclose(coarse[:, 0], single[3::4, 0], rtol=0, atol=ALLOWED)
    np.testing.assert_allclose(coarse[:, 1], single[3::4, 1], rtol=3e-4)


@pytest.mark.parametrize("length", [2.5, 13.0])
def test_director_in_steps_off_the_grid_turns_on_the_circle(load: Load, length: float) -> None:
    """They sample the past anew: at times at which finer steps give points on the circle."""
    loaded = load(unscaled(LAYERS))
    count = int(2 * length)
    rate = 2.5 / count
    coarse = directors(0.3 + 2.5 * np.arange(20), np.ones(20))
    fine = directors(0.3 + rate * np.maximum(np.arange(1, 20 * count + 1) - count, 0), np.ones(1))
    found = outputs_of_steps(loaded.instance().start(), coarse, length)
    expected = outputs_of_steps(loaded.instance().start(), fine, 0.5)
    np.testing.assert_allclose(found[:, 0], expected[count - 1 :: count, 0], rtol=0, atol=ALLOWED)
    np.testing.assert_allclose(found[:, 1], expected[count - 1 :: count, 1], rtol=3e-4)


def test_director_that_turns_by_half_a_turn_goes_to_the_left(load: Load) -> None:
    loaded = load(unscaled(LAYERS))
    for first in (0.0, math.pi, 0.7, 1.9, -2.3):
        ends, middle = directors(np.array([first, first + math.pi]), np.ones(1)), first + 1.5708
        at_once = outputs_of_steps(loaded.instance().start(), ends, 2)
        between = directors(np.array([first, first, middle, first + math.pi]), np.ones(1))
        single = outputs_of_steps(loaded.instance().start(), between, 1)
        assert at_once[1] == pytest.approx(single[3], abs=1e-4)


def test_director_that_stays_is_exact(load: Load) -> None:
    loaded = load(unscaled(LAYERS))
    row = np.tile([0.6, -1.3], (30, 1))
    single, coarse = (
        outputs_of_steps(loaded.instance().start(), row, length) for length in (1, 3)
    )
    assert np.array_equal(coarse, single)


@pytest.mark.parametrize("hold", ["zero_order", "first_order"])
def test_director_of_zero_length_is_refused(load: Load, hold: Hold) -> None:
    loaded = load(unscaled(dataclasses.replace(LAYERS, hold=hold)))
    native = loaded.instance().start()
    native.set(0.0, 0.0)
    assert native.do_step(0.0) == ERROR
    native.step(0.6, -0.8)
    for row in ([0.0, 0.0], [-0.0, 5e-7], [6e-7, -6e-7]):
        native.messages.clear()
        assert native.set(*row) == OK
        before = native.save()
        for length in (1, 3, 0.6):
            assert native.do_step(STEP, length * STEP) == ERROR
        assert native.save() == before
        assert (
            f"inputs with value references 0 and 1 = {row[0]:g}, {row[1]:g}"
            in (native.messages[0])
        )
        assert "nothing was changed" in native.messages[0]
    assert native.set(math.nan, 1.0) == DISCARD
    native.step(0.0, 2e-6)


@pytest.mark.parametrize("length", [1.0, 3.0, 2.5])
@pytest.mark.parametrize("hold", get_args(Hold))
def test_angle_between_other_inputs_turns_whatever_the_network_sees(
    load: Load, hold: Hold, length: float
) -> None:
    """The first and the last of four inputs move linearly; features are differences."""
    shape = Shape(n_inputs=4, n_outputs=2, differences=1, hold=hold)
    random = random_surrogate(shape)
    pair = [
        dataclasses.replace(signal, low=-3.0, angle=angle, start=start)
        for signal, angle, start in zip(
            random.inputs[1:3], get_args(Angle), (1.0, 0.0), strict=True
        )
    ]
    scaling = Affine(random.input_scaling.offset.copy(), random.input_scaling.scale.copy())
    scaling.offset[1:3], scaling.scale[1:3] = 0.0, 1.5
    inputs = (random.inputs[0], *pair, random.inputs[3])
    surrogate = dataclasses.replace(random, inputs=inputs, input_scaling=scaling)
    native, plain = load(surrogate).instance().start(), ResamplingOracle(surrogate)
    for k, angle in enumerate((0.2, 1.4, 3.0, 4.5, 4.4, 2.0)):
        row = [0.3 * k, math.cos(angle), math.sin(angle), -0.2 * k]
        assert native.set(*row) == OK
        assert native.do_step(native.time(), length * STEP) == OK, native.messages
        expected, _ = plain.step(length * STEP, np.array(row))
        np.testing.assert_allclose(native.get(4, 2), expected, atol=ALLOWED)
    assert native.set(0.0, 0.0, 0.0, 0.0) == OK
    assert native.do_step(native.time(), STEP) == ERROR
    assert "value references 1 and 2 = 0, 0" in native.messages[0]


def test_inputs_of_zero_are_accepted_where_there_is_no_director(load: Load) -> None:
    assert load(random_surrogate(Shape(n_inputs=2))).instance().start().set(0.0, 0.0) == OK
    native = load(sum_surrogate()).instance().start()
    native.step(0.0)
