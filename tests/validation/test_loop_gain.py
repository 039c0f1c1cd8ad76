"""Errors round a loop follow from the surrogate's slopes and the partner's answer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from slide_fmu.core.scaling import Affine
from slide_fmu.core.signals import Signal
from slide_fmu.excitation.loop import LoopRecipe
from slide_fmu.features.differences import Differences
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.network.feed_forward.network import FeedForward, Layer
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.report.importer_sections import loop_sections, loop_sentences
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation.error_figures import LoopFigures
from slide_fmu.validation.loop_gain import frequency_response, loop_figures
from tests.fmu.samples import STEP, sum_surrogate
from tests.recipes import tiny_recipe
from tests.validation.handmade import comparison

STIFFNESS = 800.0


def surrogate_of(n_in: int = 1) -> Surrogate:
    """The force is -STIFFNESS times the sum of the places in the window."""
    minus = Layer(-np.ones((1, n_in), np.float32), np.zeros(1, np.float32), "identity")
    return replace(
        sum_surrogate(n_in),
        inputs=(Signal("place", "mm", -9.0, 9.0),),
        outputs=(Signal("force", "N", -99.0, 99.0),),
        output_scaling=Affine.of_channels([0.0], [1e-3 * STIFFNESS]),
        network=FeedForward((minus,), n_in, FeatureMap(Differences(1))),
    )


def recipe_of(**ranges: tuple[float, float]) -> Recipe:
    loop = LoopRecipe(output="force", input="place", weight=1.0, **ranges)
    return tiny_recipe().model_copy(update={"loop": (loop,)})


def test_response_is_that_of_a_moving_sum() -> None:
    hertz = np.array([0.01, 0.05]) / STEP
    found = frequency_response(surrogate_of(4), np.zeros((2, 4, 1)), 0, 0, hertz)
    delays = np.exp(-2j * np.pi * np.outer(hertz, STEP * np.arange(4))).sum(axis=1)
    np.testing.assert_allclose(found, np.tile(-1e-3 * STIFFNESS * delays, (2, 1)), rtol=1e-6)


def test_gain_of_a_spring_is_largest_at_the_natural_frequency() -> None:
    """The sensitivity is |k - m w^2 + i w d| / |K + k - m w^2 + i w d|."""
    mass = STIFFNESS / (2 * np.pi * 0.1 / STEP) ** 2
    damping = 0.2 * np.sqrt(STIFFNESS * mass)
    recipe = recipe_of(mass=(mass, mass), damping=(damping, damping))
    (found,) = loop_figures(recipe, surrogate_of(), [comparison([[0.0]] * 9)])
    turns = 2 * np.pi * np.linspace(0.02, 0.25, 4000) / STEP
    own = 1j * turns * damping - mass * turns**2
    sensitivity = np.abs(own / (STIFFNESS + own))
    assert found.gain == pytest.approx(sensitivity.max(), rel=0.01)
    assert found.hz == pytest.approx(turns[sensitivity.argmax()] / (2 * np.pi), rel=0.03)


def test_partners_of_both_ends_and_the_middle_have_a_sentence_each() -> None:
    found = loop_figures(recipe_of(mass=(1.0, 100.0)), surrogate_of(), [comparison([[0.0]] * 9)])
    assert [one.partner for one in found] == [f"a mass of {m} kg" for m in (1, 10, 100)]
    assert loop_figures(tiny_recipe(), surrogate_of(), [comparison([[0.0]])]) == ()
    assert loop_sections(()) == []


def test_sentence_names_signals_partner_and_frequency() -> None:
    one = LoopFigures(
        output="force", input="body", partner="a mass of 300 kg", gain=1.4321, hz=1.234
    )
    assert loop_sentences([one]) == [
        "An error of 1 % at force becomes 1.4 % at body with a mass of 300 kg (at 1.2 Hz)."
    ]
    (section,) = loop_sections([one])
    assert section.text.endswith(loop_sentences([one])[0])
    assert section.table is not None
    assert section.table.rows == (("force", "body", "a mass of 300 kg", "1.4 %", "1.2 Hz"),)
