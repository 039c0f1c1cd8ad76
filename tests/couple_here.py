"""Coupled runs in this program, whose times are those of the method, without another program."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from slide_fmu.apps.couple.options import CouplingOptions
from slide_fmu.apps.couple.result import CoupledRun
from slide_fmu.apps.couple.run import run_here
from slide_fmu.apps.couple.structure import coupled_system


def couple_here(
    fmus: Mapping[str, str | Path],
    connections: Iterable[tuple[str, str]],
    *,
    inputs: Mapping[str, Any] | None = None,
    parameters: Mapping[str, Any] | None = None,
    **options: Any,
) -> CoupledRun:
    """Run FMUs together as ``couple`` does, also those of other tools here."""
    system = coupled_system(fmus, connections, parameters or {}, inputs or {})
    return run_here(system, CouplingOptions.of(**options))
