"""The search for the structure of a baseline ends with its budget, or when more does not pay."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence

from slide_fmu.apps.compare.baselines.base import Baseline, Budget, FittedBaseline
from slide_fmu.apps.compare.baselines.free_run import judged
from slide_fmu.apps.compare.baselines.lesson import Lesson
from slide_fmu.core.progress import Progress, part_of

PATIENCE = 3
"""Number of successive, ever larger structures without improvement that end a search."""
GROWS = 2.0
"""Expected ratio of the times of a structure and the one before."""
PAYS = 0.99
"""A structure pays if its error is below this fraction of the best one before."""

Structure = Callable[[], Iterable[tuple[str, Baseline]]]
"""Fits the variants of one structure, each with a description of its size."""


def search(
    structures: Sequence[Structure], lesson: Lesson, budget: Budget, progress: Progress
) -> FittedBaseline:
    """Fit structures, the smallest first, and return the best in validation.

    Validation is a free simulation: a model that diverges there is taken only if all do. The first
    structure is fitted with any budget. Later ones begin only if they would not exceed it, by
    the time of the last one.
    """
    progress = part_of(progress, at_most=True)
    best, chosen, vain = (math.inf, math.inf), None, 0
    for number, structure in enumerate(structures):
        progress(number, len(structures), best[1] if chosen else None)
        begin = budget.spent
        before = best
        for words, baseline in structure():
            rank = judged(baseline, lesson.validation, lesson.window.memory_length)
            if chosen is None or rank < best:
                best, chosen = rank, (baseline, words)
        better = best[0] < before[0] or best[1] < PAYS * before[1]
        vain = 0 if better else vain + 1
        assert chosen is not None
        if vain == PATIENCE:
            break
        if number + 1 < len(structures) and budget.left < GROWS * (budget.spent - begin):
            progress(len(structures), len(structures), best[1])
            return FittedBaseline(*chosen, cut=True)
    assert chosen is not None
    progress(len(structures), len(structures), best[1])
    return FittedBaseline(*chosen, cut=False)
