"""A quick run ends with an FMU that says what it is, next to a whole one that stays as it was."""

from __future__ import annotations

from pathlib import Path

import pytest

from slide_fmu.fmu.export import read_fmu
from slide_fmu.pipeline.run_folder import recipe_of_provenance
from slide_fmu.recipe.quick import QUICK, REMARK
from tests.acceptance.conftest import SMALL_BOUNDED, invoke

pytestmark = pytest.mark.extended


def test_quick_run_is_named_wherever_its_fmu_is_described(tmp_path: Path) -> None:
    recipe, runs = tmp_path / "small_bounded.toml", tmp_path / "runs"
    recipe.write_text(SMALL_BOUNDED, encoding="utf-8")
    whole = runs / "small_bounded"
    whole.mkdir(parents=True)
    kept = whole / "small_bounded.fmu", whole / "surrogate.slide"
    for file in kept:
        file.write_bytes(b"of a whole run")
    said = invoke("run", recipe, "--runs", runs, "--workers", 1, "--quick", "--trajectories", 2)
    assert said.exit_code == 0, said.output
    assert REMARK in said.output.splitlines()
    assert said.output.count(REMARK) == 2  # at the start, and among the remarks at the end
    assert [file.read_bytes() for file in kept] == [b"of a whole run"] * 2
    fmu = whole / "quick" / "small_bounded.fmu"
    assert REMARK in invoke("info", fmu).output
    card = (fmu.parent / "card.md").read_text(encoding="utf-8")
    assert REMARK.replace("a quick", "A quick", 1) in card.replace("\\", "")
    assert "has fewer trajectories and a shorter training" in (
        fmu.parent / "report.html"
    ).read_text("utf-8")
    _, provenance = read_fmu(fmu)
    assert provenance is not None
    assert provenance["measured"]["command"] == "slide-fmu run small_bounded.toml --quick"
    made_from = recipe_of_provenance(provenance, "it")
    assert made_from.data.calibration <= QUICK["data.calibration"]
    assert made_from.training.starts <= QUICK["training.starts"]
