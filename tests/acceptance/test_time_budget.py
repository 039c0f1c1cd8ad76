"""A test file that takes too long fails ``make test``, and is named with the remedy."""

from __future__ import annotations

from tests.time_log import BUDGET_S, over_budget


def test_file_over_the_budget_is_named_and_others_are_not() -> None:
    taken = {"tests/slow.py": BUDGET_S + 1, "tests/fast.py": BUDGET_S - 1}
    (line,) = over_budget(taken)
    assert line.startswith("tests/slow.py took 31.0 s of CPU time; expected at most 30 s")
