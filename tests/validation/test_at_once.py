"""A reference that simulates many motions at once is asked for all after the first together."""

from __future__ import annotations

from itertools import chain, repeat
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from slide_fmu.fmu.export import export_fmu
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.systems.errors import SimulationError
from slide_fmu.systems.function.system import FunctionSystem
from slide_fmu.systems.simulation import simulate_motions
from slide_fmu.validation import validate as validation
from slide_fmu.validation.results import Validation
from slide_fmu.validation.task import Task
from slide_fmu.validation.validate import validate
from tests.libraries import build_libraries
from tests.progress import silent
from tests.refusals import refused
from tests.validation.lag import MODEL, lag_recipe, lag_surrogate

COUNT = 6
SMALL = {
    "kind": "multisine",
    "weight": 1.0,
    "amplitude": [0.02, 0.05],
    "angular_frequency": [1.0, 9.0],
}
LARGE = {"kind": "held_random", "weight": 50.0}  # nearly all further draws are of this kind
SAME = 1e-6
"""Where inputs jump, the lengths of steps differ a little from those of one motion alone."""


def recipe_of_kinds(folder: Path, *kinds: dict[str, Any]) -> Recipe:
    """The lag, of which motions fail that leave the middle of its range; its inputs are held."""
    values = lag_recipe(folder, "zero_order").model_dump()
    values["data"]["excitation"] = list(kinds)
    model = folder / "lag.py"
    failing = "[np.where(np.abs(x[0] - 1.0) > 2.0, np.nan, 1.0) * (u[0]"
    text = model.read_text(encoding="utf-8").replace("[(u[0]", failing)
    model.write_text(f"import numpy as np\n{text}", encoding="utf-8")
    return Recipe.model_validate(values)


def measured_beyond(
    recipe: Recipe, folder: Path, most: int, patch: pytest.MonkeyPatch
) -> tuple[Validation, list[int]]:
    """Measure at inputs of twice the range with a reference that simulates so many at once.

    Returns:
        What was measured, and the numbers of motions that were asked for together.
    """
    asked: list[int] = []

    def spied(system: Any, motions: list[Any], *more: Any) -> Any:
        asked.append(len(motions))
        return simulate_motions(system, motions, *more)

    patch.setattr(validation, "simulate_motions", spied)
    patch.setattr(FunctionSystem, "most_at_once", lambda *_: most)
    surrogate = lag_surrogate(recipe, "zero_order")
    build_libraries()
    fmu = export_fmu(surrogate, folder / "lag.fmu")
    task = Task(seed=3, trajectories=COUNT, amplitude=(2.0, 2.0))
    return validate(fmu, surrogate, case_of(recipe), task, silent), asked


def test_motions_on_which_the_reference_fails_are_left_out_as_if_each_were_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recipe = recipe_of_kinds(tmp_path, SMALL, LARGE)
    alone, none = measured_beyond(recipe, tmp_path, 1, monkeypatch)
    found, asked = measured_beyond(recipe, tmp_path, 2, monkeypatch)
    assert (none, asked) == ([], [COUNT - 1])
    assert len(found.left_out) + len(found.comparisons) == COUNT
    assert found.left_out == alone.left_out
    assert found.left_out
    assert all("5 motions in a row" in error for error in found.left_out)
    assert any(one.failed for one in found.comparisons)  # another draw was small
    for one, other in zip(found.comparisons, alone.comparisons, strict=True):
        np.testing.assert_array_equal(one.inputs, other.inputs)
        np.testing.assert_allclose(one.reference, other.reference, rtol=0, atol=SAME)
        assert np.ptp(one.reference) > 100 * SAME


@pytest.mark.parametrize(("rate", "count"), [("u[0]", 24), ("max(-9.0, u[0])", 2)])
def test_function_of_one_state_alone_is_measured_on_what_a_minute_allows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rate: str, count: int
) -> None:
    """A motion takes 20 s, and there are two kinds; many at once may take as long as few."""
    recipe = recipe_of_kinds(tmp_path, SMALL, LARGE)
    values = recipe.model_dump()
    values["validation"]["trajectories"] = None
    recipe = Recipe.model_validate(values)
    (tmp_path / "lag.py").write_text(MODEL.replace("[(u[0]", f"[({rate}"), encoding="utf-8")
    clock = chain([100.0], repeat(120.0))  # around the first trajectory
    times = SimpleNamespace(process_time=lambda: next(clock), perf_counter=lambda: 0.0)
    monkeypatch.setattr(validation, "time", times)
    monkeypatch.setattr(validation, "_speed", lambda *_: None)
    build_libraries()
    surrogate = lag_surrogate(recipe, "zero_order")
    fmu = export_fmu(surrogate, tmp_path / "lag.fmu")
    found = validate(fmu, surrogate, case_of(recipe), Task(seed=3), silent, workers=0)
    assert len(found.comparisons) == count


def test_reference_that_fails_on_all_motions_beyond_its_range_ends_the_validation(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recipe = recipe_of_kinds(tmp_path, LARGE)
    with refused(SimulationError, "5 motions in a row", "f gave"):
        measured_beyond(recipe, tmp_path, 2, monkeypatch)
