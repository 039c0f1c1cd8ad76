"""A trajectory is simulated by one process at a time, and none that was killed blocks another."""

from __future__ import annotations

import errno
import fcntl
import os
import subprocess
import sys
from pathlib import Path

import pytest

from slide_fmu.data.claims import ClaimError, claimed, claims_folder
from tests.limits import HANGS
from tests.refusals import refused

HOLDER = """
import sys, time
from pathlib import Path
from slide_fmu.data.claims import claimed
with claimed(Path(sys.argv[1]), "train", 3) as free:
    print(free, flush=True)
    time.sleep(60)
"""


def test_claim_is_refused_while_another_process_has_it_and_free_when_that_is_killed(
    tmp_path: Path,
) -> None:
    store = tmp_path / "store"
    other = subprocess.Popen(
        [sys.executable, "-c", HOLDER, str(store)], stdout=subprocess.PIPE, text=True
    )
    try:
        assert other.stdout is not None
        assert other.stdout.readline() == "True\n"
        with claimed(store, "train", 3) as free:
            assert not free
        with claimed(store, "train", 4) as free, claimed(store, "validation", 3) as too:
            assert free
            assert too
    finally:
        other.kill()
        other.communicate(timeout=HANGS)
    assert (claims_folder(store) / "train_3").exists()
    with claimed(store, "train", 3) as free:
        assert free


def test_claim_leaves_no_file_behind_also_where_the_work_fails(tmp_path: Path) -> None:
    store = tmp_path / "store"
    with pytest.raises(KeyError), claimed(store, "train", 0):
        raise KeyError
    assert list(claims_folder(store).iterdir()) == []


def test_disk_without_locks_is_named_with_the_remedy(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def none(*_: object) -> None:
        raise OSError(errno.ENOSYS, os.strerror(errno.ENOSYS))

    monkeypatch.setattr(fcntl, "flock", none)
    with (
        refused(ClaimError, "claims' lies", "-o flock"),
        claimed(tmp_path / "store", "train", 0),
    ):
        pass
