"""Records answer every question that is asked of sources."""

from __future__ import annotations

import ast
from importlib import import_module
from pathlib import Path

import pytest

import slide_fmu
from slide_fmu.data.answers import Question, asked_of_sources
from slide_fmu.records import answers
from slide_fmu.records.model import MeasuredRecords
from slide_fmu.systems.base import Source, System
from tests.memory.plain_systems import Lag
from tests.refusals import refused

PACKAGE = Path(slide_fmu.__file__).parent


def questions() -> list[tuple[str, str]]:
    """Name all functions that have the mark, by their module and their name."""
    mark, found = asked_of_sources.__name__, []
    for path in sorted(PACKAGE.rglob("*.py")):
        text = path.read_text("utf-8")
        if mark in text:  # few have it, and parsing all takes a second
            module = ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts)
            found += [
                (module, node.name)
                for node in ast.walk(ast.parse(text))
                if isinstance(node, ast.FunctionDef)
                and any(ast.unparse(one) == mark for one in node.decorator_list)
            ]
    return found


@pytest.mark.parametrize(("module", "name"), questions())
def test_records_answer_every_question(module: str, name: str) -> None:
    assert MeasuredRecords.answered_in == answers.__name__
    question = getattr(import_module(module), name)
    assert isinstance(question, Question)
    assert question.is_answered_for(MeasuredRecords)


@asked_of_sources
def whose(system: System, more: str) -> str:
    return f"a system, {more}"


class Other(Source):
    """A source that answers by a function of its own, in this module."""

    answered_in = __name__


class Silent(Source):
    """A source that answers nothing."""


@whose.register(Other)
def of_others(source: Other, more: str) -> str:
    return f"another source, {more}"


def test_each_kind_of_source_has_its_own_answer() -> None:
    assert whose(Lag(), "asked") == "a system, asked"
    assert whose(Other(), more="asked") == "another source, asked"
    with refused(TypeError, "Silent", "whose"):
        whose(Silent(), "asked")
