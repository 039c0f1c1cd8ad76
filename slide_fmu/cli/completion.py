"""Shells complete words by running the command, so this must be fast."""

from __future__ import annotations

from contextlib import suppress


def quick_completion() -> None:
    """Let completions show help texts unchanged.

    The texts of this package have no markup. Typer would look for markup with the Markdown parser
    of rich, whose import takes as long as the rest of a completion. A version of typer without
    this function completes correctly, only more slowly.
    """
    with suppress(ImportError):
        from typer import _completion_classes

        _completion_classes._sanitize_help_text = _as_it_is


def _as_it_is(text: str) -> str:
    return text
