"""A recipe that says nothing about its excitation gets one that follows from its step."""

from __future__ import annotations

import numpy as np
import pytest

from slide_fmu.core.signals import Signal
from slide_fmu.recipe.default_excitation import default_excitation
from slide_fmu.recipe.recipe import Recipe
from tests.recipes import tiny_recipe


def without_excitation(step: float) -> Recipe:
    values = tiny_recipe().model_dump(mode="json")
    del values["data"]["excitation"]
    values["window"]["step"], values["data"]["duration"] = step, 200 * step
    return Recipe.model_validate(values)


@pytest.mark.parametrize("step", [1e-3, 0.02, 60.0])
def test_default_mix_drives_every_input_within_the_band_of_the_step(step: float) -> None:
    recipe = without_excitation(step)
    kinds = recipe.data.excitation
    assert sum(kind.weight for kind in kinds) == pytest.approx(1.0)
    signals = (Signal("a", "N", -2.0, 6.0), Signal("b", "m", 0.0, 1.0, hold="first_order"))
    time = step * np.arange(4000)
    for kind in kinds:
        kind.check(signals)
        inputs = kind.inputs(signals, time, 1.0, np.random.default_rng(3))
        assert (inputs.min(axis=0) > [-2.001, -0.001]).all()
        assert (inputs.max(axis=0) < [6.001, 1.001]).all()
        assert (inputs.std(axis=0) > [0.01, 0.001]).all()
    for table in default_excitation(step):
        for frequency in table.get("angular_frequency", []):
            assert 0 < frequency * step < 0.35 * np.pi


def test_excitation_of_a_recipe_is_kept() -> None:
    assert [kind.kind for kind in tiny_recipe().data.excitation] != [
        table["kind"] for table in default_excitation(tiny_recipe().window.step)
    ]
