"""Marks that several test files give."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest
from _pytest.mark import ParameterSet

APPS = Path(__file__).parents[1] / "slide_fmu" / "apps"


def essential(names: Iterable[str], *kept: str) -> list[str | ParameterSet]:
    """Return all names as parameters of a test; those that are not kept are ``extended``.

    ``make test`` runs the kept ones alone, so a test that is slow in its many variants still
    runs there with a few of them.

    Raises:
        ValueError: a kept name is not among the names, so nothing would be kept for it.
    """
    listed = list(names)
    unknown = sorted(set(kept) - set(listed))
    if unknown:
        raise ValueError(f"kept = {unknown}; expected some of {listed}")
    return [
        name if name in kept else pytest.param(name, marks=pytest.mark.extended) for name in listed
    ]


def first(cases: Iterable[Any], count: int = 1) -> list[Any]:
    """Return all cases as parameters of a test; those after the first ones are ``extended``."""
    listed = list(cases)
    return listed[:count] + [_extended(case) for case in listed[count:]]


def every(n: int, cases: Iterable[Any]) -> list[Any]:
    """Return all cases as parameters of a test; all but every nth one are ``extended``."""
    return [case if index % n == 0 else _extended(case) for index, case in enumerate(cases)]


def _extended(case: Any) -> ParameterSet:
    values = case if isinstance(case, tuple) else (case,)
    return pytest.param(*values, marks=pytest.mark.extended)


def needs_app(name: str) -> pytest.MarkDecorator:
    """Return the mark of a test that holds only where an app of slide-fmu is installed."""
    there = (APPS / name / "__init__.py").exists()
    return pytest.mark.skipif(not there, reason=f"the app {name} was removed")


def of_app(subcommand: str, app: str) -> ParameterSet:
    """Return a subcommand of an app as a parameter of a test."""
    return pytest.param(subcommand, marks=needs_app(app))
