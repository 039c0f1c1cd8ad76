"""Errors round a loop follow from the surrogate's slopes and the partner's answer."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from slide_fmu.core.scaling import Affine
from slide_fmu.core.signals import Signal
from slide_fmu.excitation.loop import LoopRecipe
from slide_fmu.features.differences import Differences
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.network.feed_forward.network import FeedForward, Layer
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.report.loop_sections import loop_sections, loop_sentences
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import Source
from slide_fmu.validation.error_figures import LoopFigures
from slide_fmu.validation.loop_gain import loop_figures, newest_slopes
from tests.fmu.samples import STEP, sum_surrogate
from tests.recipes import tiny_recipe
from tests.validation.handmade import comparison

STIFFNESS = 800.0

BODY = """
inputs = {{"push": {{"unit": "N", "range": [-1.0, 1.0]}},
    "load": {{"unit": "N", "range": [2.0, 4.0]}}}}
outputs = {{"height": "mm"}}
parameters = {{"m": 5.0, "d": {damping}}}
hold = "first_order"


def start(u, p):
    return [0.0, 0.0]


def f(x, u, p):
    return [x[1], (u[0] + u[1] - p.d * x[1]) / p.m]


def g(x, u, p):
    return [1e3 * x[0]]
"""


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


class Listed(Source):
    """A system of which only the signals are known."""

    def __init__(
        self, step: float, inputs: tuple[Signal, ...], outputs: tuple[Signal, ...]
    ) -> None:
        """Take step in s and signals."""
        self.step, self.inputs, self.outputs = step, inputs, outputs


SOURCE = Listed(STEP, surrogate_of().inputs, surrogate_of().outputs)


def recipe_of(**ranges: Any) -> Recipe:
    loop = LoopRecipe(output="force", input="place", weight=1.0, **ranges)
    return tiny_recipe().model_copy(update={"loop": (loop,)})


def spring_with_memory(n_in: int) -> Surrogate:
    """The force is -STIFFNESS times the newest place; the window is longer."""
    found = surrogate_of(n_in)
    weights = np.zeros((1, n_in), np.float32)
    weights[0, -1] = -1.0
    layer = Layer(weights, np.zeros(1, np.float32), "identity")
    network = FeedForward((layer,), n_in, FeatureMap(Differences(1)))
    return replace(found, network=network)


def test_slopes_of_a_moving_sum_are_equal_at_all_ages() -> None:
    found = newest_slopes(surrogate_of(4), np.zeros((2, 4, 1)), 0, 0)
    np.testing.assert_allclose(found, np.full((2, 4), -1e-3 * STIFFNESS), rtol=1e-6)
    newest = newest_slopes(spring_with_memory(3), np.zeros((1, 3, 1)), 0, 0)
    np.testing.assert_allclose(newest, [[-1e-3 * STIFFNESS, 0.0, 0.0]], rtol=1e-6, atol=1e-12)


@pytest.mark.extended
def test_own_mass_gains_as_a_simple_one(tmp_path: Path) -> None:
    """Nothing but the loop holds the mass, and a constant load moves it on and on."""
    mass = STIFFNESS / (2 * np.pi * 0.02 / STEP) ** 2
    damping = 0.2 * np.sqrt(STIFFNESS * mass)
    (tmp_path / "body.py").write_text(BODY.format(damping=damping), encoding="utf-8")
    own = LoopRecipe(
        output="force",
        input="place",
        weight=1.0,
        partner=str(tmp_path / "body.py"),
        through=("push", "height"),
        ranges={"m": (mass, 4 * mass)},
    )
    surrogate, measured = spring_with_memory(40), [comparison([[0.0]] * 99)]
    source = Listed(STEP, surrogate.inputs, surrogate.outputs)
    recipe = tiny_recipe().model_copy(update={"loop": (own,)})
    found = loop_figures(recipe, surrogate, source, measured)
    assert all(
        f"with m {m:.3g}" in one.partner for one, m in zip(found, (mass, 2 * mass), strict=False)
    )
    simple = recipe_of(mass=(mass, 4 * mass), damping=(damping, damping))
    expected = loop_figures(simple, surrogate, source, measured)
    assert len(found) == len(expected) == 3
    for one, other in zip(found, expected, strict=True):
        assert one.gain == pytest.approx(other.gain, rel=0.03)
        assert one.hz == pytest.approx(other.hz, rel=0.05)


def test_gain_of_a_spring_is_largest_at_the_natural_frequency() -> None:
    """The sensitivity is |k - m w^2 + i w d| / |K + k - m w^2 + i w d|."""
    mass = STIFFNESS / (2 * np.pi * 0.1 / STEP) ** 2
    damping = 0.2 * np.sqrt(STIFFNESS * mass)
    recipe = recipe_of(mass=(mass, mass), damping=(damping, damping))
    (found,) = loop_figures(recipe, surrogate_of(), SOURCE, [comparison([[0.0]] * 9)])
    turns = 2 * np.pi * np.linspace(0.02, 0.25, 4000) / STEP
    own = 1j * turns * damping - mass * turns**2
    sensitivity = np.abs(own / (STIFFNESS + own))
    assert found.gain == pytest.approx(sensitivity.max(), rel=0.01)
    assert found.hz == pytest.approx(turns[sensitivity.argmax()] / (2 * np.pi), rel=0.03)


def test_partners_of_both_ends_and_the_middle_have_a_sentence_each() -> None:
    found = loop_figures(
        recipe_of(mass=(1.0, 100.0)), surrogate_of(), SOURCE, [comparison([[0.0]] * 9)]
    )
    assert [one.partner for one in found] == [f"a mass of {m} kg" for m in (1, 10, 100)]
    assert loop_figures(tiny_recipe(), surrogate_of(), SOURCE, [comparison([[0.0]])]) == ()
    assert loop_sections(()) == []


def test_sentence_names_signals_partner_and_frequency() -> None:
    one = LoopFigures(
        output="force", input="body", partner="a mass of 300 kg", gain=1.4321, hz=1.234
    )
    assert loop_sentences([one]) == [
        "In a loop with a mass of 300 kg at body, an error of force becomes about 1.4 times as "
        "large at 1.2 Hz, where it grows most."
    ]
    (section,) = loop_sections([one])
    assert section.text.endswith(loop_sentences([one])[0])
    assert section.table is not None
    assert section.table.rows == (
        ("force", "body", "a mass of 300 kg", "1.4 times as large", "1.2 Hz"),
    )
