"""An FMU is not measured beside itself."""

from __future__ import annotations

from pathlib import Path

import pytest

from slide_fmu.pipeline.measurement import require_another
from slide_fmu.pipeline.run_folder import StageError
from tests.recipes import tiny_recipe
from tests.refusals import refused


def test_fmu_that_its_own_reference_leads_to_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A recipe of pump.fmu may well be called pump, and so is the FMU that is made of it."""
    recipe = tiny_recipe()
    system = recipe.system.model_copy(update={"kind": "fmu", "model": "pump.fmu"})
    recipe = recipe.model_copy(update={"system": system})
    here, made = tmp_path / "pump.fmu", tmp_path / "runs" / "pump.fmu"
    made.parent.mkdir()
    for path in (here, made):
        path.write_bytes(b"")
    monkeypatch.chdir(tmp_path)
    require_another(made, recipe)
    monkeypatch.chdir(made.parent)
    with refused(StageError, "the reference 'pump.fmu'", "expected the FMU of the model"):
        require_another(made, recipe)
