"""This module checks an FMU: archive, description, library, hashes, and files of apps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from slide_fmu.core.figures import spread
from slide_fmu.cosim.archive import BINARIES, archive_problems, hash_problems
from slide_fmu.cosim.check import check_fmu
from slide_fmu.cosim.run import CoSimulationError
from slide_fmu.fmu.export import FmuError, read_fmu
from slide_fmu.fmu.libraries.sources import FOLDER as SOURCES
from slide_fmu.pipeline.agreement import card_problems
from slide_fmu.pipeline.apps import Repeated, app_problems, repeated

CHANGEABLE = (BINARIES, f"{SOURCES}/")
"""Files that users may compile themselves; their content is then unknown here."""


@dataclass(frozen=True)
class CheckFigures:
    """These are the figures of a check: problems, and the results of apps."""

    fmu: str
    problems: tuple[str, ...]
    repeated: Mapping[str, Any] = spread()


@dataclass(frozen=True)
class Checked:
    """This is the result of checking an FMU.

    Attributes:
        problems: one sentence each, with its remedy where there is one; empty without problems.
        repeated: results of repeated runs, by the names of the apps.
    """

    problems: list[str]
    repeated: Mapping[str, Repeated] = field(default_factory=dict)

    def figures(self, fmu: Path) -> CheckFigures:
        """Return the figures that are written as JSON."""
        repeated = {k: v for run in self.repeated.values() for k, v in run.figures.items()}
        return CheckFigures(str(fmu), tuple(self.problems), repeated)


def check(fmu: Path, run: bool) -> Checked:
    """Check an FMU; its experiment is repeated only if its library may be run in any case.

    Args:
        fmu: the file.
        run: whether a library that this version does not know is loaded and run, and the
            experiment that the FMU carries is repeated.
    """
    problems = check_fmu(fmu, run)
    try:
        surrogate, provenance = read_fmu(fmu)
        if archive_problems(fmu):
            return Checked(problems)
    except (FmuError, OSError):  # check_fmu has reported it
        return Checked(problems)
    try:
        found = app_problems(fmu, surrogate, provenance)
        problems += dict.fromkeys([*found, *card_problems(fmu, surrogate, provenance)])
        # the problems above tell more about a member than a different hash
        problems = problems or hash_problems(fmu, CHANGEABLE if run else ())
        if problems or not run:
            return Checked(problems)
        runs = repeated(fmu, surrogate)
    except (FmuError, OSError) as error:
        return Checked([*problems, str(error)])
    except CoSimulationError as error:
        return Checked([f"the experiment cannot be repeated: {error}"])
    return Checked([problem for run in runs.values() for problem in run.problems], runs)
