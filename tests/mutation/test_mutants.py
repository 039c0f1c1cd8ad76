"""Mutants: one fault each, in what runs, and no other."""

from __future__ import annotations

import ast

import pytest

from tests.mutation.mutants import c_mutants
from tests.mutation.python_mutants import python_mutants
from tests.mutation.run import MODULES, label, mutants_of, sample_of
from tests.mutation.trials import ROOT

PYTHON = '''
def bounded(value: int = 1 + 1) -> int:
    """2 + 2 in a docstring."""
    if value < 3 and value:
        raise ValueError(f"{value + 1}; expected " + "3 + 3")
    return max(value, 7)
'''
PYTHON_FAULTS = [
    "value < 3 and value -> value < 3 or value",
    "value < 3 and value -> value < 3",
    "value < 3 -> value <= 3",
    "3 -> 4",
    "max(value, 7) -> min(value, 7)",
    "max(value, 7) -> value",
    "max(value, 7) -> 7",
    "7 -> 8",
]

C = """#define ONE 1 + 1
/* 1 + 1 in a
   comment < 2 */
static int next(const int *a, int b) {
    return a[b] >= -b ? *a + 1.0 : 0; /* 1 */
}
"""
C_FAULTS = [
    "return a[b] [>= -> >] -b ? *a + 1.0 : 0; /* 1 */",
    "return a[b] >= -b ? *a [+ -> -] 1.0 : 0; /* 1 */",
    "return a[b] >= -b ? *a + 1.0 : [0 -> 1]; /* 1 */",
]


def test_python_mutants_are_all_faults_outside_messages_and_defaults() -> None:
    assert [mutant.fault for mutant in python_mutants(PYTHON)] == PYTHON_FAULTS


def test_c_mutants_are_all_faults_outside_comments_and_directives() -> None:
    mutants = list(c_mutants(C))
    assert [mutant.fault for mutant in mutants] == C_FAULTS
    assert {mutant.line for mutant in mutants} == {5}


@pytest.mark.extended
@pytest.mark.parametrize("name", MODULES)
def test_every_mutant_of_a_module_is_another_program(name: str) -> None:
    module = MODULES[name]
    assert all((ROOT / test).is_file() for test in module.tests)
    for source in module.sources:
        text = (ROOT / source).read_text(encoding="utf-8")
        found = [mutant.text for _, mutant in mutants_of(source, text)]
        assert len(found) > 5
        if source.endswith(".py"):
            programs = {ast.dump(ast.parse(mutant)) for mutant in found}
            assert ast.dump(ast.parse(text)) not in programs
            assert len(programs) > 0.95 * len(found)  # max(a, b) -> a may come twice
        else:
            assert text not in found
            assert len(set(found)) == len(found)


def test_sample_is_the_same_for_a_seed_and_of_the_former_survivors_alone() -> None:
    found = [("a.c", mutant) for mutant in c_mutants(C)]
    whole = sample_of(found, 1, None, None)
    assert sample_of(found, 1, 2, None) == whole[:2]
    assert sorted(map(str, whole)) == sorted(map(str, found))
    assert sample_of(found, 0, None, None) != whole
    assert sample_of(found, 1, 2, [label(*whole[1]), label(*whole[2])]) == [whole[1]]
