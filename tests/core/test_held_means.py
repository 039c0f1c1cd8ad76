"""Means of held values, against what the values say over each span."""

from __future__ import annotations

import numpy as np

from slide_fmu.core.held_means import held_means


def test_means_weigh_each_value_by_how_long_it_holds() -> None:
    times = np.array([0.0, 0.5, 1.0, 3.0])
    values = np.array([[1.0, 0.0], [3.0, 0.0], [5.0, 4.0], [7.0, 8.0]])
    means = held_means(times, values, np.array([0.0, 1.0, 2.0, 4.0, 9.0]))
    np.testing.assert_allclose(means, [[2.0, 0.0], [5.0, 4.0], [6.0, 6.0], [7.0, 8.0]])
