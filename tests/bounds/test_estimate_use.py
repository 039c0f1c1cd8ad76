"""Estimates are judged by predictions of known inputs, with the parameters of each trajectory."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from slide_fmu.bounds.estimate_use import _some_of, known_predictions
from slide_fmu.data.trajectories import Split
from tests.fmu.samples import CellShape, Shape, random_surrogate

SHAPE = Shape(n_in=20, n_out=6, n_inputs=2, n_outputs=2, cell=CellShape(states=4, parameters=2))


def test_each_trajectory_has_its_own_parameters() -> None:
    surrogate, rng = random_surrogate(SHAPE), np.random.default_rng(0)
    inputs = rng.uniform(-1, 1, (3, 60, 2))
    names = [parameter.name for parameter in surrogate.parameters]
    rows = np.array([[p.low + part * (p.high - p.low) for p in surrogate.parameters]
                     for part in (0.1, 0.5, 0.8)])  # fmt: skip
    split = Split(inputs, np.zeros((3, 61, 2)), np.zeros(3, np.int64), rows)
    found = known_predictions(surrogate, split)
    for one, row, predicted in zip(inputs, rows, found, strict=True):
        expected = surrogate.predict_newest(one, dict(zip(names, row.tolist(), strict=True)))
        np.testing.assert_array_equal(predicted, expected)
    at_starts = known_predictions(surrogate, replace(split, parameters=None))
    np.testing.assert_array_equal(at_starts, surrogate.predict_newest_batch(inputs))
    assert np.abs(at_starts - found).max() > 1e-3


def test_estimate_is_judged_on_trajectories_of_all_record_files() -> None:
    """Those of a file stand together, and each keeps its inputs, outputs and parameters."""
    numbers = np.arange(500.0)
    files = np.repeat([0, 1, 2], [300, 150, 50])
    split = Split(numbers[:, None, None], numbers[:, None, None], files, numbers[:, None])
    some = _some_of(split, 150)
    assert np.bincount(some.kinds).tolist() == [90, 45, 15]
    chosen = some.inputs[:, 0, 0]
    assert len(set(chosen.tolist())) == 150
    np.testing.assert_array_equal(some.outputs[:, 0, 0], chosen)
    assert some.parameters is not None
    np.testing.assert_array_equal(some.parameters[:, 0], chosen)
    np.testing.assert_array_equal(_some_of(some, 200).kinds, some.kinds)
