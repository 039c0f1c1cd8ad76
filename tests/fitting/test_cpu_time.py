"""The CPU time of a training, over its interruptions."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from slide_fmu.core.progress import Progress
from slide_fmu.core.result_cache import DamagedFileError
from slide_fmu.fitting import checkpoint
from slide_fmu.fitting.checkpoint import CpuTime
from tests.refusals import refused


def work(seconds: float) -> None:
    """Use the processor."""
    end = time.process_time() + seconds
    while time.process_time() < end:
        pass


def heard(calls: list[tuple[object, ...]]) -> Progress:
    """A progress that keeps what it is called with."""
    return lambda *arguments: calls.append(arguments)


def test_time_of_a_training_that_was_killed_counts_up_to_its_last_progress(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(checkpoint, "WRITE_EVERY", 0.01)
    place, calls = tmp_path / "checkpoints" / "x.cpu_seconds", []
    first = CpuTime(place)
    progress = first.counted(lambda _: heard(calls))("training")
    work(0.05)
    progress(1, 2, 0.5)
    work(0.2)  # lost, as what was learnt in it
    again = CpuTime(place)
    assert calls == [(1, 2, 0.5)]
    assert 0.05 <= again.seconds < 0.2
    work(0.05)
    assert again.keep() == pytest.approx(CpuTime(place).seconds, abs=0.01)
    assert CpuTime(place).seconds >= 0.1


def test_sleep_is_no_cpu_time(tmp_path: Path) -> None:
    clock = CpuTime(tmp_path / "x.cpu_seconds")
    time.sleep(0.2)
    assert clock.keep() < 0.1


@pytest.mark.parametrize("damaged", [b"", bytes(range(256)), b"soon"])
def test_damaged_file_of_the_time_is_named(tmp_path: Path, damaged: bytes) -> None:
    (tmp_path / "x.cpu_seconds").write_bytes(damaged)
    with refused(DamagedFileError, "x.cpu_seconds is damaged", "remove it"):
        CpuTime(tmp_path / "x.cpu_seconds")
