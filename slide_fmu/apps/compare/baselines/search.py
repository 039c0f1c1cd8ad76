"""The search for the structure of a baseline ends with its budget, or where more does not pay."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence

from slide_fmu.apps.compare.baselines.base import Baseline, Budget, Learnt
from slide_fmu.apps.compare.baselines.free_run import judged
from slide_fmu.apps.compare.baselines.lesson import Lesson
from slide_fmu.core.progress import Progress, part_of

PATIENCE = 3
"""A search ends when so many structures in turn, larger and larger ones, have brought nothing."""
GROWS = 2.0
"""The next structure may take so many times as long as the last one."""
PAYS = 0.99
"""A structure pays when its error is below this part of the best one before."""

Structure = Callable[[], Iterable[tuple[str, Baseline]]]
"""Fits the variants of one structure, each with its size in words."""


def search(
    structures: Sequence[Structure], lesson: Lesson, budget: Budget, progress: Progress
) -> Learnt:
    """Fit structures, the smallest first, and return what is best in validation.

    Validation is a free simulation, so that a model that diverges there is taken only where all
    do. The first structure is fitted whatever the budget says. None begins that would exceed it,
    by what the last one took.
    """
    progress = part_of(progress, at_most=True)
    best, found, vain = (math.inf, math.inf), None, 0
    for number, structure in enumerate(structures):
        progress(number, len(structures), best[1] if found else None)
        begin = budget.spent
        before = best
        for words, baseline in structure():
            rank = judged(baseline, lesson.validation, lesson.window.memory_length)
            if found is None or rank < best:
                best, found = rank, (baseline, words)
        better = best[0] < before[0] or best[1] < PAYS * before[1]
        vain = 0 if better else vain + 1
        assert found is not None
        if vain == PATIENCE:
            break
        if number + 1 < len(structures) and budget.left < GROWS * (budget.spent - begin):
            progress(len(structures), len(structures), best[1])
            return Learnt(*found, cut=True)
    assert found is not None
    progress(len(structures), len(structures), best[1])
    return Learnt(*found, cut=False)
