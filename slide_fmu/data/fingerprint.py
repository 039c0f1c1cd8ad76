"""A fingerprint of a store holds the values of its recipe and a short motion of its model.

They show whether the data were made from other values, or from a model that has changed since.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from slide_fmu.core.figures import optional, plain, read_figures
from slide_fmu.core.result_cache import ResultFile
from slide_fmu.core.signals import FloatArray
from slide_fmu.data.answers import asked_of_sources
from slide_fmu.data.draws import PROBE_SAMPLES, probe
from slide_fmu.excitation.loop import LoopRecipe
from slide_fmu.excitation.mix import Excitation
from slide_fmu.recipe.automatic import Tables
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.estimator import drawn_factors
from slide_fmu.recipe.loop_partner import own_partner
from slide_fmu.recipe.model_rules import rules_of
from slide_fmu.recipe.recipe import SPLITS, Recipe
from slide_fmu.systems.base import System
from slide_fmu.systems.simulation import simulate

SAME = 1e-6
"""Motions that differ by less than this part of their largest value count as the same: processors
differ in the last digits."""

MODEL = "model"
"""Results of this name are the answers of models."""

_DO_NOT_MATTER = ("most_failures",)
"""Keys of the table ``data`` on which no trajectory depends."""


OF_MODELS = {"partner", "through", "ranges"}
"""Keys of a loop that are left out where its partner is no model, as in older stores."""


@dataclass(frozen=True, kw_only=True)
class Fingerprint:
    """A Fingerprint has the values of a recipe that its data depend on.

    Attributes:
        system, data, parameters: keys of these tables on which the data depend.
        step: sample step in s.
        estimator: keys of this table about its trajectories; None without one.
        bound: kinds of excitation of an error bound alone; None without such kinds.
        loop: loops in which motions are drawn; None without.
        training: kinds that are learnt from, but not promised; None without such kinds.
    """

    system: Tables
    step: float
    data: Tables
    parameters: Tables
    estimator: Tables | None = optional()
    bound: Tables | None = optional()
    loop: Tables | None = optional()
    training: Tables | None = optional()


def data_fingerprint(recipe: Recipe) -> Fingerprint:
    """Return the values of a recipe that its data depend on, as JSON has them.

    A store that was made from other values is not used. Numbers of trajectories are no part of
    the fingerprint: a store may hold more than a recipe reads.
    """
    exclude = {"reference", "picture", "chain", "drive", "noise_record"}
    estimator = None
    if recipe.estimator is not None:
        keys = {"amplitude_factor", "in_range"}
        drawn = recipe.estimator.expert.model_dump(mode="json", include=keys)
        estimator = {"expert": drawn}
    data = recipe.data.model_dump(mode="json", exclude={*SPLITS, *_DO_NOT_MATTER})
    if not rules_of(recipe).simulated:
        data["lead"] = recipe.window.n_in - recipe.window.n_out  # records are cut by it
    found = Fingerprint(
        system=recipe.system.model_dump(mode="json", exclude=exclude),
        step=recipe.window.step,
        data=data,
        parameters=recipe.model_dump(mode="json", include={"parameters"})["parameters"],
        estimator=estimator,
        bound=_with_kinds(recipe.further_kinds()),
        training=_with_kinds(recipe.kinds_of_training()),
        loop=_with_kinds(recipe.loop),
    )
    return read_figures(Fingerprint, json.loads(json.dumps(plain(found))))


def _with_kinds(kinds: Sequence[Excitation | LoopRecipe]) -> Tables | None:
    dumped = [
        kind.model_dump(mode="json", exclude=None if getattr(kind, "partner", None) else OF_MODELS)
        for kind in kinds
    ]
    return {"excitation": dumped} if kinds else None


def drawn_with(fingerprint: Fingerprint, split: str, index: int) -> tuple[float, float]:
    """Return the range of the amplitude factor that a store's trajectory was drawn with.

    Without an estimator in the fingerprint, the store has no trajectory for one.
    """
    estimator = fingerprint.estimator
    if split == "beyond":
        low, high = fingerprint.data["beyond_factor"]
        return low, high
    if estimator is None or not split.startswith("estimator"):
        return 1.0, 1.0
    low, high = estimator["expert"]["amplitude_factor"]
    return drawn_factors((low, high), estimator["expert"]["in_range"], index)


def same_kinds_of_draws(fingerprint: Fingerprint) -> Fingerprint:
    """Return a fingerprint without the factors of draws beyond the range (``drawn_with``)."""
    data = {k: v for k, v in fingerprint.data.items() if k != "beyond_factor"}
    return replace(fingerprint, estimator=None, data=data)


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
    """Tell whether two probes, each (N + 1, n_outputs), show the same model but for rounding."""
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
    own = ResultFile.of(folder, MODEL, answers, suffix=".npz")
    for path in (own.path, *sorted(folder.glob(f"{MODEL}-*.npz"))):
        kept = ResultFile(path).read_arrays()
        if kept is not None and same_motion(kept["answers"], answers):
            return path.stem
    own.write_arrays({"answers": answers})
    return own.path.stem


def first_difference(found: Fingerprint, wanted: Fingerprint) -> str | None:
    """Name the first value, in the order of the keys, that differs; None if all agree."""
    return _first_difference(plain(found), plain(wanted), "")


def _first_difference(found: Any, wanted: Any, place: str) -> str | None:
    if isinstance(found, dict) and isinstance(wanted, dict):
        for key in sorted({*found, *wanted}):
            name = f"{place}.{key}" if place else str(key)
            difference = _first_difference(found.get(key), wanted.get(key), name)
            if difference is not None:
                return difference
        return None
    if _are_tables(found) and _are_tables(wanted) and len(found) == len(wanted):
        pairs = enumerate(zip(found, wanted, strict=True), start=1)  # as people count tables
        each = (_first_difference(*pair, f"{place} {number}") for number, pair in pairs)
        return next(filter(None, each), None)
    return None if found == wanted else f"{place} = {found!r} there, {wanted!r} here"


def _are_tables(value: Any) -> bool:
    """Tell whether a value is a list of tables, such as those of ``data.excitation``."""
    return isinstance(value, list) and bool(value) and all(isinstance(v, dict) for v in value)
