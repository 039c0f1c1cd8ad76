"""Faults that once no test saw: they can be planted, and the tests of today see them."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest
from _pytest.mark import ParameterSet

from tests.mutation.planted import PLANTED, Planted, plant_all, verdict
from tests.mutation.trials import ROOT
from tests.refusals import refused

SOURCE = """
def larger(one, other):
    return max(one, other)
"""
TESTS = """
from source import larger

def test_larger_of_two_numbers_is_the_second_one():
    assert larger(1, 2) == 2

def test_larger_of_equal_numbers_is_either():
    assert larger(2, 2) == 2

def test_that_fails_always():
    assert larger(1, 2) == 3
"""


def variant(*values: str) -> ParameterSet:
    """Parameters of a test that ``make test`` leaves out."""
    return pytest.param(*values, marks=pytest.mark.extended)


@pytest.fixture
def place(tmp_path: Path) -> Path:
    """A repository of one source and its tests."""
    (tmp_path / "source.py").write_text(SOURCE, encoding="utf-8")
    (tmp_path / "test_source.py").write_text(TESTS, encoding="utf-8")
    return tmp_path


@pytest.mark.parametrize(
    ("faulty", "test", "expected"),
    [
        ("one", "test_larger_of_two_numbers_is_the_second_one", "seen"),
        ("one", "test_larger_of_equal_numbers_is_either", "not seen"),
        variant("one", "test_that_fails_always", "failed without the fault"),
        variant("one", "test_that_is_not_there", "broken without the fault"),
        variant("(", "test_larger_of_two_numbers_is_the_second_one", "broken with the fault"),
    ],
)
def test_fault_is_seen_where_its_test_fails_with_it_alone(
    place: Path, faulty: str, test: str, expected: str
) -> None:
    fault = Planted("source.py", "max(one, other)", faulty, f"test_source.py::{test}")
    assert verdict(place, fault) == expected
    assert (place / "source.py").read_text(encoding="utf-8") == SOURCE


def test_fault_whose_place_is_gone_is_refused(place: Path) -> None:
    fault = Planted("source.py", "min(one, other)", "one", "test_source.py")
    with refused(ValueError, "0 times 'min(one", "source.py has"):
        fault.plant(place)


@pytest.mark.parametrize("name", PLANTED)
def test_planted_fault_has_its_place_and_its_test(name: str) -> None:
    fault = PLANTED[name]
    assert (ROOT / fault.source).read_text(encoding="utf-8").count(fault.sound) == 1
    file, function = fault.test.split("::")
    tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
    assert function in [node.name for node in tree.body if isinstance(node, ast.FunctionDef)]


@pytest.mark.extended
def test_tests_of_today_see_every_planted_fault() -> None:
    assert plant_all() == 0
