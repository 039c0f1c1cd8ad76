"""What a model answers to a short motion shows whether it has changed.

So results of the former model are not used any more: the answers are part of what decides them.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from slide_fmu.core.result_cache import ResultFile, damage_named
from slide_fmu.core.signals import FloatArray
from slide_fmu.data.answers import asked_of_sources
from slide_fmu.data.draws import PROBE_SAMPLES, probe
from slide_fmu.excitation.loop import LoopRecipe
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.loop_partner import own_partner
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.systems.base import System
from slide_fmu.systems.simulation import simulate

SAME = 1e-6
"""Answers that differ by less than this part of their largest value count as the same: processors
differ in the last digits."""

MODEL = "model"
"""Results of this name are the answers of models."""


@asked_of_sources
def identity(system: System, recipe: Recipe) -> FloatArray:
    """Return numbers that change when the source of the data changes, shape (n, m).

    For a system they are the outputs of a short motion (``slide_fmu.data.draws.probe``), also at
    the lower and the upper ends of the ranges of its parameters, and of one of each partner that
    is a model; ``same_motion`` compares them.

    Raises:
        LoadError: the system cannot be made at the ends of the ranges.
        SimulationError: the system could not be simulated.
    """
    parameters = recipe.physical()
    ends = ({p.name: p.low for p in parameters}, {p.name: p.high for p in parameters})
    others = [case_of(recipe).at_ends(one) for one in ends if one]
    partners = [_motion_of_partner(one, system) for one in recipe.loop if one.partner is not None]
    at_ends = [probe(one.recipe, one.system) for one in others]
    return np.hstack([probe(recipe, system), *at_ends, *partners])


def _motion_of_partner(loop: LoopRecipe, system: System) -> FloatArray:
    """Simulate the partner of a loop alone while its inputs go through their ranges and back."""
    lowest = [(name, pair[0]) for name, pair in (loop.ranges or {}).items()]
    partner = own_partner(loop, system, lowest).system
    ends = np.array([(signal.low, signal.high) for signal in partner.inputs])
    wave = np.sin(np.linspace(0.0, 2 * np.pi, PROBE_SAMPLES))[:, None]
    return simulate(partner, ends.mean(axis=1) + 0.5 * wave * np.ptp(ends, axis=1)).outputs


def same_motion(before: FloatArray, now: FloatArray) -> bool:
    """Tell whether two answers, each (n, m), are of the same model but for rounding."""
    slack = SAME * np.max(np.abs(before), axis=0, initial=0.0)
    return before.shape == now.shape and bool(np.all(np.abs(before - now) <= slack))


def model_key(folder: Path, answers: FloatArray) -> str:
    """Return the key of a model in a folder of results, by its answers (``identity``).

    The folder keeps the answers of every model, so that answers that differ in rounding alone, as
    those of another processor do, have the key of the first ones.

    Raises:
        DamagedFileError: the file of a model is damaged.
        OSError: the answers cannot be written.
    """
    own = ResultFile.of(folder, MODEL, answers, suffix=".npz").path
    for path in (own, *sorted(folder.glob(f"{MODEL}-*.npz"))):
        if path.exists() and same_motion(kept_answers(folder, path.stem), answers):
            return path.stem
    ResultFile(own).write_arrays({"answers": answers})
    return own.stem


def kept_answers(folder: Path, key: str) -> FloatArray:
    """Return the answers, (n, m), of the model that has a key in a folder of results.

    Raises:
        DamagedFileError: the file of the model is damaged, or gone.
    """
    file = ResultFile(folder / f"{key}.npz")
    arrays = file.read_arrays()
    with damage_named(file.path, "the answers of a model"):
        answers: FloatArray = (arrays or {})["answers"]
    return answers
