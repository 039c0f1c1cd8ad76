"""Several programs make the trajectories of one store together."""

from __future__ import annotations

import os
import threading
from dataclasses import replace
from pathlib import Path

import pytest

from slide_fmu.data.claims import claimed
from slide_fmu.data.generation import generate
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import SPLITS
from tests.data.test_generation import (
    LONG,
    PROBED,
    SMALL,
    WORKERS,
    Inline,
    Scene,
    assert_complete,
    identities,
    kill,
    wait_until,
)
from tests.limits import HANGS
from tests.progress import silent
from tests.store_digest import store_digest


@pytest.mark.extended
def test_trajectory_that_another_process_makes_is_waited_for_and_made_should_it_fail(
    tmp_path: Path,
) -> None:
    path, total = tmp_path / "s", sum(SMALL.count(split) for split in SPLITS)
    shown: list[int] = []
    made: list[int] = []
    with claimed(path, "train", 1):
        work = threading.Thread(
            target=lambda: made.append(
                generate(case_of(SMALL), path, Inline(), lambda done, _: shown.append(done))
            )
        )
        work.start()
        wait_until(lambda: bool(shown) and shown[-1] == total - 1, "the others are not made")
        work.join(0.5)
        assert work.is_alive()
    work.join(HANGS)
    assert made == [total]
    assert_complete(SMALL, path)


@pytest.mark.extended
def test_trajectory_that_another_process_finishes_is_not_made_again(tmp_path: Path) -> None:
    path, whole = tmp_path / "s", tmp_path / "whole"
    generate(case_of(SMALL), whole, None, silent)
    made: list[int] = []
    with claimed(path, "train", 1):
        work = threading.Thread(
            target=lambda: made.append(generate(case_of(SMALL), path, Inline(), silent))
        )
        work.start()
        there = path / "beyond" / "done" / "c" / "1"
        wait_until(there.exists, "the others are not made")
        for name in ("inputs", "outputs", "kinds", "done"):
            file = whole / "train" / name / "c" / "1"
            target = path / "train" / name / "c" / "1"
            if file.exists():
                target.parent.mkdir(parents=True, exist_ok=True)
                os.rename(file, target)
    work.join(HANGS)
    assert made == [13]
    assert_complete(SMALL, path)


@pytest.mark.extended
@pytest.mark.skipif(not Path("/proc").is_dir(), reason="looks for workers in /proc")
def test_two_processes_share_the_work_of_one_store(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They log into files of their own."""
    one, other = Scene(tmp_path), replace(Scene(tmp_path), name="other")
    processes = [one.start(), other.start()]
    assert [process.wait(HANGS) for process in processes] == [0, 0]
    lines = one.lines(), other.lines()
    assert min(map(len, lines)) > 5
    assert sorted(lines[0] + lines[1]) == sorted(identities().values())
    monkeypatch.setenv("SLIDE_FMU_TEST_LOG", str(tmp_path / "unbroken_log"))
    generate(case_of(LONG), tmp_path / "unbroken", Inline(), silent)
    assert store_digest(one.store) == store_digest(tmp_path / "unbroken")


@pytest.mark.extended
@pytest.mark.skipif(not Path("/proc").is_dir(), reason="looks for workers in /proc")
def test_process_that_is_killed_blocks_no_other_and_repeats_nothing(tmp_path: Path) -> None:
    killed, other = Scene(tmp_path), replace(Scene(tmp_path), name="other")
    process, survivor = killed.start(), other.start()
    wait_until(lambda: len(killed.lines()) >= 5, "no simulations")
    kill(process)
    assert survivor.wait(HANGS) == 0
    lines = killed.lines() + other.lines()
    assert PROBED not in lines
    assert set(lines) == set(identities().values())
    assert len(lines) - len(set(lines)) <= WORKERS
    assert len(killed.done()) == len(identities())
