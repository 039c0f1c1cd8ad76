"""Some questions have another answer where nothing is simulated: for measured records.

A room asks such a question by a function about a system, marked ``asked_of_sources``. The
caller may have any ``Source``. A source that is not a system names its own answers in the table
``answers_elsewhere``. An answer is imported when it is first needed, so that the simulation of
models does not depend on it.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from importlib import import_module
from typing import Concatenate, ParamSpec, TypeVar, cast

from slide_fmu.systems.base import Source, System

Arguments = ParamSpec("Arguments")
Answer = TypeVar("Answer")


def asked_of_sources(
    of_systems: Callable[Concatenate[System, Arguments], Answer],
) -> Callable[Concatenate[Source, Arguments], Answer]:
    """Make a question that any source can be asked of a function that answers it for systems.

    Another source gives the answer that ``source.answers_elsewhere`` names for this function, as
    ``"package.module:function"``; it has the same parameters.
    """
    question = f"{of_systems.__module__}:{of_systems.__name__}"

    @wraps(of_systems)
    def asked(source: Source, /, *args: Arguments.args, **named: Arguments.kwargs) -> Answer:
        place = source.answers_elsewhere.get(question)
        if place is None:
            if not isinstance(source, System):
                raise TypeError(f"{type(source).__name__}: no answer to {question!r}")
            return of_systems(source, *args, **named)
        module, _, function = place.partition(":")
        return cast(Answer, getattr(import_module(module), function)(source, *args, **named))

    return asked
