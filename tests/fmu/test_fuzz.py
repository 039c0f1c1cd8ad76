"""The kept corpus of the fuzzer, and seeded changes of it, under sanitizers.

``python -m tests.fmu.fuzz`` fuzzes for longer, with guidance by coverage.
"""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from tests.fmu.driver import required_sanitizer
from tests.fmu.fuzz import CORPUS, LONGEST, build_target
from tests.limits import HANGS

pytestmark = pytest.mark.extended

RUNS = 5_000
"""Inputs changed at random."""

MOST_BYTES = 300_000
"""Of the kept corpus."""


@pytest.fixture(scope="module")
def target(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("fuzz")
    compiler = required_sanitizer(folder)
    return build_target(*compiler, folder / "target", replays=True)


def _run(target: Path, runs: int, files: list[Path]) -> int:
    """Executions; a failure shows what the sanitizers said, and the input."""
    current = target.with_name("current")
    command = [target, "1", str(runs), current, *files]
    result = subprocess.run(command, capture_output=True, text=True, check=False, timeout=HANGS)
    assert result.returncode == 0, f"{result.stderr}\ninput: {current.read_bytes().hex()}"
    return int(result.stdout)


def test_sequences_of_calls_in_the_kept_corpus_end_without_a_fault(target: Path) -> None:
    files = sorted(CORPUS.iterdir())
    sizes = [path.stat().st_size for path in files]
    assert len(files) > 100
    assert sum(sizes) < MOST_BYTES
    assert max(sizes) <= LONGEST
    assert _run(target, 0, files) == len(files)


def test_random_changes_of_the_corpus_end_without_a_fault(target: Path) -> None:
    files = sorted(CORPUS.iterdir())
    assert _run(target, RUNS, files) == len(files) + RUNS
