"""A run folder holds the work on one recipe, which can be resumed stage by stage.

Nothing is locked. Every file is written whole, and every result is kept under the key of what
decides it, so that programs which work in one folder at the same time write the same.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from slide_fmu.core.files import write_whole
from slide_fmu.core.result_cache import ResultFile
from slide_fmu.fitting.history import History
from slide_fmu.fmu.export import Provenance
from slide_fmu.recipe.automatic import Tables
from slide_fmu.recipe.reading import parse_open_recipe
from slide_fmu.recipe.recipe import Recipe, tables_of_training
from slide_fmu.surrogate.surrogate import Surrogate


class StageError(ValueError):
    """A stage is called before the one it builds on."""


@dataclass(frozen=True, eq=False)
class TrainedSurrogate:
    """A TrainedSurrogate is kept by the run folder with the history of its training.

    Attributes:
        surrogate: the surrogate, with its error estimator if it has one.
        histories: course of the trainings, by stage; empty if it was trained elsewhere.
        versions: versions of the packages that trained it.
        start: part of its provenance that names the FMU with which the training began, if any.
    """

    surrogate: Surrogate
    histories: Mapping[str, History]
    versions: Mapping[str, str]
    start: Provenance = field(default_factory=dict)


@dataclass(frozen=True)
class TrainingRecord:
    """A TrainingRecord is the file in the run folder on what its surrogate was trained from.

    Attributes:
        key: key of all that decided the training.
        surrogate: SHA-256 of the surrogate file.
        recipe: the recipe as resolved.
        versions, histories, start: as of ``TrainedSurrogate``.
    """

    key: str
    surrogate: str
    recipe: Tables
    versions: Mapping[str, str]
    histories: Mapping[str, History]
    start: Provenance


@dataclass(frozen=True)
class RunFolder:
    """A run folder, ``runs/<name>``, holds the files of one recipe's run.

    Attributes:
        path: the folder.
        whole: folder of the whole run, for a quick one: what is found by all that decides it,
            trajectories and the cache, serves both.
    """

    path: Path
    whole: Path | None = None

    @classmethod
    def of(cls, runs: Path, name: str, quick: bool = False) -> RunFolder:
        """Return the folder of a recipe's run in the folder of all runs."""
        return cls(runs / name / "quick", runs / name) if quick else cls(runs / name)

    def require_folder(self) -> None:
        """Raise a StageError where the place is used by something other than a folder."""
        there = next(place for place in (self.path, *self.path.parents) if place.exists())
        if not there.is_dir():
            raise StageError(
                f"{there} is a file; expected a folder, since the work on the recipe is kept in "
                f"{self.path}: move the file away, or work in another folder (--runs FOLDER)"
            )

    @property
    def trajectories(self) -> Path:
        """Folder of the trajectories; what is removed there is made again."""
        return (self.whole or self.path) / "trajectories"

    @property
    def checkpoints(self) -> Path:
        """Place of the states of interrupted trainings."""
        return self.path / "checkpoints"

    @property
    def surrogate(self) -> Path:
        """Place of the trained surrogate."""
        return self.path / "surrogate.slide"

    @property
    def training(self) -> Path:
        """Place of the recipe and history of the training."""
        return self.path / "training.json"

    @property
    def cache(self) -> Path:
        """Folder of results that are found again by what decides them; it may be removed."""
        return (self.whole or self.path) / "cache"

    @property
    def sizing(self) -> Path:
        """Place of the figures of the last sizing of the window."""
        return self.path / "window.json"

    def fmu(self, recipe: Recipe) -> Path:
        """Return the place of the FMU."""
        return self.path / f"{recipe.name}.fmu"

    def refusal(self, surrogate: Surrogate, recipe: Recipe) -> ResultFile:
        """Return the file with the reason why a run has refused a surrogate that it measured."""
        allowed = recipe.stability.model_dump(mode="json")
        decides = hashlib.sha256(surrogate.to_bytes()).hexdigest(), allowed
        return ResultFile.of(self.cache, "refusal", *decides)

    def save_training(self, trained: TrainedSurrogate, recipe: Recipe, key: str = "") -> None:
        """Keep a trained surrogate with its recipe, and the key of what decided the training."""
        data = trained.surrogate.to_bytes()
        record = TrainingRecord(
            key=key,
            surrogate=hashlib.sha256(data).hexdigest(),
            recipe=recipe.model_dump(mode="json"),
            versions=trained.versions,
            histories=trained.histories,
            start=trained.start,
        )
        write_whole(self.surrogate, data)
        self._record.write_json(record)

    def require_surrogate(self) -> None:
        """Raise a StageError without a trained surrogate."""
        if not (self.surrogate.exists() and self.training.exists()):
            raise StageError(
                f"no trained surrogate in {self.path}; train it first (slide-fmu train RECIPE), "
                "or name the folder of its run: --runs FOLDER"
            )

    def load_surrogate(self, recipe: Recipe) -> TrainedSurrogate:
        """Return the trained surrogate of a recipe.

        Raises:
            DamagedFileError: the file about its training cannot be read.
            StageError: no surrogate was trained here, or it was trained from another recipe.
        """
        self.require_surrogate()
        record = self._record.read_json(TrainingRecord)
        assert record is not None  # it is required
        now = tables_of_training(recipe.model_dump(mode="json"))
        if tables_of_training(record.recipe) != now:
            raise StageError(
                f"{self.surrogate} was trained from other values than recipe {recipe.name!r} "
                f"holds now, by slide-fmu {record.versions.get('slide-fmu')}; train again "
                "(slide-fmu train RECIPE), restore the recipe, or use that version"
            )
        return self._trained(record)

    def known_training(self, key: str) -> TrainedSurrogate | None:
        """Return the surrogate of the training with this key; None if it must be trained."""
        with suppress(ValueError, OSError):  # a damaged one is trained again
            record = self._record.read_json(TrainingRecord)
            if record is not None and record.key == key:
                return self._trained(record)
        return None

    @property
    def _record(self) -> ResultFile:
        return ResultFile(self.training, "train again (slide-fmu train RECIPE)")

    def _trained(self, record: TrainingRecord) -> TrainedSurrogate:
        """Return the surrogate that belongs to the record of its training."""
        data = self.surrogate.read_bytes()
        if record.surrogate != hashlib.sha256(data).hexdigest():
            raise StageError(
                f"{self.surrogate} and {self.training.name} do not belong together: a "
                "training was stopped while it wrote them; train again (slide-fmu train RECIPE)"
            )
        surrogate = Surrogate.from_bytes(data)
        return TrainedSurrogate(surrogate, record.histories, record.versions, record.start)


def recipe_of_provenance(provenance: Provenance | None, source: str) -> Recipe:
    """Return the recipe that a released FMU carries; ``source`` is its name in messages.

    Open keys have the values that were found (``resolved``), and numbers of a quick run are at
    most those of ``quick``.

    Raises:
        StageError: the FMU carries no recipe.
        RecipeError: it is no valid recipe, or its values do not fit it.
    """
    if not provenance or not isinstance(provenance.get("recipe"), str):
        raise StageError(
            f"{source} carries no recipe, so its reference system is unknown; expected an FMU "
            "made by slide-fmu run or slide-fmu export"
        )
    place = f"recipe in {source}"
    read = parse_open_recipe(provenance["recipe"], place, provenance.get("quick"))
    return read.with_found(provenance.get("resolved", {}), place).resolved()
