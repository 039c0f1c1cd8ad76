"""A fit of several runs that is broken off anywhere ends as an unbroken one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest
import torch

from slide_fmu.core.progress import Progress
from slide_fmu.core.result_cache import DamagedFileError
from slide_fmu.fitting.checkpoint import write_checkpoint
from slide_fmu.fitting.errors import TrainingError
from slide_fmu.fitting.state_space import ledger as module
from slide_fmu.fitting.state_space.ledger import Ledger
from tests.progress import silent
from tests.refusals import refused

CPU = torch.device("cpu")
RUNS = {"first": 4, "second": 7, "third": 3}
"""Iterations of each run; the second finishes after five."""
TOTAL = 4 + 5 + 3


@dataclass(frozen=True, eq=False)
class Wandering:
    """Numbers that tell every bit of the way that led to them."""

    theta: torch.Tensor
    best_error: float = float("inf")
    finished: bool = False
    history: tuple[tuple[int, float], ...] = ()


def advance(state: Wandering) -> Wandering:
    theta = torch.sin(3 * state.theta) + 0.1
    history = (*state.history, (len(state.history), float(theta[0])))
    return replace(
        state, theta=theta, best_error=float(theta[1]), finished=len(history) == 5, history=history
    )


class Broken(Exception):
    pass


def fit(
    path: Path,
    progress: Progress = silent,
    step: Callable[[Wandering], Wandering] = advance,
) -> list[Wandering]:
    """Three runs, each starting where the one before ended."""
    ledger = Ledger(path, CPU, progress)
    theta, ends = torch.tensor([0.3, 0.7, 0.9], dtype=torch.float64), []
    for name, iterations in RUNS.items():
        ends.append(ledger.run(name, Wandering(theta), step, iterations))
        theta = ends[-1].theta
    return ends


@pytest.mark.parametrize("store_every", [0.0, 1e9])
@pytest.mark.parametrize("broken_at", range(1, TOTAL + 1))
def test_broken_fit_goes_on_without_a_trace(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, broken_at: int, store_every: float
) -> None:
    monkeypatch.setattr(module, "STORE_EVERY", store_every)

    def stop(done: int, total: int, error: float | None = None) -> None:
        if done == broken_at:
            raise Broken

    with pytest.raises(Broken):
        fit(tmp_path / "c.pt", stop)
    reported: list[int] = []
    found = fit(tmp_path / "c.pt", lambda done, total, error=None: reported.append(done))
    for end, expected in zip(found, fit(tmp_path / "other.pt"), strict=True):
        assert torch.equal(end.theta, expected.theta)
        assert (end.best_error, end.finished, end.history) == (
            expected.best_error,
            expected.finished,
            expected.history,
        )
    assert reported == list(range(TOTAL - len(reported) + 1, TOTAL + 1))
    # stored after every iteration, or at the ends of the runs alone
    ends = [0, 4, 9, 12]
    stored = broken_at if store_every == 0 else max(end for end in ends if end < broken_at)
    assert len(reported) == TOTAL - stored


def test_finished_fit_is_not_repeated(tmp_path: Path) -> None:
    def never(state: Wandering) -> Wandering:
        raise AssertionError("this run has been done")

    def unheard(done: int, total: int, error: float | None = None) -> None:
        raise AssertionError("no iteration has been done")

    first = fit(tmp_path / "c.pt")
    second = fit(tmp_path / "c.pt", unheard, never)
    assert all(torch.equal(a.theta, b.theta) for a, b in zip(first, second, strict=True))
    assert [path.name for path in tmp_path.iterdir()] == ["c.pt"]


def test_every_iteration_of_all_runs_is_reported(tmp_path: Path) -> None:
    reported: list[int] = []
    fit(tmp_path / "folder" / "c.pt", lambda done, total, error=None: reported.append(done))
    assert reported == list(range(1, TOTAL + 1))


class Stage:
    """Keeps what is heard of each part of a stage."""

    def __init__(self, name: str, bars: dict[str, list[tuple[int, int]]]) -> None:
        self.bars, self.heard = bars, bars.setdefault(name, [])

    def __call__(self, done: int, total: int, error: float | None = None) -> None:
        self.heard.append((done, total))

    def part(self, name: str, at_most: bool) -> Progress:
        assert at_most
        return Stage(name, self.bars)


def test_part_has_its_greatest_total_and_ends_with_the_work(tmp_path: Path) -> None:
    """The total does not move, also of a fit that goes on, whatever runs its file has already."""
    for _ in range(2):
        bars: dict[str, list[tuple[int, int]]] = {}
        ledger = Ledger(tmp_path / "c.pt", CPU, Stage("stage", bars))
        theta = torch.tensor([0.3, 0.7, 0.9], dtype=torch.float64)
        ledger.plan(RUNS["first"] + RUNS["second"], "search")
        for name, iterations in RUNS.items():
            if name == "third":
                ledger.plan(iterations)
            theta = ledger.run(name, Wandering(theta), advance, iterations).theta
        ledger.finish()
        search, last = bars["search"], bars[""]
        assert {total for _, total in search[:-1]} == {11}
        assert search[-1] == (9, 9)
        assert {total for _, total in last} == {3}
        assert last[-1] == (3, 3)
        assert [done for done, _ in search] == sorted(done for done, _ in search)
        assert not bars["stage"]


def test_finished_start_is_left_alone(tmp_path: Path) -> None:
    start = Wandering(torch.ones(2), finished=True)
    assert Ledger(tmp_path / "c.pt", CPU, silent).run("one", start, advance, 5) is start


@pytest.mark.parametrize("part", [0.0, 0.3, 0.99])
def test_damaged_ledger_is_refused_with_its_remedy(tmp_path: Path, part: float) -> None:
    path = tmp_path / "c.pt"
    fit(path)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(part * len(whole))])
    with refused(DamagedFileError, "c.pt is damaged", "train from"):
        fit(path)


OTHER: dict[str, Any] = {
    "list": [1, 2],
    "feed-forward training": {"step": 3, "history": [], "best": None},
    "older": {
        "first": {"iterations": 1, "state": {"angle": torch.ones(2), "finished": True}},
    },
}
"""Content of checkpoints that are no ledger of this version."""


@pytest.mark.parametrize("content", OTHER.values(), ids=OTHER)
def test_ledger_of_another_version_is_refused_with_its_remedy(
    tmp_path: Path, content: Any
) -> None:
    path = tmp_path / "c.pt"
    write_checkpoint(path, content)
    with refused(TrainingError, "c.pt cannot be read", "train from"):
        fit(path)
