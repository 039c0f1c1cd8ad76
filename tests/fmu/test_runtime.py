"""numpy = C through fmpy, for all kinds of networks."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import fmpy
import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray
from slide_fmu.cosim.check import ERROR_TOLERANCE, OUTPUT_TOLERANCE
from slide_fmu.fmu.export import export_fmu
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.native import Load
from tests.fmu.samples import STEP, CellShape, Shape, random_surrogate, sum_surrogate

SHAPES = [
    Shape(activation="identity", hidden=()),
    Shape(activation="relu", hidden=(40, 33), skip=True),
    Shape(activation="elu", n_inputs=3, n_outputs=2, positions=4),
    Shape(activation="tanh", n_inputs=2, n_outputs=3, block=False, positions=1),
    Shape(activation="elu", block=False, skip=True, n_inputs=2, positions=9, n_out=9),
    Shape(activation="gelu", n_inputs=2, hidden=(40, 33), positions=2),
    Shape(activation="elu", n_inputs=3, hidden=(40, 33), skip=True, positions=2),
    Shape(activation="tanh", n_outputs=3, hidden=(7,), block=False, ages=3),
    Shape(cell=CellShape(contraction=0.9), positions=4),
    Shape(activation="gelu", n_inputs=2, n_outputs=2, block=False, positions=3, means=True),
    Shape(activation="relu", n_in=1, n_out=1, n_outputs=33, positions=1),
    Shape(activation="tanh", n_in=100, n_out=30, hidden=(200, 200), positions=30),
    Shape(activation="cubic", hidden=(40, 33), n_inputs=2),
    Shape(cell=CellShape(states=4, units=32)),
    Shape(cell=CellShape(states=14, units=40), n_inputs=2, n_outputs=3, hold="first_order"),
    Shape(cell=CellShape(states=9, units=17, activation="cubic"), n_inputs=2, differences=2),
    Shape(cell=CellShape(states=3, units=11, activation="mixed"), n_inputs=2),
    Shape(cell=CellShape(states=2, units=0), n_outputs=9, n_in=1, n_out=1, differences=1),
    Shape(cell=CellShape(contraction=0.9), positions=4, n_outputs=2),
    Shape(cell=CellShape(contraction=0.9), positions=5, means=True, ages=4),
    Shape(activation="tanh", n_inputs=2, positions=40, estimator_samples=5, ages=3, skip=True),
    Shape(activation="relu", n_in=6, n_out=3, block=False, positions=9, estimator_samples=6),
    Shape(n_in=20, positions=1, estimator_samples=1, means=True, ages=1),
    Shape(cell=CellShape(contraction=0.9), n_in=100, n_out=30, positions=30),
]

SEEN = [
    Shape(n_inputs=3, differences=2),
    Shape(n_inputs=2, features="director"),
    Shape(n_inputs=4, features="director"),
    Shape(n_inputs=1, features="chain"),
    Shape(n_inputs=7, features="chain"),
]
KINDS = [
    Shape(activation="tanh", positions=3),
    Shape(activation="relu", block=False, skip=True),
    Shape(cell=CellShape(states=5, units=7)),
    Shape(cell=CellShape(states=9, units=9, roles=True, factors=3), n_outputs=3),
    Shape(cell=CellShape(states=8, units=11, activation="gated")),
    Shape(
        cell=CellShape(15, 48, "gated", contraction=0.9, turned=7, factors=4),
        n_outputs=3,
        positions=4,
        hold="first_order",
    ),
    Shape(cell=CellShape(1, 0, "gated", factors=1)),
    Shape(cell=CellShape(2, 1, "gated", turned=1), n_in=1, n_out=1),
]
SHAPES += [
    dataclasses.replace(
        kind, n_inputs=seen.n_inputs, features=seen.features, differences=seen.differences, seed=5
    )
    for kind in KINDS
    for seen in SEEN
]


def _simulate(path: Path, surrogate: Surrogate, inputs: FloatArray) -> dict[str, FloatArray]:
    """Outputs after each step, by variable name."""
    names = [signal.name for signal in surrogate.inputs]
    time = STEP * np.arange(len(inputs))
    table = np.array(
        [(t, *row) for t, row in zip(time, inputs, strict=True)],
        dtype=[("time", float), *((name, float) for name in names)],
    )
    stop = len(inputs) * STEP
    held = {"inputs_held": 1.0} if surrogate.hold == "zero_order" else {}
    result = fmpy.simulate_fmu(
        str(path),
        stop_time=stop,
        step_size=STEP,
        output_interval=STEP,
        input=table,
        start_values=held,
    )
    assert len(result) == len(inputs) + 1
    return {name: result[name][1:] for name in result.dtype.names}


def _filled(inputs: FloatArray, n_samples: int) -> FloatArray:
    return np.minimum(1, np.arange(1, len(inputs) + 1) / n_samples)


@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_fmu_run_by_fmpy_gives_what_numpy_gives(tmp_path: Path, shape: Shape) -> None:
    surrogate = random_surrogate(shape)
    path = export_fmu(surrogate, tmp_path / "sample.fmu")
    rng = np.random.default_rng(4)
    inputs = rng.uniform(-2, 3, (2 * shape.n_in + 20, shape.n_inputs))
    results = _simulate(path, surrogate, inputs)
    outputs = surrogate.predict_newest(inputs)
    for column, signal in enumerate(surrogate.outputs):
        allowed = OUTPUT_TOLERANCE * (signal.high - signal.low)
        np.testing.assert_allclose(results[signal.name], outputs[:, column], rtol=0, atol=allowed)
    if surrogate.estimator is not None:
        errors = surrogate.estimate_error(inputs)
        for column, signal in enumerate(surrogate.outputs):
            estimate = results[f"{signal.name}_error_estimate"]
            np.testing.assert_allclose(estimate, errors[:, column], rtol=ERROR_TOLERANCE)
        seen = surrogate.estimator.network.memory_length + surrogate.estimator.positions - 1
        np.testing.assert_allclose(results["error_estimate_filled"], _filled(inputs, seen))
    if isinstance(surrogate.network, StateSpace):
        _, errors = surrogate.network.ping_pong(surrogate.input_scaling.apply(inputs)[None])
        expected = errors[0] * surrogate.output_scaling.scale
        for column, signal in enumerate(surrogate.outputs):
            found = results[f"{signal.name}_truncation_error"]
            allowed = OUTPUT_TOLERANCE * (signal.high - signal.low)
            np.testing.assert_allclose(found, expected[:, column], rtol=0, atol=allowed)
    filled = _filled(inputs, surrogate.network.memory_length)
    np.testing.assert_allclose(results["window_filled"], filled)


def test_linear_network_of_integers_gives_exact_sums(tmp_path: Path) -> None:
    surrogate = sum_surrogate(7)
    path = export_fmu(surrogate, tmp_path / "sum.fmu")
    inputs = np.arange(30.0)[:, None]
    expected = surrogate.predict_newest(inputs)[:, 0]
    np.testing.assert_array_equal(_simulate(path, surrogate, inputs)["y"], expected)


def test_estimate_of_a_huge_exponent_stays_finite(load: Load) -> None:
    """Far out of range the estimate saturates at the largest error that the map knows."""
    surrogate = random_surrogate(Shape(activation="identity", positions=2))
    native = load(surrogate).instance().start()
    assert surrogate.estimator is not None
    largest = 10**surrogate.estimator.log_error.high * surrogate.output_scaling.scale[0]
    for value in (1e9, -1e9):
        for _ in range(surrogate.window.n_in + 1):
            native.step(value)
        estimate = native.get(2)[0]
        assert estimate == pytest.approx(largest, rel=1e-6) or estimate < 1e-100
