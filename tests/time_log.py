"""Hooks of pytest for the time of test files: the longest begin, and what each took is kept.

The CPU times of all files stand in ``build/test_times`` afterwards. A run of ``make test`` fails
where a file takes more than ``BUDGET_S``. The time is that of the process and of its finished
children, so that it says the same on a busy machine. What several tests share counts for the one
that asks for it first, but for the libraries (``of_no_file``).
"""

from __future__ import annotations

import json
import os
from collections import defaultdict
from collections.abc import Generator, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

LOGS = Path(__file__).parents[1] / "build" / "test_times"
CPU = "cpu_seconds"
ESSENTIAL = "not extended"
"""The marks of ``make test``."""

BUDGET_S = 45.0
"""Largest CPU time of a file in ``make test``, in s: four times what the slowest one takes alone,
since machines differ by a factor of three. A slower file marks its longest tests ``extended``, or
shares a finished run with others."""

LONGEST = (
    "tests/acceptance/test_killed_run.py",
    "tests/fmu/test_sanitized.py",
    "tests/acceptance/test_gallery.py",
    "tests/propose/test_hard_limits.py",
    "tests/fmu/test_platforms.py",
    "tests/cosim/test_damaged_fmus.py",
    "tests/acceptance/test_readme.py",
    "tests/propose/test_proposal.py",
    "tests/acceptance/test_full_disk.py",
    "tests/fmu/test_stress.py",
    "tests/cli/test_python_calls.py",
    "tests/fmu/test_scalar_sources.py",
    "tests/acceptance/test_released.py",
    "tests/fmu/test_phases.py",
    "tests/acceptance/test_state_space_way.py",
    "tests/apps/compare/test_compare.py",
    "tests/acceptance/test_report_page.py",
    "tests/acceptance/test_your_inputs_way.py",
    "tests/propose/test_lasting_tones.py",
    "tests/validation/test_smooth_inputs.py",
)
"""Files that take longest, which run first: a worker that began one last would let the other wait.
``.ci/run`` prints those that took longest."""

_begun = pytest.StashKey[float]()
_of_no_file = [0.0]


def _cpu_seconds() -> float:
    """The CPU time of this process and its finished children, in s, without that of no file."""
    times = os.times()
    whole = times.user + times.system + times.children_user + times.children_system
    return whole - _of_no_file[0]


@contextmanager
def of_no_file() -> Iterator[None]:
    """Count the CPU time of what is done once after a change of the sources for no file."""
    begin = _cpu_seconds()
    try:
        yield
    finally:
        _of_no_file[0] += _cpu_seconds() - begin


def log_of(marks: str) -> Path:
    """The file that keeps the times of a run with these marks (``-m``)."""
    return LOGS / f"{marks.replace(' ', '_') or 'all'}.json"


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    place = {file: number for number, file in enumerate(LONGEST)}
    items.sort(key=lambda item: place.get(item.nodeid.partition("::")[0], len(LONGEST)))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, Any, Any]:
    item.stash[_begun] = _cpu_seconds()
    return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, Any, Any]:
    if call.when == "teardown":
        item.user_properties.append((CPU, _cpu_seconds() - item.stash[_begun]))
    return (yield)


def pytest_configure(config: pytest.Config) -> None:
    config.pluginmanager.register(Times(config))


class Times:
    """Gathers the times of all reports; with workers they come to the main process."""

    def __init__(self, config: pytest.Config) -> None:
        self.config = config
        self.taken: dict[str, float] = defaultdict(float)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.when == "teardown":
            file = report.nodeid.partition("::")[0]
            self.taken[file] += dict(report.user_properties).get(CPU, 0.0)

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        whole = [Path(name).name for name in self.config.args] == ["tests"]
        if whole and self.taken and not hasattr(self.config, "workerinput"):
            path = log_of(self.config.option.markexpr)
            path.parent.mkdir(parents=True, exist_ok=True)
            longest = sorted(self.taken.items(), key=lambda found: -found[1])
            path.write_text(json.dumps(dict(longest), indent=1) + "\n", encoding="utf-8")
            if self.config.option.markexpr == ESSENTIAL and over_budget(self.taken):
                session.exitstatus = pytest.ExitCode.TESTS_FAILED

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        if self.config.option.markexpr == ESSENTIAL:
            for line in over_budget(self.taken):
                terminalreporter.write_line(line, red=True)


def over_budget(taken: Mapping[str, float]) -> list[str]:
    """Return a line for each file that took more CPU time, in s, than ``BUDGET_S``."""
    return [
        f"{file} took {seconds:.1f} s of CPU time; expected at most {BUDGET_S:g} s: mark its "
        "longest tests extended, or share a finished run"
        for file, seconds in taken.items()
        if seconds > BUDGET_S
    ]
