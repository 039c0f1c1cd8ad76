"""Shells complete what is typed by running the command, so that must be quick."""

from __future__ import annotations

from contextlib import suppress


def quick_completion() -> None:
    """Let completions show help texts as they are.

    The texts of this package hold no markup. Typer would look for some by the Markdown parser of
    rich, whose import takes as long as all the rest of a completion. A version of typer that has
    no such function completes as well, only later.
    """
    with suppress(ImportError):
        from typer import _completion_classes

        _completion_classes._sanitize_help_text = _as_it_is


def _as_it_is(text: str) -> str:
    return text
