"""Parameters as functions and models of the user find them: p.name."""

from __future__ import annotations

from types import SimpleNamespace
from typing import NoReturn

from slide_fmu.core.suggestions import or_meant


class Parameters(SimpleNamespace):
    """Parameters are attributes; who asks for another one, or in brackets, is told so."""

    def __getitem__(self, name: object) -> NoReturn:
        raise TypeError(f"p[{name!r}]; expected p.{name}: parameters are attributes")

    def __getattr__(self, name: str) -> NoReturn:
        known = list(vars(self))
        raise AttributeError(
            f"p has no parameter {name!r}; expected one of {known}{or_meant(name, known)}"
        )
