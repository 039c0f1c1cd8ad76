"""Records answer every question that is asked of sources, with the same parameters."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path
from types import MappingProxyType
from typing import Any

import pytest

import slide_fmu
from slide_fmu.data.answers import asked_of_sources
from slide_fmu.records.answer_table import ANSWERS
from slide_fmu.systems.base import Source, System
from tests.memory.plain_systems import Lag
from tests.refusals import refused

PACKAGE = Path(slide_fmu.__file__).parent


def questions() -> Iterator[str]:
    """Name all functions that have the mark, as their module and their name."""
    for path in sorted(PACKAGE.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            marks = getattr(node, "decorator_list", [])
            if any(ast.unparse(mark) == asked_of_sources.__name__ for mark in marks):
                module = ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts)
                yield f"{module}:{node.name}"  # type: ignore[attr-defined]


def function_at(place: str) -> Callable[..., Any]:
    """Import a function by its place."""
    module, _, name = place.partition(":")
    found: Callable[..., Any] = getattr(import_module(module), name)
    return found


def test_table_has_every_question_and_no_other() -> None:
    assert sorted(ANSWERS) == sorted(questions())


@pytest.mark.parametrize(("question", "answer"), ANSWERS.items())
def test_answer_has_the_parameters_of_its_question(question: str, answer: str) -> None:
    asked, own = (inspect.signature(function_at(place)) for place in (question, answer))
    (_, *wanted), (_, *found) = asked.parameters.values(), own.parameters.values()
    assert [(p.name, p.annotation, p.default) for p in found] == [
        (p.name, p.annotation, p.default) for p in wanted
    ]


@asked_of_sources
def whose(system: System, more: str) -> str:
    return f"a system, {more}"


def of_others(source: Source, more: str) -> str:
    """Answer for the source below."""
    return f"another source, {more}"


class Other(Source):
    answers_elsewhere = MappingProxyType({f"{__name__}:whose": f"{__name__}:of_others"})


def test_system_answers_where_it_is_asked() -> None:
    assert whose(Lag(), "asked") == "a system, asked"


def test_other_source_answers_by_its_own_function() -> None:
    assert whose(Other(), more="asked") == "another source, asked"


class Silent(Source):
    """A source that answers nothing."""


def test_source_without_an_answer_is_an_error() -> None:
    with refused(TypeError, "Silent", "whose"):
        whose(Silent(), "asked")
