"""The time of work does not depend on what other programs do."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from slide_fmu.core import own_time as module
from slide_fmu.core.own_time import own_time

WORK = 0.3
"""Computing time in s."""


@pytest.mark.skipif(not module.SCHEDULED.exists(), reason="only Linux counts waits for a core")
def test_waits_for_a_core_do_not_count() -> None:
    """Three other programs want the same core: the wall clock goes on four times as fast."""
    cores = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(cores)})
    others = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(3)]
    try:
        time.sleep(0.5)  # they start
        wall, own, computed = time.perf_counter(), own_time(), time.process_time()
        while time.process_time() - computed < WORK:
            pass
        assert own_time() - own < 1.5 * WORK
        assert time.perf_counter() - wall > 1.5 * WORK
    finally:
        for other in others:
            other.kill()
            other.wait()
        os.sched_setaffinity(0, cores)


def test_waits_for_anything_else_count() -> None:
    begin = own_time()
    time.sleep(0.2)
    assert own_time() - begin > 0.15


def test_wall_clock_serves_where_waits_are_not_known(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "SCHEDULED", Path("no") / "such" / "file")
    assert abs(own_time() - time.perf_counter()) < 0.1
