"""A validation by several processes: the same figures, and only where it is worth them."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace
from itertools import chain, repeat
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from slide_fmu.recipe.case import case_of
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation import validate as validation
from slide_fmu.validation.results import Validation
from slide_fmu.validation.validate import validate
from tests.progress import silent
from tests.validation.tiny_validation import FINER, PLAIN, TASK, measured, same


@pytest.mark.extended
def test_validation_by_several_processes_measures_the_same(
    fmu: Path, surrogate: Surrogate, finer: Validation, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(validation, "WORTH_PROCESSES", 0.0)
    calls: list[tuple[int, int]] = []
    found = validate(
        fmu, surrogate, case_of(FINER), TASK, lambda *numbers: calls.append(numbers), workers=2
    )
    assert calls == [(done, 3) for done in range(4)]
    assert len(found.comparisons) == 3
    for one, other in zip(found.comparisons, finer.comparisons, strict=True):
        assert same(one, other)
        assert np.array_equal(one.model, other.model)


def test_validation_with_little_work_starts_no_processes(
    fmu: Path, surrogate: Surrogate, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(validation, "process_pool", None)
    assert len(measured(fmu, surrogate, PLAIN, workers=None).comparisons) == 3


def test_validation_of_few_trajectories_needs_no_second_one(
    fmu: Path, surrogate: Surrogate
) -> None:
    task = replace(TASK, trajectories=1)
    found = validate(fmu, surrogate, case_of(FINER), task, silent, workers=None)
    assert len(found.comparisons) == 1


@pytest.mark.parametrize(
    ("workers", "cores", "expected"),
    [(7, 1, 2), (None, 2, 2), (None, 8, 2), (None, None, 1), (1, 8, 1), (2, 1, 2)],
)
def test_worker_processes_are_at_most_the_trajectories_after_the_first(
    fmu: Path,
    surrogate: Surrogate,
    monkeypatch: pytest.MonkeyPatch,
    workers: int | None,
    cores: int | None,
    expected: int,
) -> None:
    """Of three trajectories the first one is measured before; one worker is this process."""
    started: list[int] = []

    monkeypatch.setattr(validation, "WORTH_PROCESSES", 0.0)
    monkeypatch.setattr(validation.os, "cpu_count", lambda: cores)
    monkeypatch.setattr(validation, "process_pool", lambda n, *_: nullcontext(started.append(n)))
    monkeypatch.setattr(validation, "in_parallel", lambda *work: [])
    measured(fmu, surrogate, PLAIN, workers=workers)
    assert started == ([] if expected == 1 else [expected])


@pytest.mark.parametrize(("seconds", "starts"), [(4.9, 0), (5.1, 1)])
def test_worker_processes_start_where_the_rest_of_the_work_is_long(
    fmu: Path,
    surrogate: Surrogate,
    monkeypatch: pytest.MonkeyPatch,
    seconds: float,
    starts: int,
) -> None:
    """Two trajectories of so many seconds each are left, and ten seconds are worth processes."""
    started: list[int] = []
    clock = chain([100.0, 100.0 + seconds], repeat(200.0))  # around the first trajectory
    times = SimpleNamespace(process_time=lambda: next(clock), perf_counter=lambda: 0.0)
    monkeypatch.setattr(validation, "WORTH_PROCESSES", 10.0)
    monkeypatch.setattr(validation, "time", times)
    monkeypatch.setattr(validation, "process_pool", lambda *_: nullcontext())
    monkeypatch.setattr(
        validation, "in_parallel", lambda *work: started.append(len(work[2])) or []
    )
    found = measured(fmu, surrogate, PLAIN, workers=2)
    assert started == [2] * starts
    assert len(found.comparisons) == (1 if starts else 3)
