"""The error by amplitude and frequency of the inputs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from slide_fmu.report.frequency_charts import error_maps
from slide_fmu.validation.comparison import Comparison
from slide_fmu.validation.error_map import error_map
from tests.validation.handmade import comparison, validation

COUNT = 320


def sine(amplitude: float, period: int, error: float) -> Comparison:
    """A trajectory under a sine of the input, whose period is given in samples."""
    found = comparison([[error, 0.0]] * COUNT)
    course = amplitude * np.sin(2 * np.pi * np.arange(COUNT) / period)
    return replace(found, inputs=course[:, None])


def test_sines_stand_in_the_cells_of_their_amplitudes_and_frequencies() -> None:
    slow, fast = sine(1.0, 16, 0.35), sine(0.1, 5, 0.7)
    checked = validation(slow, fast)
    half = 0.5 * (checked.surrogate.inputs[0].high - checked.surrogate.inputs[0].low)
    scaled = [replace(c, inputs=half * c.inputs) for c in (slow, fast)]
    found = error_map(validation(*scaled))
    assert found is not None
    rows, columns = np.nonzero(found.pieces)
    assert found.amplitudes[rows].tolist() == [0.0, 0.8]
    step = checked.surrogate.window.step
    low, high = 1 / (17 * step), 1 / (4 * step)
    assert low < found.frequencies[columns[1]] < high
    size = np.sqrt(np.mean((slow.reference - checked.mean) ** 2))
    np.testing.assert_allclose(found.error[rows, columns], [0.7 / size, 0.35 / size])


def test_map_shows_its_errors_from_large_amplitudes_down() -> None:
    (shown,) = error_maps(validation(sine(0.5, 16, 0.35), sine(0.1, 5, 0.7)))
    assert len(shown.rows) == len(shown.cells)
    assert shown.rows[-1] == "below 20 %"
    cells = [cell for row in shown.cells for cell in row if cell is not None]
    assert [cell.level for cell in cells] == pytest.approx([0.0, 1.0])
    assert all(cell.text.endswith(" %") for cell in cells)


def test_short_trajectories_and_constant_inputs_have_no_map() -> None:
    assert error_map(validation(comparison([[1.0, 1.0]] * 8))) is None
    assert error_maps(validation(comparison([[1.0, 1.0]] * COUNT))) == []
