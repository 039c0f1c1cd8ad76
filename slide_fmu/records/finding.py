"""What is found in records, for people and for whoever decides."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Severity = Literal["refused", "remarked"]


@dataclass(frozen=True)
class Finding:
    """A Finding is one thing that is wrong with a record, or that one should know about it.

    Attributes:
        kind: a word for it, such as ``"gap"`` or ``"saturation"``.
        severity: ``"refused"`` where nothing can be learnt before it is mended, else
            ``"remarked"``.
        path: the file.
        column: the column; empty where it is about several.
        found: what was found, with figures.
        expected: what was expected.
        remedy: what to do.
    """

    kind: str
    severity: Severity
    path: str
    column: str
    found: str
    expected: str
    remedy: str

    @property
    def message(self) -> str:
        """Say it in one sentence."""
        column = f", column {self.column!r}" if self.column else ""
        return f"{self.path}{column}: {self.found}; expected {self.expected}: {self.remedy}"
