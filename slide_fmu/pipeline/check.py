"""An FMU is checked: archive, description, library, credentials, experiment, and hashes."""

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
"""Users may compile libraries of their own; what is run then is not known here."""


@dataclass(frozen=True)
class CheckFigures:
    """These are the figures of a check; what apps have repeated stands beside the problems."""

    fmu: str
    problems: tuple[str, ...]
    repeated: Mapping[str, Any] = spread()


@dataclass(frozen=True)
class Checked:
    """This says what came of checking an FMU.

    Attributes:
        problems: one sentence each, with its remedy where there is one; empty when it is fine.
        repeated: how what it carries to be repeated went here, by the names of the apps.
    """

    problems: list[str]
    repeated: Mapping[str, Repeated] = field(default_factory=dict)

    def figures(self, fmu: Path) -> CheckFigures:
        """Return what is written as JSON."""
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
    except (FmuError, OSError):  # check_fmu has said it
        return Checked(problems)
    try:
        found = app_problems(fmu, surrogate, provenance)
        problems += dict.fromkeys([*found, *card_problems(fmu, surrogate, provenance)])
        # what is said above says more of a member than that its hash is another one
        problems = problems or hash_problems(fmu, CHANGEABLE if run else ())
        if problems or not run:
            return Checked(problems)
        runs = repeated(fmu, surrogate)
    except (FmuError, OSError) as error:
        return Checked([*problems, str(error)])
    except CoSimulationError as error:
        return Checked([f"the experiment cannot be repeated: {error}"])
    return Checked([problem for run in runs.values() for problem in run.problems], runs)
