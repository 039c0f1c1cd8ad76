"""Held inputs between an FMU's own steps are measured as an importer meets them."""

from __future__ import annotations

from pathlib import Path

import pytest
from held_between import rows_of_fmu

from tests.progress import no_stages

DUFFING = Path(__file__).parents[2] / "fmus" / "duffing" / "duffing.fmu"


@pytest.mark.extended
def test_held_inputs_between_own_steps_are_less_accurate_and_covered() -> None:
    exact, *between = rows_of_fmu(DUFFING, no_stages)
    assert exact["relative_rmse"] < 1e-3 < 0.005 < min(row["relative_rmse"] for row in between)
    assert min(row["covered"] for row in between) > 0.8
    assert max(row["trusted"] for row in between) < 0.6 < exact["trusted"]
