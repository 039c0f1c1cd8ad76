"""This module finds open numbers of trajectories, and keeps what they follow from.

Where trajectories cost little, as many as a learning curve tries are learnt from; where a fit
begins at known states, it is a number that suffices. Else the curve is found: each stage has twice
as many trajectories as the one before. It ends where a doubling does not pay, or cannot pay since
the error on unseen motions is not larger. Each point is kept in the run folder, so that an
interrupted curve goes on. The time of a trajectory is kept too, from which the numbers of an error
bound follow.
"""

from __future__ import annotations

import time
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

from slide_fmu.bounds.judge import KIND_CONFIDENCE, OF_A_KIND
from slide_fmu.core.progress import Stages
from slide_fmu.core.result_cache import ResultFile
from slide_fmu.data.answers import asked_of_sources
from slide_fmu.data.model_answers import identity, model_key
from slide_fmu.data.simulation_time import simulation_time
from slide_fmu.data.workplace import Workplace
from slide_fmu.fitting.history import Curve, CurvePoint
from slide_fmu.fitting.ladder import Ladder, pays
from slide_fmu.pipeline.case_checks import guarded_case
from slide_fmu.pipeline.run_folder import RunFolder
from slide_fmu.recipe.automatic import BOUND_NUMBERS, NUMBERS, FoundValues, Tables, nested
from slide_fmu.recipe.case import Case
from slide_fmu.recipe.open_recipe import OpenRecipe
from slide_fmu.recipe.recipe import SPLITS, Recipe
from slide_fmu.systems.base import ShowingStates, Source, System

FIRST, MOST = 32, 256
"""A learning curve begins with the first number of trajectories, and ends with the second."""
CHEAP = 20.0
"""Where the second number of trajectories takes at most this time in s, that many are learnt from
without a curve: a curve judges by the mean error, and few motions leave rare ones unlearnt. On a
mass on a hardening spring, 32 trajectories ended its curve; networks of 32 to 128 trajectories had
largest errors of 0.7 to 6 % on unseen motions, depending on the draw, those of 256 of 0.4 %."""
OF_STATES = 64
"""Where a fit begins at known states, every sample is a lesson on its own. So this number of
trajectories suffices: a drive with play ended at 0.09 % with it, where a curve of networks without
states did not fall below 7 %."""
PAYS = 0.85
"""A doubling of the trajectories pays when the validation error falls below this part of it: it
doubles the time that everything after it takes."""
ENOUGH = 64
"""Where a doubling did not pay, half the trajectories are learnt from, but no fewer than these:
the final network is fitted for longer than the networks of the curve."""
HOLDS = 1.1
"""More trajectories teach nothing new where the validation error is at most this many times the
training error."""
VALIDATION, SHARE = 24, 4
"""The curve is judged on VALIDATION trajectories, enough for every kind of the mix, also for rare
and hard motions such as a lasting resonance. The final number is the same, or one for each SHARE
training trajectories, if that is more."""
ESTIMATOR, ESTIMATOR_SHARE = 128, 8
"""An error estimator learns from at least ESTIMATOR trajectories, and from no fewer than the
surrogate. It is judged by one for each ESTIMATOR_SHARE of them, but by no fewer than the curve."""
BOUND_TIME = 60.0
"""The trajectories of an error bound, simulated one after the other, take at most this time in s,
unless their least numbers take longer."""
BOUND, CALIBRATION = (30, 200), (100, 100)
"""The least numbers of trajectories from which a bound learns and by which it is calibrated, and
the largest ones where the mix has few kinds of input."""
BOUND_OF_KIND = 20
"""The largest numbers have so many trajectories of each kind of the mix to learn from, and
``OF_A_KIND`` to calibrate by: then the bound is calibrated for each kind alone, too."""
CURVE, COST = "learning_curve", "trajectory_time"
"""Names of the results that the run folder keeps."""
DEAR, DEAR_CALIBRATION = 5.0, 60
"""If a trajectory takes more than DEAR s, at least DEAR_CALIBRATION trajectories calibrate the
bound. Then a confidence of 0.95 asks for 96.6 % of their samples, and one of 0.99 has no bound."""


def find_numbers(
    case: Case,
    open_keys: Collection[str],
    folder: RunFolder,
    bar: Stages,
    place: Workplace,
    recipe_folder: Path | None = None,
) -> FoundValues:
    """Return the open numbers of trajectories of a recipe; unknown ones are found.

    The workplace makes the trajectories of a recipe in the folder ``recipe_folder``.
    """
    known = known_numbers(case, open_keys, folder)
    if known is not None:
        return known
    cost = trajectory_time(case, folder, bar) if _needs_cost(open_keys) else 0.0
    train = case.recipe.data.train
    if "data.train" in open_keys:
        known_count = without_curve(cost, states_at_start(case.recipe, case.source))
        if known_count is None:
            staged = _CurveData(case, folder, bar, place, recipe_folder)
            known_count = _learnt_from(_whole_curve(case, folder, staged).points)
        train = known_count
    return _numbers_with(case.recipe, open_keys, train, cost)


def states_at_start(recipe: Recipe, source: Source) -> int | None:
    """Return the number of states that the system shows, from which the network is fitted.

    It is None where the fit finds states of its own.
    """
    if not isinstance(source, ShowingStates) or not recipe.may_begin_at_states():
        return None
    return len(source.showing_states().outputs) - len(source.outputs)


def without_curve(cost: float, known_states: int | None) -> int | None:
    """Return the open number of trajectories to learn from; None if a curve finds it.

    A trajectory takes ``cost`` s. Where it takes so few that as many as a curve tries are made at
    once, these are learnt from. Where the fit begins at ``known_states``, a number is known, too.
    """
    if cost * MOST <= CHEAP:
        return MOST
    return OF_STATES if known_states is not None else None


def known_numbers(case: Case, open_keys: Collection[str], folder: RunFolder) -> FoundValues | None:
    """Return the open numbers of a recipe; None if its curve has not ended yet."""
    if not any(key in open_keys for key in (*NUMBERS, *BOUND_NUMBERS)):
        return {}
    return found_numbers(case.source, case, open_keys, folder)


@asked_of_sources
def found_numbers(
    system: System, case: Case, open_keys: Collection[str], folder: RunFolder
) -> FoundValues | None:
    """Return the open numbers of a recipe; None if its curve has not ended yet."""
    cost = kept_cost(case, folder) if _needs_cost(open_keys) else 0.0
    if cost is None:
        return None
    train = case.recipe.data.train
    if "data.train" in open_keys:
        known_count = without_curve(cost, states_at_start(case.recipe, system))
        if known_count is None:
            curve = kept_curve(case, folder)
            if curve.ended is None:
                return None
            known_count = _learnt_from(curve.points)
        train = known_count
    return _numbers_with(case.recipe, open_keys, train, cost)


def _learnt_from(points: Sequence[CurvePoint]) -> int:
    """Return the number of trajectories to learn from, where the curve has these points."""
    last = points[-1].trajectories
    if len(points) == 1 or _pays(points):
        return last
    return max(points[-2].trajectories, min(ENOUGH, last))


def _pays(points: Sequence[CurvePoint]) -> bool:
    """Tell whether the last doubling has paid."""
    return pays(points[-1].validation_error, points[-2].validation_error, PAYS)


@asked_of_sources
def least_numbers(system: System, open_recipe: OpenRecipe, cost: float) -> FoundValues:
    """Return the open numbers of a recipe, if its curve ends as early as possible.

    The cost is the time in s in which one process simulates a trajectory.
    """
    recipe, open_keys = open_recipe.guess, open_recipe.open_keys
    train = recipe.data.train
    if "data.train" in open_keys:
        train = without_curve(cost, states_at_start(recipe, system)) or FIRST
    return _numbers_with(recipe, open_keys, train, cost)


def _numbers_with(
    recipe: Recipe, open_keys: Collection[str], train: int, cost: float
) -> FoundValues:
    """Return the open numbers of a recipe, given the number of training trajectories.

    The simulation of one trajectory takes ``cost`` s.
    """
    estimator = recipe.data.estimator
    if "data.estimator" in open_keys:
        estimator = max(ESTIMATOR, train)
    least = max(VALIDATION, train // SHARE), max(VALIDATION, estimator // ESTIMATOR_SHARE)
    of_bound = numbers_of_bound(train, cost, len(recipe.mix()))
    all_numbers: dict[str, int | str] = dict(
        zip(
            (*NUMBERS, *BOUND_NUMBERS),
            (train, least[0], estimator, least[1], *of_bound),
            strict=True,
        )
    )
    return nested({key: n for key, n in all_numbers.items() if key in open_keys})


def numbers_of_bound(train: int, cost: float, kinds: int) -> tuple[int | str, int, int]:
    """Return numbers of trajectories of an error bound: of companion, head and calibration.

    If a simulation takes little time, the numbers are the largest useful ones of a mix of so many
    kinds. If it takes more, the companion learns from the surrogate's trajectories, and the other
    numbers are smaller.
    """
    largest = (
        max(BOUND[1], BOUND_OF_KIND * kinds),
        max(CALIBRATION[1], OF_A_KIND * kinds),
    )
    if cost * (train + sum(largest)) <= BOUND_TIME:
        return train, *largest
    part = BOUND_TIME / (cost * sum(largest))
    fewest = BOUND[0], DEAR_CALIBRATION if cost > DEAR else CALIBRATION[0]
    head, calibration = (
        min(max(few, int(part * most)), most) for few, most in zip(fewest, largest, strict=True)
    )
    return "train", head, calibration


def too_few_of_a_kind(recipe: Recipe) -> str | None:
    """Say that a calibration is too small to promise anything of a kind of input; None if not."""
    kinds = len(recipe.mix())
    each, enough = recipe.data.calibration // max(1, kinds), OF_A_KIND
    if recipe.bound is None or kinds < 2 or each >= enough:
        return None
    return (
        f"The error bound is calibrated by {recipe.data.calibration} trajectories, {each} of each "
        f"of {kinds} kinds of input, since a simulation takes long. It covers about 95 % of all "
        f"together, and of single kinds perhaps less than {100 * KIND_CONFIDENCE:g} %, which "
        f"takes {enough} of each (data.calibration = {enough * kinds})."
    )


def _needs_cost(open_keys: Collection[str]) -> bool:
    return any(key in open_keys for key in ("data.train", *BOUND_NUMBERS))


def kept_cost(case: Case, folder: RunFolder) -> float | None:
    """Return the time in s that a trajectory of a recipe takes, if it was measured."""
    return _cost_file(case, folder).read_json(float) if _any_kept(folder, COST) else None


def trajectory_time(case: Case, folder: RunFolder, bar: Stages) -> float:
    """Return the time in s that a trajectory takes; one that is measured now is kept.

    Numbers that follow from it must not change any more.
    """
    cost = kept_cost(case, folder)
    if cost is not None:
        return cost
    progress = bar("time of a simulation")
    progress(0, 1)
    seconds, _, _ = guarded_case(case, simulation_time)
    cost = seconds * (case.recipe.data.duration + case.recipe.data.burn_in)
    _cost_file(case, folder).write_json(cost)
    progress(1, 1)
    return cost


def kept_curve(case: Case, folder: RunFolder) -> Curve:
    """Return the learning curve of a recipe and its model, as far as it was found."""
    known = _curve_file(case, folder).read_json(Curve) if _any_kept(folder, CURVE) else None
    return Curve() if known is None else known


def _any_kept(folder: RunFolder, name: str) -> bool:
    """Tell whether a result of this name may be there, before its model is simulated."""
    return any(folder.cache.glob(f"{name}-*.json"))


THREADS = 1
"""A curve is found with this number of threads, so that every machine sums in the same order, with
the same result."""


def _curve_file(case: Case, folder: RunFolder) -> ResultFile:
    """Return the file of the curve, whose key is that of a training, since its errors are learnt.

    The key has the number of threads of the curve, whatever that of torch is when it is read.
    """
    from slide_fmu.fitting.checkpoint import checkpoint_key  # this takes the time to import torch

    key = checkpoint_key(*_decisive(case, folder), threads=THREADS)
    return ResultFile(folder.cache / f"{CURVE}-{key}.json")


def _cost_file(case: Case, folder: RunFolder) -> ResultFile:
    """Return the file of the time of a trajectory, in s."""
    return ResultFile.of(folder.cache, COST, *_decisive(case, folder))


def _decisive(case: Case, folder: RunFolder) -> tuple[Tables, Tables, str]:
    """Return what decides curve and cost: no numbers of trajectories, and no seeds."""
    recipe = case.recipe
    data = recipe.data.model_dump(mode="json", exclude={*SPLITS, "seed"})
    tables = recipe.model_dump(
        mode="json", include={"system", "window", "network", "training", "parameters", "loop"}
    )
    del tables["training"]["seed"]
    of_seed_0 = recipe.model_copy(update={"data": recipe.data.model_copy(update={"seed": 0})})
    model = model_key(folder.cache, identity(case.source, of_seed_0))
    return tables, data, model


def _whole_curve(case: Case, folder: RunFolder, staged: _CurveData) -> Curve:
    """Go on with the curve that the folder keeps, until it has ended, and return it."""
    import torch

    from slide_fmu.fitting.learning_curve import LearningCurve

    curve, file = kept_curve(case, folder), _curve_file(case, folder)
    if curve.ended is not None:
        return curve
    torch.set_num_threads(THREADS)
    known = {point.trajectories: point.seconds for point in curve.points}
    learning = LearningCurve(case, folder.trajectories, folder.checkpoints)
    points: dict[int, CurvePoint] = {}

    def point(train: int) -> CurvePoint:
        """Return the point of a number of trajectories, which is found after all smaller ones."""
        if train not in points:
            number, begin = len(points) + 1, time.monotonic()
            staged.make(train, f"data of curve point {number} ({train} to train)")
            errors = learning.errors(train, VALIDATION, staged.bar(f"fit of curve point {number}"))
            # a known point is found quickly again, so its time is no measure
            seconds = known.get(train, time.monotonic() - begin)
            points[train] = CurvePoint(train, *errors, seconds)
            file.write_json(Curve(tuple(points.values())))
        return points[train]

    ladder = Ladder(
        error=lambda train: point(train).validation_error,
        dearer=lambda train: [2 * train],
        worth=PAYS,
        named=lambda train: f"{train} trajectories",
        enough=lambda train: _enough(point(train)),
    )
    climb = ladder.climb(FIRST)
    curve = Curve(tuple(points.values()), climb.explanation)
    file.write_json(curve)
    return curve


def _enough(point: CurvePoint) -> str | None:
    """Return the reason why no more trajectories than those of a point are tried, or None."""
    if point.validation_error <= HOLDS * point.training_error:
        return "what was learnt holds on other motions: more trajectories would teach nothing new"
    if point.trajectories >= MOST:
        return f"{MOST} trajectories are the most that are tried"
    return None


@dataclass(frozen=True, eq=False)
class _CurveData:
    """The trajectories of a learning curve, made stage by stage."""

    case: Case
    folder: RunFolder
    bar: Stages
    place: Workplace
    recipe_folder: Path | None

    def make(self, train: int, stage: str) -> None:
        """Make the training and validation trajectories of a stage with a name."""
        numbers = {"train": train, "validation": VALIDATION, "beyond": 0}
        recipe = self.case.recipe
        data = recipe.data.model_copy(update=numbers)
        # data of error estimator and bound are made when all numbers are known
        validation = recipe.validation.model_copy(update={"adversarial": 0})
        without = {"estimator": None, "bound": None, "validation": validation}
        changes = {"data": data, **without}
        staged = self.case.with_recipe(recipe.model_copy(update=changes))
        progress = self.bar(stage)
        self.place.make(staged, self.recipe_folder, self.folder.trajectories, progress)
