"""ARX and NARX models are polynomials of past outputs and inputs, from sysidentpy.

Terms are chosen by forward regression with orthogonal least squares (FROLS), which looks one step
ahead, and judged in free simulation. sysidentpy has models with one output: each output has its
own model, of its own past and the past of all inputs.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from slide_fmu.apps.compare.baselines.base import Baseline, Budget, FittedBaseline, SteppedBaseline
from slide_fmu.apps.compare.baselines.lesson import Lesson
from slide_fmu.apps.compare.baselines.search import search
from slide_fmu.core.progress import Progress
from slide_fmu.core.signals import FloatArray

ARX_LAGS = (1, 2, 3, 4, 6, 8, 12, 16, 24)
"""Numbers of past samples tried for ARX models."""
NARX_SHAPES = ((2, 2), (2, 3), (3, 2), (3, 3), (4, 2), (4, 3), (6, 2), (6, 3))
"""Pairs of lags and degrees tried for NARX models."""
NARX_TERMS = (4, 8, 16, 32, 64)
"""Numbers of terms tried for each shape: FROLS ranks them once."""
MOST_TERMS = 600
"""A shape with more terms is left out, since the choice would take hours."""
MOST_VALUES = 8_000_000
"""Largest number of values of all terms to choose from, in rows at equal distances."""


class MissingPackageError(RuntimeError):
    """A package of the extra ``compare`` is not installed."""


def require_sysidentpy() -> None:
    """Raise an error if sysidentpy is missing.

    Raises:
        MissingPackageError: it is not installed; the message has the remedy.
    """
    try:
        import sysidentpy  # noqa: F401
    except ImportError as error:
        raise MissingPackageError(
            "no package 'sysidentpy' is installed, which fits ARX and NARX models; expected the "
            "extra 'compare': pip install 'slide-fmu[compare]'"
        ) from error


@final
class Polynomial(SteppedBaseline):
    """A Polynomial has one fitted sysidentpy model for each output, of the same lags."""

    def __init__(self, models: Sequence[Any], lags: int) -> None:
        self._models, self.start_length = tuple(models), lags
        self.parameters = sum(len(model.theta) for model in models)

    def simulate(self, inputs: FloatArray, start: FloatArray) -> FloatArray:
        # sysidentpy pairs y[k] with x[k - 1]: one more input is added, which no output uses
        x = np.concatenate([inputs, inputs[-1:]])
        start = np.concatenate([start, start[-1:]])  # it requires one more than it uses
        columns = [
            model.predict(X=x, y=start[:, i : i + 1]) for i, model in enumerate(self._models)
        ]
        return np.asarray(np.concatenate(columns, axis=1)[1:])

    def step_along(self, inputs: FloatArray, start: FloatArray) -> FloatArray:
        return self.simulate(inputs, start)  # it goes step by step


def fit_arx(lesson: Lesson, budget: Budget, progress: Progress) -> FittedBaseline:
    """Fit ARX models with all terms; the number of lags is chosen by validation."""
    return _fit(lesson, [(lags, 1) for lags in ARX_LAGS], budget, progress)


def fit_narx(lesson: Lesson, budget: Budget, progress: Progress) -> FittedBaseline:
    """Fit polynomial NARX models; lags, degree and terms are chosen by validation."""
    return _fit(lesson, NARX_SHAPES, budget, progress)


def _fit(
    lesson: Lesson, shapes: Sequence[tuple[int, int]], budget: Budget, progress: Progress
) -> FittedBaseline:
    n_inputs, longest = lesson.n_inputs, lesson.window.memory_length
    possible = [
        (lags, degree)
        for lags, degree in shapes
        if lags < longest and count_terms(lags, degree, n_inputs) <= MOST_TERMS
    ]
    possible.sort(key=lambda shape: count_terms(shape[0], shape[1], n_inputs))
    # the smallest shape is tried with any number of inputs
    fitting = [partial(_variants, lesson, *shape) for shape in possible or shapes[:1]]
    return search(fitting, lesson, budget, progress)


def count_terms(lags: int, degree: int, n_inputs: int) -> int:
    """Count the terms of polynomials of a degree in the lags of an output and of all inputs."""
    return math.comb(lags * (1 + n_inputs) + degree, degree)


def _variants(lesson: Lesson, lags: int, degree: int) -> list[tuple[str, Baseline]]:
    """Fit a shape with several numbers of terms; a shape of degree 1 with all terms."""
    n_outputs = lesson.n_outputs
    total = count_terms(lags, degree, lesson.n_inputs)
    counts = [total] if degree == 1 else [n for n in NARX_TERMS if n <= total]
    choices = [_Choice(lesson, output, lags, degree) for output in range(n_outputs)]
    ranks = [choice.ranked(max(counts)) for choice in choices]
    variants: list[tuple[str, Baseline]] = []
    for count in counts:
        pairs = zip(choices, ranks, strict=True)
        models = [choice.model(rank[:count]) for choice, rank in pairs]
        words = "1 lag" if lags == 1 else f"{lags} lags"
        words += f", degree {degree}, {count} terms" if degree > 1 else ""
        variants.append((words, Polynomial(models, lags)))
    return variants


@dataclass(frozen=True, eq=False)
class _Choice:
    """A _Choice is one shape of one output's model; terms are numbered as in sysidentpy."""

    lesson: Lesson
    output: int
    lags: int
    degree: int

    def empty(self) -> Any:
        """Return the sysidentpy model of this shape, without terms."""
        from sysidentpy.basis_function import Polynomial as Basis
        from sysidentpy.model_structure_selection import FROLS

        n_inputs, lags = self.lesson.n_inputs, list(range(1, self.lags + 1))
        model = FROLS(
            ylag=lags,
            xlag=lags if n_inputs == 1 else [lags] * n_inputs,
            basis_function=Basis(degree=self.degree),
            order_selection=False,
            n_terms=1,
        )
        model.n_inputs = n_inputs
        model.regressor_code = model.regressor_space(n_inputs)
        return model

    def ranked(self, count: int) -> NDArray[np.intp]:
        """Return the numbers of the ``count`` best terms, the best first."""
        model = self.empty()
        every = np.arange(len(model.regressor_code))
        if count == len(every):
            return every
        rows, target = self._rows(every)
        # FROLS leaves out one of the first targets for each lag
        padded = np.concatenate([np.zeros((self.lags, 1)), target])
        _, order, _ = model.run_mss_algorithm(rows, padded, count)
        return np.asarray(order[:count], dtype=np.intp)

    def model(self, chosen: NDArray[np.intp]) -> Any:
        """Return the sysidentpy model of some terms, with coefficients by least squares."""
        model = self.empty()
        rows, target = self._rows(chosen)
        model.final_model, model.n_terms = model.regressor_code[chosen], len(chosen)
        model.theta = np.linalg.lstsq(rows, target, rcond=None)[0]
        return model

    def _rows(self, chosen: NDArray[np.intp]) -> tuple[FloatArray, FloatArray]:
        """Return some terms, (n, n_terms), and their targets, (n, 1), in rows at equal distances.

        A fit by sysidentpy takes one sequence: joined trajectories would have rows across joints.
        """
        from sysidentpy.utils.information_matrix import build_lagged_matrix

        model, (inputs, outputs) = self.empty(), self.lesson.training
        each = outputs.shape[1] - self.lags
        stride = math.ceil(len(outputs) * each * len(chosen) / MOST_VALUES)
        parts, targets = [], []
        for sequence, output in zip(inputs, outputs[:, :, self.output, None], strict=True):
            x = np.concatenate([sequence, sequence[-1:]])
            shape = model.xlag, model.ylag, model.model_type
            lagged = build_lagged_matrix(x, output, *shape)
            order = (self.lags, model.ylag, model.xlag, model.model_type)
            parts.append(model.basis_function.fit(lagged, *order, chosen)[::stride])
            targets.append(output[self.lags :][::stride])
        return np.concatenate(parts), np.concatenate(targets)
