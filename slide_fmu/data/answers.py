"""Some questions have another answer where nothing is simulated: for measured records.

A room asks such a question by a function about a system, marked ``asked_of_sources``; the caller
may have any ``Source``. A source that is not a system registers its own answers, by
``@question.register(Kind)``, in the module ``Source.answered_in``. This module is imported with
the first question, so that the simulation of models does not depend on it.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import singledispatch, update_wrapper
from importlib import import_module
from typing import Concatenate, Generic, ParamSpec, TypeVar, final

from slide_fmu.systems.base import Source, System

Arguments = ParamSpec("Arguments")
Answer = TypeVar("Answer")
Kind = TypeVar("Kind", bound=Source)


@final
class Question(Generic[Arguments, Answer]):
    """A Question is a function of a source, with one answer for each kind of source."""

    def __init__(self, of_systems: Callable[Concatenate[System, Arguments], Answer]) -> None:
        update_wrapper(self, of_systems)

        def unanswered(source: Source, *_: object, **__: object) -> Answer:
            name = f"{of_systems.__module__}.{of_systems.__name__}"
            raise TypeError(f"{type(source).__name__}: no answer to {name}")

        self._answers = singledispatch(unanswered)
        self._answers.register(System, of_systems)

    def __call__(
        self, source: Source, /, *arguments: Arguments.args, **named: Arguments.kwargs
    ) -> Answer:
        """Return the answer for a source.

        Raises:
            TypeError: the source is of a kind that has none.
        """
        if source.answered_in is not None:
            import_module(source.answered_in)
        answer: Answer = self._answers(source, *arguments, **named)
        return answer

    def register(
        self, kind: type[Kind]
    ) -> Callable[
        [Callable[Concatenate[Kind, Arguments], Answer]],
        Callable[Concatenate[Kind, Arguments], Answer],
    ]:
        """Mark a function as the answer for a kind of source."""

        def registered(
            answer: Callable[Concatenate[Kind, Arguments], Answer],
        ) -> Callable[Concatenate[Kind, Arguments], Answer]:
            self._answers.register(kind, answer)
            return answer

        return registered

    def is_answered_for(self, kind: type[Source]) -> bool:
        """Tell whether a kind of source has an answer of its own."""
        return kind in self._answers.registry


def asked_of_sources(
    of_systems: Callable[Concatenate[System, Arguments], Answer],
) -> Question[Arguments, Answer]:
    """Make a question, which any source can be asked, of a function that answers for systems."""
    return Question(of_systems)
