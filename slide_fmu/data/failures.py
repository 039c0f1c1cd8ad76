"""This module keeps failed trajectories with their inputs in a folder next to the others.

Another draw takes the place of each; where too many fail, the run ends. Trajectories beyond the
range are left out and do not count, since a model need not work there.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from slide_fmu.core.files import write_whole
from slide_fmu.core.result_cache import ResultFile
from slide_fmu.core.signals import FloatArray
from slide_fmu.data.draws import BEYOND_ATTEMPTS, attempted, split_stream
from slide_fmu.data.parameter_draws import leaves_ranges
from slide_fmu.data.trajectories import Trajectories, drawn_splits
from slide_fmu.recipe.case import Case
from slide_fmu.recipe.recipe import SPLITS, Recipe


@dataclass(frozen=True)
class Failure:
    """A Failure is one trajectory that could not be simulated.

    Attributes:
        split, index: split and index of the trajectory.
        attempt: number of draws for it that failed before.
        time_s: time of the failure in s from the start of its burn-in; None if unknown.
        error: message of the system.
    """

    split: str
    index: int
    attempt: int
    time_s: float | None
    error: str

    @property
    def name(self) -> str:
        """Name of its files, before the key of its trajectory: ``NAME-KEY.json`` describes the
        failure, ``NAME-KEY.csv`` holds the inputs.

        The recipe's excitation of the kind ``file`` reads such inputs.
        """
        return f"{self.split}_{self.index}_{self.attempt}"


def failures_folder(folder: Path) -> Path:
    """Return the folder of the failures, next to that of the trajectories."""
    return folder.with_name("failures")


def keep_failure(trajectories: Trajectories, failure: Failure, inputs: FloatArray) -> None:
    """Write a failure and its inputs, shape (N, n_inputs), burn-in first."""
    system = trajectories.case.system
    time = system.step * np.arange(len(inputs))
    table = [",".join(["time", *(signal.name for signal in system.inputs)])]
    table += [",".join(map(repr, row)) for row in np.column_stack([time, inputs]).tolist()]
    place = _file(trajectories, failure.split, failure.index, failure.attempt)
    write_whole(place.with_suffix(".csv"), "\n".join([*table, ""]).encode())
    ResultFile(place).write_json(failure)


def _file(trajectories: Trajectories, split: str, index: int, attempt: int | str) -> Path:
    """Return the place of a failure; its name has the key of the trajectory that failed."""
    name = f"{split}_{index}_{attempt}-{trajectories.key(split, index)}.json"
    return failures_folder(trajectories.folder) / name


def kept_failures(case: Case, folder: Path) -> list[Failure]:
    """Read all failures of a recipe, ordered by name; the folder is that of its trajectories.

    The system is simulated, on a short motion, only where some trajectory has failed.

    Raises:
        DamagedFileError: the file of a failure is damaged.
    """
    if not failures_folder(folder).exists():
        return []
    return _read(_files(Trajectories.of(case, folder)))


def _read(files: dict[str, Path]) -> list[Failure]:
    kept = (ResultFile(path).read_json(Failure) for path in files.values())
    return [failure for failure in kept if failure is not None]


def _files(trajectories: Trajectories) -> dict[str, Path]:
    """Return the files of failures of the recipe by their names, in order."""
    recipe, files = trajectories.case.recipe, {}
    for path in sorted(failures_folder(trajectories.folder).glob("*_*_*-*.json")):
        name, _, key = path.stem.rpartition("-")
        split, index, _ = name.rsplit("_", 2)
        if split in drawn_splits(recipe) and key == trajectories.key(split, int(index)):
            files[name] = path
    return files


def forget_failed(trajectories: Trajectories) -> None:
    """Remove the failures of a recipe, and what took their places, so that all are made again."""
    for name, path in _files(trajectories).items():
        split, index, _ = name.rsplit("_", 2)
        trajectories.remove(split, int(index))
        path.with_suffix(".csv").unlink(missing_ok=True)
        path.unlink(missing_ok=True)


def allowed_failures(recipe: Recipe) -> int:
    """Return how many trajectories of a recipe may fail, at least one."""
    total = recipe.total_count
    return max(1, int(recipe.data.most_failures * total))


def too_many_failures(trajectories: Trajectories) -> str | None:
    """Return why a run must end, if too many trajectories failed; None while it may go on."""
    recipe, folder = trajectories.case.recipe, failures_folder(trajectories.folder)
    files = _files(trajectories)
    counted = [name for name in files if not is_beyond(recipe, name)]
    count, allowed = len(counted), allowed_failures(recipe)
    if count <= allowed:
        return None
    first = next(iter(_read({name: files[name] for name in counted})), None)
    if first is None:  # another program has begun anew, and removed them all
        return None
    learnt = {**recipe.tables_of_kinds(), "validation": ()}
    tables = ", ".join(f"{table}.excitation" for table, kinds in learnt.items() if kinds)
    tables += ", loop" if recipe.loop else ""
    return (
        f"{count} trajectories could not be simulated, {allowed} may fail (data.most_failures = "
        f"{recipe.data.most_failures:g}); {folder} has the inputs of each and "
        f"the message of each, for example {first.name}: {first.error}. Correct the model, narrow "
        f"the ranges of its inputs (system.inputs, {tables}){_of_parameters(recipe)}, or "
        "allow more"
    )


def _of_parameters(recipe: Recipe) -> str:
    return " or parameters (parameters.NAME.range)" if recipe.parameters else ""


def is_beyond(recipe: Recipe, name: str) -> bool:
    """Tell whether the failure ``name`` was a draw beyond the ranges of inputs or parameters."""
    split, index, attempt = name.rsplit("_", 2)
    stream = split_stream(recipe, split, int(index))
    if attempted(stream, int(attempt)).beyond:
        return True
    return leaves_ranges(recipe, stream, int(index), int(attempt))


def remark_on_beyond(case: Case, folder: Path) -> str | None:
    """Say which trajectories beyond the range were left out; None if all were simulated.

    Raises:
        DamagedFileError: the file of a failure is damaged.
    """
    recipe = case.recipe
    failed = [one for one in kept_failures(case, folder) if is_beyond(recipe, one.name)]
    of_inputs = [one for one in failed if split_stream(recipe, one.split, one.index).beyond]
    of_parameters = [one for one in failed if one not in of_inputs]
    remarks = _inputs_remark(recipe, of_inputs), _parameters_remark(recipe, of_parameters)
    return " ".join(remark for remark in remarks if remark is not None) or None


def _lost(failed: list[Failure]) -> list[Failure]:
    """Return the last failure of each trajectory that failed on every draw beyond the ranges."""
    return [one for one in failed if one.attempt == BEYOND_ATTEMPTS - 1]


def _inputs_remark(recipe: Recipe, failed: list[Failure]) -> str | None:
    lost = _lost(failed)
    if not lost:
        return None
    splits = {split for split in SPLITS if recipe.count(split)}
    wanted = sum(
        split_stream(recipe, split, index).beyond
        for split in splits
        for index in range(recipe.count(split))
    )
    of_data = [one for one in lost if one.split == "beyond"]
    keys = ["data.beyond"] * bool(of_data) + ["estimator.beyond"] * (len(of_data) < len(lost))
    return (
        f"{len(lost)} of {wanted} trajectories beyond the ranges of the inputs, which "
        f"{' and '.join(keys)} asks for, could not be simulated. They are left out, and as many "
        f"within the ranges take their place; the first failed so: {failed[0].error}"
    )


def _parameters_remark(recipe: Recipe, failed: list[Failure]) -> str | None:
    lost = _lost(failed)
    if not lost:
        return None
    keys = [
        f"parameters.{name}.beyond" for name, table in recipe.parameters.items() if table.beyond
    ]
    return (
        f"{len(lost)} trajectories with values beyond the ranges of the parameters, which "
        f"{' and '.join(keys)} asks for, could not be simulated. They are left out, and as many "
        f"with values within the ranges take their place; the first failed so: {failed[0].error}"
    )
