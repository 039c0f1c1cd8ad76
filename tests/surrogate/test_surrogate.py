"""Two ways to evaluate a surrogate, one result; files; bad inputs."""

from __future__ import annotations

import dataclasses
import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slide_fmu.core.scaling import Affine
from slide_fmu.core.signals import FloatArray
from slide_fmu.network.feed_forward import network as feed_forward
from slide_fmu.network.feed_forward.network import FeedForward
from slide_fmu.network.state_space import network as state_space
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.surrogate import surrogate as surrogate_module
from slide_fmu.surrogate.payload import PayloadError
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.samples import CellShape, Shape, random_surrogate, sum_surrogate
from tests.refusals import refused
from tests.strategies import all_shapes, surrogate_shapes

ROUNDING = 1e-5
"""Batches of other sizes sum float32 products of order 1 in another order."""

ESTIMATE_ROUNDING = 5e-5
"""The same in the exponent of ten, times 2 ln 10."""


def record(shape: Shape, count: int) -> FloatArray:
    return np.random.default_rng(shape.seed).uniform(-2, 3, (count, shape.n_inputs))


@given(surrogate_shapes(), st.integers(1, 40))
def test_blocks_and_steps_agree_where_they_overlap(shape: Shape, count: int) -> None:
    """A block network's newest sample of each block; a one-sample network's every sample.

    Without changes among the features: a window alone does not know those before it.
    """
    shape = dataclasses.replace(shape, features="differences", differences=0)
    surrogate, inputs = random_surrogate(shape), record(shape, count)
    blocks, steps = surrogate.predict(inputs), surrogate.predict_newest(inputs)
    assert blocks.shape == steps.shape == (count, shape.n_outputs)
    common = np.arange(count)
    if surrogate.network.n_values != shape.n_outputs:
        common = np.arange(count - 1, -1, -shape.n_out)
    assert blocks[common] == pytest.approx(steps[common], abs=ROUNDING, rel=ROUNDING)


@given(all_shapes(), st.integers(1, 20), st.integers(1, 20))
def test_newest_outputs_and_estimates_do_not_depend_on_later_inputs(
    shape: Shape, count: int, more: int
) -> None:
    surrogate, inputs = random_surrogate(shape), record(shape, count + more)
    newest = surrogate.predict_newest(inputs)[:count]
    before = surrogate.predict_newest(inputs[:count])
    assert newest == pytest.approx(before, abs=ROUNDING, rel=ROUNDING)
    if surrogate.estimator is None:
        with refused(ValueError, "no error estimator"):
            surrogate.estimate_error(inputs)
        return
    estimates = surrogate.estimate_error(inputs)[:count]
    assert np.all(estimates > 0)
    expected = surrogate.estimate_error(inputs[:count])
    assert estimates == pytest.approx(expected, rel=ESTIMATE_ROUNDING)


@given(all_shapes(), st.integers(1, 30))
def test_stream_of_a_batch_is_that_of_one_record_after_the_other(shape: Shape, count: int) -> None:
    surrogate = random_surrogate(shape)
    batch = np.random.default_rng(shape.seed).uniform(-2, 3, (3, count, shape.n_inputs))
    expected = np.stack([surrogate.predict_newest(inputs) for inputs in batch])
    found = surrogate.predict_newest_batch(batch)
    assert found == pytest.approx(expected, abs=ROUNDING, rel=ROUNDING)
    with refused(ValueError, "expected (sequences, samples"):
        surrogate.predict_newest_batch(batch[0])
    batch[2, -1, 0] = math.nan
    with pytest.raises(ValueError, match=f"'u0' at sample {count - 1} is nan"):
        surrogate.predict_newest_batch(batch)


def test_truncation_errors_are_in_output_units() -> None:
    surrogate = random_surrogate(Shape(n_in=5, n_out=2, n_outputs=2, cell=CellShape()))
    network, inputs = surrogate.network, record(Shape(), 20)
    assert isinstance(network, StateSpace)
    _, errors = network.ping_pong(surrogate.input_scaling.apply(inputs)[None])
    found = surrogate.truncation_errors(inputs)
    assert found == pytest.approx(errors[0] * surrogate.output_scaling.scale)
    assert random_surrogate(Shape()).truncation_errors(inputs) is None


@pytest.mark.parametrize("block", [True, False])
def test_block_of_a_record_is_the_prediction_of_its_window(block: bool) -> None:
    shape = Shape(n_in=6, n_out=3, n_inputs=2, n_outputs=2, block=block)
    surrogate, inputs = random_surrogate(shape), record(shape, 12)
    starts = np.array([0, 3, 6])
    windows = inputs[surrogate.window.input_indices(starts)]
    rows = surrogate.window.output_indices(starts) - 1
    predicted = surrogate.predict(inputs)[rows]
    assert surrogate.predict_windows(windows) == pytest.approx(predicted, abs=ROUNDING)


@pytest.mark.parametrize(
    "shape",
    [Shape(positions=3), Shape(block=False, positions=3), Shape(cell=CellShape(), positions=3)],
    ids=["block", "one_sample", "cell"],
)
def test_record_predicted_in_small_batches_gives_the_same_results(
    shape: Shape, monkeypatch: pytest.MonkeyPatch
) -> None:
    surrogate, inputs = random_surrogate(shape), record(shape, 50)
    names = ("predict", "predict_newest", "estimate_error")
    whole = [getattr(surrogate, name)(inputs) for name in names]
    monkeypatch.setattr(surrogate_module, "BATCH", 3)
    monkeypatch.setattr(feed_forward, "BATCH", 3)
    monkeypatch.setattr(state_space, "CHUNK", 25)
    for name, expected in zip(names, whole, strict=True):
        found = getattr(surrogate, name)(inputs)
        assert found == pytest.approx(expected, abs=ROUNDING, rel=ESTIMATE_ROUNDING), name


def test_first_input_is_held_before_the_record() -> None:
    """The sum over four samples: 5 + 5 + 5 + 5, then the ones push the fives out."""
    surrogate = sum_surrogate(4)
    inputs = np.array([[5.0], [1.0], [1.0], [1.0], [1.0]])
    expected = [[20.0], [16.0], [12.0], [8.0], [4.0]]
    assert surrogate.predict(inputs).tolist() == expected
    assert surrogate.predict_newest(inputs).tolist() == expected


@given(all_shapes())
def test_prehistory_is_the_same_as_a_longer_held_record(shape: Shape) -> None:
    surrogate, inputs = random_surrogate(shape), record(shape, 8)
    lead = shape.n_in * shape.n_out  # whole blocks and hand-overs: the phase stays
    longer = np.concatenate([np.repeat(inputs[:1], lead, axis=0), inputs])
    for name in ("predict", "predict_newest"):
        found = getattr(surrogate, name)(longer)[lead:]
        expected = getattr(surrogate, name)(inputs)
        assert found == pytest.approx(expected, abs=ROUNDING, rel=ROUNDING)
    if surrogate.estimator is not None and isinstance(surrogate.estimator.network, FeedForward):
        found, expected = surrogate.estimate_error(longer)[lead:], surrogate.estimate_error(inputs)
        assert found == pytest.approx(expected, rel=ESTIMATE_ROUNDING)


def test_surrogate_that_is_saved_and_loaded_is_the_same(tmp_path: Path) -> None:
    shape = Shape(positions=2, skip=True)
    surrogate, path, inputs = random_surrogate(shape), tmp_path / "a.slide", record(shape, 20)
    surrogate.save(path)
    again = Surrogate.from_bytes(path.read_bytes())
    assert path.read_bytes() == again.to_bytes()
    assert np.array_equal(again.predict(inputs), surrogate.predict(inputs))
    assert np.array_equal(again.estimate_error(inputs), surrogate.estimate_error(inputs))
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(PayloadError):
        Surrogate.from_bytes(path.read_bytes())


@pytest.mark.parametrize("shape", [(5,), (5, 1), (0, 2), (2, 5, 2)])
def test_inputs_of_another_shape_are_named(shape: tuple[int, ...]) -> None:
    surrogate = random_surrogate(Shape(n_inputs=2))
    for method in (surrogate.predict, surrogate.predict_newest):
        with pytest.raises(ValueError, match=r"expected \(samples, 2\) for \['u0', 'u1'\]") as e:
            method(np.zeros(shape))
        assert str(shape) in str(e.value)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_input_that_is_not_finite_is_named(value: float) -> None:
    surrogate = random_surrogate(Shape(n_inputs=2, positions=1))
    inputs = np.zeros((6, 2))
    inputs[4, 1] = value
    for method in (surrogate.predict, surrogate.predict_newest, surrogate.estimate_error):
        with pytest.raises(ValueError, match=f"'u1' at sample 4 is {value}"):
            method(inputs)


@pytest.mark.parametrize(
    ("positions", "samples", "expected"), [(1, 12, 4), (1, 3, 1), (30, 3, 30)]
)
def test_estimate_is_about_its_positions_or_the_output_window(
    positions: int, samples: int, expected: int
) -> None:
    """The output window where one evaluation sees the whole input window."""
    shape = Shape(n_in=12, n_out=4, positions=positions, estimator_samples=samples)
    assert random_surrogate(shape).estimated_samples == expected


def test_parts_that_do_not_fit_are_refused() -> None:
    surrogate = random_surrogate(Shape(positions=2))
    estimator = surrogate.estimator
    assert estimator is not None
    two = random_surrogate(Shape(n_inputs=2))
    moving = random_surrogate(Shape(hold="first_order")).inputs
    nothing = np.array([[0.0], [1.0]], np.float32)
    changes = [
        ({"name": "2nd"}, "surrogate name '2nd'"),
        ({"name": "ü"}, "surrogate name 'ü'"),
        ({"outputs": moving}, "output 'u0' with hold 'first_order'"),
        ({"window": dataclasses.replace(surrogate.window, n_in=13)}, "maps 12 samples to 4"),
        ({"inputs": two.inputs}, "2 inputs and 1 outputs"),
        ({"inputs": two.inputs, "input_scaling": two.input_scaling}, "2 inputs and 1 outputs"),
        ({"network": random_surrogate(Shape(n_out=3, cell=CellShape())).network}, "(12, 4, 1)"),
        ({"output_scaling": Affine.of_channels([0, 0], [1, 1])}, "2 outputs"),
        ({"outputs": two.inputs, "output_scaling": two.input_scaling}, "12 to 8"),
        ({"estimator": dataclasses.replace(estimator, positions=2**21)}, "at 2097152 positions"),
        ({"estimator": dataclasses.replace(estimator, positions=0)}, "at 0 positions"),
        ({"estimator": dataclasses.replace(estimator, ranges=nothing[:1])}, "shape (1, 1)"),
        ({"estimator": dataclasses.replace(estimator, ranges=nothing[::-1])}, "lies in 1 .. 0"),
        ({"estimator": dataclasses.replace(estimator, network=surrogate.network)}, "4 values"),
    ]
    for change, message in changes:
        with pytest.raises(ValueError, match=re.escape(message)):
            dataclasses.replace(surrogate, **change)
