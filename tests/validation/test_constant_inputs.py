"""The reference is simulated at constant inputs, at the corners of their ranges and inside."""

from __future__ import annotations

import dataclasses

import numpy as np

from slide_fmu.core.measures import FEWEST
from slide_fmu.core.window import Window
from slide_fmu.recipe.case import case_of
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.simulation import simulate
from slide_fmu.validation.constant_inputs import IN_BOX, constant_motions
from tests.fmu.samples import sum_surrogate
from tests.progress import silent
from tests.recipes import tiny_recipe, whole_recipe

SAMPLES = 8
RECIPE = tiny_recipe(data={"burn_in": 0.5, "duration": 2.0})


def surrogate_of() -> Surrogate:
    """The sum of the last inputs in place of an oscillator."""
    system = case_of(RECIPE).system
    return dataclasses.replace(
        sum_surrogate(SAMPLES),
        window=Window(RECIPE.window.step, SAMPLES, 1),
        inputs=system.inputs,
        outputs=system.outputs,
    )


def test_the_scored_part_is_the_rest_under_constant_inputs() -> None:
    surrogate = surrogate_of()
    found = constant_motions(surrogate, case_of(RECIPE), silent)
    ((named, motions),) = found.items()
    assert (named.inputs, len(motions)) == (IN_BOX, FEWEST)
    (signal,), system = surrogate.inputs, case_of(RECIPE).system
    for end, motion in zip((signal.low, signal.high), motions[:2], strict=True):
        constant = np.full((400, 1), end)
        rest = simulate(system, constant, system.random_state(np.random.default_rng(0), [0.0]))
        scored = np.arange(round(motion.first / motion.grid), len(motion.truth))
        np.testing.assert_allclose(motion.course(motion.grid * scored), end)
        size = np.abs(rest.outputs[-1]).max()
        np.testing.assert_allclose(motion.truth[scored[-1]], rest.outputs[-1], atol=1e-3 * size)


def test_inputs_that_move_in_bands_of_their_own_are_held_too() -> None:
    bands = {"kind": "band_sines", "weight": 1.0, "bands": [[1.0, 9.0]]}
    moved = whole_recipe(
        {**RECIPE.model_dump(), "data": {**RECIPE.data.model_dump(), "excitation": [bands]}}
    )
    assert constant_motions(surrogate_of(), case_of(moved), silent)


def test_planned_motions_and_drives_are_never_constant() -> None:
    moves = {"kind": "point_to_point", "weight": 1.0}
    driven = whole_recipe(
        {**RECIPE.model_dump(), "data": {**RECIPE.data.model_dump(), "excitation": [moves]}}
    )
    assert constant_motions(surrogate_of(), case_of(driven), silent) == {}
