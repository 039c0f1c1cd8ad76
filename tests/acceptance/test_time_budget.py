"""The longest test files begin; one that takes too long fails ``make test``, with the remedy."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from tests import conftest, time_log
from tests.time_log import BUDGET_S, ESSENTIAL, LONGEST, over_budget

pytest_plugins = ["pytester"]

ROOT = Path(__file__).parents[2]
MAKEFILE = ROOT / "Makefile"
SMALL_BUDGET_S = 0.1

INI = """
[pytest]
testpaths = tests
markers = extended
"""

SLOW = f"""
import time

def test_slow():
    begin = time.process_time()
    while time.process_time() < begin + {3 * SMALL_BUDGET_S}:
        pass
"""

FAST = "def test_fast(): pass"

FOR_ALL = SLOW.replace(
    "def test_slow", "from tests.time_log import of_no_file\n\n@of_no_file()\ndef test_slow"
)
"""Slow, but what takes its time is made for all files."""


def options_of_make_test() -> list[str]:
    """The options that ``make test`` gives to pytest, with one worker."""
    text = MAKEFILE.read_text(encoding="utf-8")
    (common,) = re.findall(r"^PYTEST := .* -m pytest (.*)$", text, re.MULTILINE)
    (own,) = re.findall(r"^test: setup\n\t\$\(PYTEST\)(.*)$", text, re.MULTILINE)
    return shlex.split((common + own).replace("$(WORKERS)", "1"))


@pytest.fixture
def small(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> pytest.Pytester:
    """A folder with a slow and a fast test file, and a budget between both."""
    monkeypatch.setattr(time_log, "BUDGET_S", SMALL_BUDGET_S)
    monkeypatch.setattr(time_log, "LOGS", pytester.path / "times")
    pytester.makeini(INI)
    (pytester.path / "tests").mkdir()
    for name, text in (("slow", SLOW), ("fast", FAST)):
        (pytester.path / "tests" / f"test_{name}.py").write_text(text, encoding="utf-8")
    return pytester


def test_file_over_the_budget_is_named_and_others_are_not() -> None:
    taken = {"tests/slow.py": BUDGET_S + 1, "tests/fast.py": BUDGET_S - 1}
    (line,) = over_budget(taken)
    assert line.startswith("tests/slow.py took 46.0 s of CPU time; expected at most 45 s")


def test_make_test_runs_the_marks_that_the_budget_is_for() -> None:
    options = options_of_make_test()
    assert options[options.index("-m") + 1] == ESSENTIAL


def test_hooks_of_the_budget_are_those_of_all_tests() -> None:
    for name in (name for name in vars(time_log) if name.startswith("pytest_")):
        assert getattr(conftest, name) is getattr(time_log, name)


def test_files_that_are_to_begin_are_there_and_the_longest_begins(
    small: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert [name for name in LONGEST if not (ROOT / name).exists()] == []
    monkeypatch.setattr(time_log, "LONGEST", ("tests/test_slow.py",))
    result = small.runpytest_inprocess("-p", "tests.time_log", "--collect-only", "-q")
    assert [line for line in result.outlines if "::" in line] == [
        "tests/test_slow.py::test_slow",
        "tests/test_fast.py::test_fast",
    ]


def test_make_test_fails_with_the_name_of_a_file_over_the_budget(small: pytest.Pytester) -> None:
    result = small.runpytest_inprocess("-p", "tests.time_log", *options_of_make_test())
    result.assert_outcomes(passed=2)
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    (line,) = [line for line in result.outlines if "of CPU time; expected at most" in line]
    assert line.startswith("tests/test_slow.py took 0.")
    assert (small.path / "times" / "not_extended.json").exists()


def test_what_is_made_for_all_files_counts_for_none(small: pytest.Pytester) -> None:
    (small.path / "tests" / "test_slow.py").write_text(FOR_ALL, encoding="utf-8")
    result = small.runpytest_inprocess("-p", "tests.time_log", "-m", ESSENTIAL)
    result.assert_outcomes(passed=2)
    assert result.ret == pytest.ExitCode.OK


def test_run_of_other_marks_has_no_budget(small: pytest.Pytester) -> None:
    result = small.runpytest_inprocess("-p", "tests.time_log", "-m", "not other")
    result.assert_outcomes(passed=2)
    assert result.ret == pytest.ExitCode.OK
    result.stdout.no_fnmatch_line("*of CPU time*")
