"""Communication steps of any length: surrogates, patterns of steps, and an FMU that takes them."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable

import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray
from tests.fmu.native import OK, Native
from tests.fmu.samples import STEP, CellShape, Shape

ESTIMATE_TOLERANCE = 3e-4
"""Relative; ten to the power of a float32 sum over the window."""

FORGETFUL = CellShape(states=5, units=9, contraction=0.3)
"""Forgets to rounding within a window of 12: windows and ping-pong are the same."""

SHAPES = [
    Shape(n_inputs=2, n_outputs=2, positions=4),
    Shape(n_inputs=2, block=False, positions=3, means=True),
    Shape(n_inputs=2, n_outputs=2, cell=FORGETFUL, positions=3),
    Shape(n_in=16, n_inputs=2, positions=2, differences=2, cell=FORGETFUL, ages=3),
    Shape(n_inputs=2, positions=25, estimator_samples=4, differences=1),
    Shape(n_inputs=2, features="director", positions=3, differences=2),
    Shape(
        n_in=16,
        n_inputs=3,
        features="chain",
        positions=2,
        cell=dataclasses.replace(FORGETFUL, activation="gated", turned=2, factors=2),
    ),
]
NAMES = ["block", "one_sample", "cell", "ages", "long_span", "director", "gated"]

PATTERNS: dict[str, list[float]] = {
    "six_tenths": [0.6],
    "quarter": [0.25],
    "halves_and_more": [0.5, 0.5, 1, 2, 0.5, 0.5, 0.5, 1, 1.5, 0.75, 0.25, 14, 0.5],
    "switching": [1, 1, 1, 0.6, 0.6, 1, 1, 2, 0.35, 3, 1],
    "first_is_odd": [0.6, *[1] * 30, 2],
    "long": [25.5, 1, 40, 1, 13, 0.5],
    "random": np.random.default_rng(0).uniform(0.25, 3.5, 50).tolist(),
}

both_holds = pytest.mark.parametrize("hold", ["zero_order", "first_order"])


def n_phases(length: float) -> int:
    """How many phases steps of a length in h come through; 0: more than the FMU keeps."""
    return next((n for n in range(1, 11) if abs(n * length - round(n * length)) < 1e-5), 0)


def drawn(count: int, n_inputs: int) -> FloatArray:
    return np.random.default_rng(9).uniform(-2, 3, (count, n_inputs))


def go(native: Native, lengths: Iterable[float], inputs: FloatArray, first: int = 1) -> FloatArray:
    """Steps from the present on, lengths in h; output variables after each."""
    count = inputs.shape[1]
    return go_and_read(native, lengths, inputs, lambda _: native.get(count, first))


def go_and_read(
    native: Native,
    lengths: Iterable[float],
    inputs: FloatArray,
    read: Callable[[int], list[float]],
) -> FloatArray:
    """Steps from the present on, lengths in h; what is read after each, by its number."""
    time, rows = native.time(), []
    for k, (length, row) in enumerate(zip(lengths, inputs, strict=True)):
        assert native.set(*row) == OK
        assert native.do_step(time, length * STEP) == OK, native.messages
        rows.append(read(k))
        time += length * STEP
    return np.array(rows)


def outputs_of_steps(native: Native, rows: FloatArray, length: float) -> FloatArray:
    """Two inputs a row, a step of a length in h after each: the two outputs, shape (N, 2)."""
    return go(native, [length] * len(rows), rows, 2)


def outputs_and_some(
    native: Native,
    lengths: Iterable[float],
    reads: Callable[[int], bool],
    read: Callable[[], list[float]],
) -> tuple[FloatArray, dict[int, list[float]]]:
    """Steps under made-up inputs: both outputs after each, and what is read after some."""
    lengths, some = list(lengths), dict[int, list[float]]()

    def look(k: int) -> list[float]:
        outputs = native.get(2, 2)
        if reads(k):
            some[k] = read()
        return outputs

    return go_and_read(native, lengths, drawn(200, 2)[: len(lengths)], look), some


LASTING = CellShape(states=4, contraction=0.85, units=6)
"""Far from forgotten after a window of 12: only the same ping-pong gives the same."""
