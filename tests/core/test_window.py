"""The index law: which inputs and outputs belong together."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slide_fmu.core.window import MAX_WINDOW, Window, checked_batch
from tests.refusals import refused
from tests.strategies import windows


def test_index_law_is_right_in_an_example_by_hand() -> None:
    """n_in = 4, n_out = 2, s = 3: inputs u[3..6] give outputs y[6], y[7]."""
    window = Window(0.1, 4, 2)
    assert window.input_indices(np.array([3])).tolist() == [[3, 4, 5, 6]]
    assert window.output_indices(np.array([3])).tolist() == [[6, 7]]
    assert (window.n_truncated, window.memory_length) == (2, 3)
    assert window.truncation_time == pytest.approx(0.2)


@given(windows(), st.integers(0, 30), st.integers(1, 4))
def test_indices_are_those_of_the_explicit_loop(window: Window, extra: int, stride: int) -> None:
    count = window.n_in + extra
    starts = window.starts(count, stride)
    inputs, outputs = window.input_indices(starts), window.output_indices(starts)
    assert inputs.shape == (len(starts), window.n_in)
    assert outputs.shape == (len(starts), window.n_out)
    s, row = 0, 0
    while s + window.n_in <= count:
        for i in range(window.n_in):
            assert inputs[row, i] == s + i
        for j in range(window.n_out):
            assert outputs[row, j] == s + window.n_in - window.n_out + 1 + j
        s, row = s + stride, row + 1
    assert row == len(starts)


@given(windows(), st.integers(0, 50))
def test_outputs_come_after_inputs_that_lead_to_them(window: Window, start: int) -> None:
    """Output k rests on inputs up to k - 1; the newest output on the newest input."""
    starts = np.array([start])
    inputs, outputs = window.input_indices(starts)[0], window.output_indices(starts)[0]
    assert outputs[-1] == inputs[-1] + 1
    for output in outputs:
        before = inputs[inputs < output]
        assert before[-1] == output - 1
        assert len(before) >= window.memory_length
    assert np.sum(inputs < outputs[0]) == window.memory_length


@given(windows(), st.integers(0, 40))
def test_stride_n_out_covers_every_sample_once(window: Window, extra: int) -> None:
    starts = window.starts(window.n_in + extra, window.n_out)
    covered = window.output_indices(starts).ravel()
    first = window.n_truncated + 1
    assert covered.tolist() == list(range(first, first + len(starts) * window.n_out))
    assert window.n_in + extra - covered[-1] < window.n_out


def test_no_window_fits_into_a_shorter_record() -> None:
    assert len(Window(0.1, 4, 2).starts(3)) == 0


@pytest.mark.parametrize("step", [0.0, -0.1, math.nan, math.inf])
def test_step_is_positive(step: float) -> None:
    with refused(ValueError, "window step"):
        Window(step, 4, 2)


@pytest.mark.parametrize(("n_in", "n_out"), [(4, 5), (4, 0), (0, 0), (-1, -1)])
def test_lengths_fit(n_in: int, n_out: int) -> None:
    with pytest.raises(ValueError, match=f"n_in = {n_in}, n_out = {n_out}"):
        Window(0.1, n_in, n_out)


def test_largest_window_is_that_which_the_runtime_reads() -> None:
    """Whatever Python may write, the C library reads: both have the same bound."""
    runtime = Path(__file__).parents[2] / "slide_fmu" / "fmu" / "runtime"
    sources = [path.read_text(encoding="utf-8") for path in runtime.rglob("*.[ch]")]
    bounds = [found for text in sources for found in re.findall(r"MAX_WINDOW = 1 << (\d+)", text)]
    assert [1 << int(bits) for bits in bounds] == [MAX_WINDOW]


def test_batch_of_the_expected_shape_is_given_as_float64() -> None:
    values = np.arange(12, dtype=np.int32).reshape(2, 3, 2)
    found = checked_batch("windows", values, (3, 2))
    assert found.dtype == np.float64
    assert found.tolist() == values.tolist()


@pytest.mark.parametrize("shape", [(3, 2), (2, 2, 3), (2, 3, 1), (1, 2, 3, 2), (4, 3, 2, 1)])
def test_batch_of_another_shape_is_refused_with_its_name(shape: tuple[int, ...]) -> None:
    message = re.escape(f"windows of shape {shape}; expected (B, 3, 2)")
    with pytest.raises(ValueError, match=f"^{message}$"):
        checked_batch("windows", np.zeros(shape), (3, 2))
