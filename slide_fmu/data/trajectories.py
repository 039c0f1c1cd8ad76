"""The trajectories of a recipe are files, each named by the key of what decides it.

That is what the model answers to a short motion, and what its motion is drawn from: the values of
the recipe, the seed, the split and the index. So a recipe finds all trajectories that it has in
common with former ones, and only what has changed is simulated. A file is written whole: if a
program is killed, its trajectory is missing. Two programs may make one trajectory at once, and
write the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import final

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.result_cache import DamagedFileError, ResultFile, key_of
from slide_fmu.core.signals import FloatArray, Trajectory
from slide_fmu.data.draws import split_stream
from slide_fmu.data.model_answers import identity, model_key
from slide_fmu.recipe.automatic import Tables
from slide_fmu.recipe.case import Case
from slide_fmu.recipe.model_rules import rules_of
from slide_fmu.recipe.recipe import FURTHER, SPLITS, Recipe

DRAWS = 3
"""This number rises when the same values of a recipe draw other motions, or more is kept of them.
"""

WITH_STATES = ("train", "validation", "companion")
"""Splits whose trajectories have the states of the system, if it offers them."""

AGAIN = "generate again (slide-fmu generate RECIPE), which makes it alone"
"""The remedy for a damaged trajectory."""

MOST_READ = 10_000
"""A recipe's trajectories are read for damage before others are made, unless there are more: that
would take minutes. The training names a damaged one."""


class TrajectoryError(ValueError):
    """Trajectories of a recipe are missing."""


@dataclass(frozen=True, eq=False)
class Split:
    """A split holds trajectories of equal length, as arrays.

    Attributes:
        inputs: inputs in their units, shape (n_trajectories, N, n_inputs).
        outputs: outputs in their units, shape (n_trajectories, N + 1, n_outputs).
        kinds: index of each trajectory's excitation in the recipe's mix, or of its record file,
            shape (n_trajectories,).
        parameters: values of each trajectory's physical parameters, in their units, shape
            (n_trajectories, n_parameters); None without parameters.
        states: states of the system at the outputs, in their units, shape (n_trajectories, N + 1,
            n_states); None if the system does not show them.
    """

    inputs: FloatArray
    outputs: FloatArray
    kinds: NDArray[np.int64]
    parameters: FloatArray | None = None
    states: FloatArray | None = None

    def chosen(self, numbers: Sequence[int] | NDArray[np.int64] | slice) -> Split:
        """Return the split of these trajectories, by their numbers."""
        parts = {name: part[numbers] for name, part in vars(self).items() if part is not None}
        return Split(**parts)


@final
@dataclass(frozen=True, eq=False)
class Trajectories:
    """The trajectories of a recipe in a folder, which may hold those of other recipes too.

    Attributes:
        folder: the folder, with a folder for each split.
        case: the recipe, and the source of its trajectories.
        model: key of what the source answers (``slide_fmu.data.model_answers.model_key``).
    """

    folder: Path
    case: Case
    model: str

    @classmethod
    def of(cls, case: Case, folder: Path) -> Trajectories:
        """Return the trajectories of a case; its source is simulated on a short motion.

        Raises:
            LoadError: the source cannot be made.
            SimulationError: it could not be simulated.
            OSError: what it answers cannot be written to the folder.
        """
        return cls(folder, case, model_key(folder, identity(case.source, case.recipe)))

    def key(self, split: str, index: int) -> str:
        """Return the key of everything that decides a trajectory; the index counts from 0."""
        return key_of(self._keys[split], split_stream(self.case.recipe, split, index), index)

    @cached_property
    def _keys(self) -> dict[str, str]:
        """The key, by split, of what decides all trajectories of the split."""
        recipe = self.case.recipe
        inputs = [  # a model's own declarations, which its answers need not show
            (one.low, one.high, one.start_value, one.hold, one.angle, one.period)
            for one in self.case.source.inputs
        ]
        return {
            split: key_of(DRAWS, self.model, inputs, values_of_draws(recipe.drawn_for(split)))
            for split in drawn_splits(recipe)
        }

    def file(self, split: str, index: int) -> ResultFile:
        """Return the file of a trajectory."""
        name = f"{index:06d}-{self.key(split, index)}.npz"
        return ResultFile(self.folder / split / name, AGAIN)

    def is_whole(self, split: str, index: int) -> bool:
        """Tell whether a trajectory is there and undamaged.

        Its file is read whole, and its hash checked.
        """
        try:
            return self.file(split, index).read() is not None
        except DamagedFileError:
            return False

    def missing(self) -> list[tuple[str, int]]:
        """List split and index of the recipe's trajectories that are not there, or damaged.

        All their files are read whole. Of more than ``MOST_READ`` trajectories none is read: a
        damaged one then counts as there.
        """
        recipe = self.case.recipe
        wanted = [(split, index) for split in SPLITS for index in range(recipe.count(split))]
        if len(wanted) > MOST_READ:
            return [one for one in wanted if not self.file(*one).path.exists()]
        return [one for one in wanted if not self.is_whole(*one)]

    def require(self) -> None:
        """Refuse a folder that lacks trajectories of the recipe.

        Raises:
            TrajectoryError: it lacks some; the message has their number.
        """
        missing = [split for split, _ in self.missing()]
        for split in missing[:1]:
            raise self._lacking(split, missing.count(split), self.case.recipe.count(split))

    def write(
        self,
        split: str,
        index: int,
        trajectory: Trajectory,
        kind: int,
        parameters: FloatArray | None = None,
    ) -> None:
        """Write a trajectory; ``kind`` and the parameters, (n_parameters,), are as in ``Split``.

        Columns of outputs behind those of the source are states.

        Raises:
            FullDiskError: the disk is full.
            OSError: the file cannot be written.
        """
        count = len(self.case.source.outputs)
        arrays = {
            "inputs": trajectory.inputs,
            "outputs": trajectory.outputs[:, :count],
            "kind": np.array(kind, dtype=np.int64),
        }
        states = trajectory.outputs[:, count:]
        if states.shape[1] and split in WITH_STATES:
            arrays["states"] = states
        if parameters is not None:
            arrays["parameters"] = parameters
        self.file(split, index).write_arrays(arrays)

    def remove(self, split: str, index: int) -> None:
        """Remove a trajectory, so that it is made again."""
        self.file(split, index).path.unlink(missing_ok=True)

    def read(self, split: str, count: int | None = None) -> Split:
        """Read the first ``count`` trajectories of a split; those of the recipe if None.

        Raises:
            TrajectoryError: trajectories are missing.
            DamagedFileError: a file is damaged.
        """
        recipe, source = self.case.recipe, self.case.source
        count = recipe.count(split) if count is None else count
        read = [self.file(split, index).read_arrays() for index in range(count)]
        there = [arrays for arrays in read if arrays is not None]
        if len(there) < count:
            raise self._lacking(split, count - len(there), count)
        samples = round(recipe.data.duration / recipe.window.step)

        def stacked(name: str, *shape: int) -> FloatArray:
            return _stacked([arrays[name] for arrays in there], shape)

        return Split(
            stacked("inputs", samples, len(source.inputs)),
            stacked("outputs", samples + 1, len(source.outputs)),
            np.array([int(arrays["kind"]) for arrays in there], dtype=np.int64),
            stacked("parameters", len(recipe.parameters)) if recipe.parameters else None,
            _states([arrays.get("states") for arrays in there]),
        )

    def _lacking(self, split: str, missing: int, count: int) -> TrajectoryError:
        return TrajectoryError(
            f"{self.folder}: {missing} of {count} trajectories of split {split!r} are missing for "
            "the values of this recipe and its model: generate them first "
            "(slide-fmu generate RECIPE)"
        )


def _stacked(arrays: Sequence[FloatArray], shape: tuple[int, ...]) -> FloatArray:
    """Stack arrays of a shape; there may be none."""
    stack = np.empty((len(arrays), *shape))
    for row, values in enumerate(arrays):
        stack[row] = values
    return stack


def _states(of_each: Sequence[FloatArray | None]) -> FloatArray | None:
    """Stack the states of trajectories; None where the system does not show them."""
    there = [states for states in of_each if states is not None]
    return np.stack(there) if there and len(there) == len(of_each) else None


def drawn_splits(recipe: Recipe) -> list[str]:
    """Return the splits that a recipe has motions for, whatever their numbers are."""
    return [split for split in SPLITS if split != FURTHER or recipe.further_kinds()]


NO_DRAW = {"reference", "picture", "chain", "drive", "noise_record"}
"""Keys of the table ``system`` on which no trajectory depends."""


def values_of_draws(recipe: Recipe) -> Tables:
    """Return the values of a recipe that its motions are drawn and simulated from.

    Numbers of trajectories are no part of them, nor what is in the stream of a trajectory
    (``split_stream``).
    """
    no_data = {*SPLITS, "most_failures", "beyond_factor"}
    return {
        "system": recipe.system.model_dump(mode="json", exclude=NO_DRAW),
        "step": recipe.window.step,
        "data": recipe.data.model_dump(mode="json", exclude=no_data),
        **recipe.model_dump(mode="json", include={"parameters", "loop"}),
        **rules_of(recipe).decisive_for_data(recipe),
    }
