"""A validation goes on with another draw where the reference cannot be simulated."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slide_fmu.core.figures import plain
from slide_fmu.core.window import Window
from slide_fmu.fmu.export import export_fmu
from slide_fmu.pipeline import measurement
from slide_fmu.recipe.case import case_of
from slide_fmu.systems.errors import SimulationError
from slide_fmu.validation.results import Validation
from slide_fmu.validation.task import Task
from slide_fmu.validation.validate import validate
from tests.data.test_failures import failing
from tests.fmu.samples import sum_surrogate
from tests.libraries import build_libraries
from tests.progress import silent
from tests.refusals import refused

COUNT = 12


def measured(level: float, path: Path) -> Validation:
    recipe = failing(fail=level)
    system = case_of(recipe).system
    window = Window(recipe.window.step, 8, 1)
    signals = {"inputs": system.inputs, "outputs": system.outputs}
    surrogate = replace(sum_surrogate(8), name="tiny", window=window, **signals)
    build_libraries()
    fmu = export_fmu(surrogate, path / "tiny.fmu")
    return validate(fmu, surrogate, case_of(recipe), Task(seed=3, trajectories=COUNT), silent)


def test_another_draw_is_measured_and_the_failures_are_counted(tmp_path: Path) -> None:
    found = measured(0.95, tmp_path)
    failed = [comparison.failed for comparison in found.comparisons]
    assert len(failed) == COUNT
    assert 0 < sum(failed) == found.figures().failed
    assert all(np.max(comparison.reference) <= 0.95 for comparison in found.comparisons)
    whole = measured(2.0, tmp_path)
    assert "failed" not in plain(whole.figures())
    kept = failed.index(0)
    np.testing.assert_array_equal(found.comparisons[kept].inputs, whole.comparisons[kept].inputs)


def test_a_reference_that_always_fails_ends_the_validation(tmp_path: Path) -> None:
    with refused(SimulationError, "5 motions in a row", "no solution at t"):
        measured(-1.0, tmp_path)


def test_a_failure_says_what_was_being_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    def failing(*_: object) -> Validation:
        raise SimulationError("no solution", 0.5)

    monkeypatch.setattr(measurement, "validate", failing)
    fmu = Path(__file__).parents[2] / "fmus" / "linear" / "linear.fmu"
    case = measurement.released_case(fmu)
    with pytest.raises(
        SimulationError, match=r"^validation on kinds that were held out: no solution$"
    ) as raised:
        measurement.validate_fmu_file(fmu, case, Task(seed=3, held_out=True), lambda stage: silent)
    assert raised.value.time == 0.5
