"""A reference system runs at a finer step than the samples of its recipe."""

from __future__ import annotations

import numpy as np
import pytest

from slide_fmu.recipe.systems import finer_steps, reference_at_finer_step, reference_system
from slide_fmu.systems.base import System
from slide_fmu.systems.errors import LoadError
from slide_fmu.systems.simulation import simulate
from tests.recipes import tiny_recipe


def test_a_finer_reference_moves_alike_under_the_same_held_input() -> None:
    recipe = tiny_recipe()
    times = finer_steps(recipe)
    coarse, fine = reference_system(recipe), reference_at_finer_step(recipe, times)
    assert (times, fine.step) == (8, recipe.window.step / 8)
    held = np.random.default_rng(1).uniform(-1, 1, (40, len(coarse.inputs)))
    wanted = simulate(coarse, held).outputs
    found = simulate(fine, np.repeat(held, times, axis=0)).outputs[::times]
    assert np.abs(found - wanted).max() < 1e-3 * np.abs(wanted).max()


@pytest.mark.parametrize(("own", "times"), [(0.005, 3), (0.5, 1)])
def test_a_model_that_names_its_step_goes_on_by_that(
    own: float, times: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(System, "own_step", own)
    assert finer_steps(tiny_recipe()) == times


def test_a_class_with_a_step_of_its_own_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    recipe = tiny_recipe()
    coarse = reference_system(recipe)
    monkeypatch.setattr("slide_fmu.recipe.systems.load_system", lambda _: coarse)
    with pytest.raises(LoadError, match=r"expected 0\.00195312 s, which is 1/8 of window\.step"):
        reference_at_finer_step(recipe, 8)
