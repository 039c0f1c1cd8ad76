"""A run leaves no FMU whose library gives something else than its surrogate."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray
from slide_fmu.cosim import check
from slide_fmu.cosim.run import CoSimulationError
from slide_fmu.fmu.export import export_fmu
from slide_fmu.pipeline.run import require_same_answers
from tests.fmu.samples import random_surrogate
from tests.fmu.small_shapes import CELLS


def test_library_that_gives_what_its_surrogate_gives_passes(tmp_path: Path) -> None:
    fmu = export_fmu(random_surrogate(CELLS), tmp_path / "cells.fmu")
    require_same_answers(fmu)
    assert fmu.is_file()


def test_fmu_of_a_library_that_gives_something_else_is_removed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fmu, given = export_fmu(random_surrogate(CELLS), tmp_path / "cells.fmu"), check._run_native

    def off(*arguments: object) -> dict[str, FloatArray]:
        found = given(*arguments)  # type: ignore[arg-type]
        return {name: np.asarray(values + 0.01) for name, values in found.items()}

    monkeypatch.setattr(check, "_run_native", off)
    with pytest.raises(CoSimulationError, match=r"^cells\.fmu: .* differ by .*defect"):
        require_same_answers(fmu)
    assert not fmu.exists()
