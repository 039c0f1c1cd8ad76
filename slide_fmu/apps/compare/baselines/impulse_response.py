"""In a FIR model the outputs are a weighted sum of the newest inputs, by ridge regression."""

from __future__ import annotations

from functools import partial

import numpy as np

from slide_fmu.apps.compare.baselines.base import Baseline, Budget, FittedBaseline, NetworkBaseline
from slide_fmu.apps.compare.baselines.lesson import Lesson
from slide_fmu.apps.compare.baselines.search import search
from slide_fmu.core.progress import Progress
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import Window
from slide_fmu.network.feed_forward.network import FeedForward, Layer

SHARES = (8, 4, 2, 1)
"""Divisors of the longest response, which has one tap for each input that the window allows."""
RIDGES = (1e-10, 1e-8, 1e-6, 1e-4, 1e-2)
"""Regularisation of the regression, relative to the mean power of the inputs; one is chosen."""


def fit_fir(lesson: Lesson, budget: Budget, progress: Progress) -> FittedBaseline:
    """Fit a FIR model; the number of taps and the ridge are chosen by validation."""
    most = lesson.window.memory_length
    matrix, right = _normal_equations(lesson, most)
    lengths = sorted({max(1, most // share) for share in SHARES})
    structures = [partial(_variants, lesson, matrix, right, taps) for taps in lengths]
    return search(structures, lesson, budget, progress)


def _normal_equations(lesson: Lesson, taps: int) -> tuple[FloatArray, FloatArray]:
    """Return A'A and A'b for rows of ``taps`` inputs, the oldest first, and a constant.

    Shapes: (taps * n_inputs + 1, the same) and (taps * n_inputs + 1, n_outputs).
    """
    outputs = lesson.training[1]
    inputs = lesson.features.along(lesson.training[0]).astype(np.float64)
    width = taps * inputs.shape[2] + 1
    matrix, right = np.zeros((width, width)), np.zeros((width, outputs.shape[2]))
    for sequence, target in zip(inputs, outputs, strict=True):
        views = np.lib.stride_tricks.sliding_window_view(sequence, taps, axis=0)
        rows = np.ones((len(views), width))
        rows[:, :-1] = views.swapaxes(1, 2).reshape(len(views), -1)
        matrix += rows.T @ rows
        right += rows.T @ target[taps:]
    return matrix, right


def _variants(
    lesson: Lesson, matrix: FloatArray, right: FloatArray, taps: int
) -> list[tuple[str, Baseline]]:
    """Fit a number of taps with every ridge: the newest inputs are in the last columns."""
    n_outputs, window = right.shape[1], Window(lesson.window.step, taps, 1)
    newest = slice(len(matrix) - 1 - taps * lesson.n_inputs, None)
    part, target = matrix[newest, newest], right[newest]
    variants: list[tuple[str, Baseline]] = []
    for ridge in RIDGES:
        damped = part + ridge * np.mean(np.diag(part)[:-1]) * np.eye(len(part))
        weights = np.linalg.solve(damped, target).T.astype(np.float32)
        layer = Layer(weights[:, :-1].copy(), weights[:, -1].copy(), "identity")
        network = FeedForward((layer,), taps, lesson.features)
        variants.append((f"{taps} taps", NetworkBaseline(network, window, n_outputs)))
    return variants
