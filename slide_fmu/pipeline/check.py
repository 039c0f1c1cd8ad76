"""An FMU is checked: archive, description, library, credentials, experiment, and hashes."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from slide_fmu.cosim.archive import BINARIES, archive_problems, hash_problems
from slide_fmu.cosim.check import check_fmu
from slide_fmu.cosim.run import CoSimulationError
from slide_fmu.credentials.problems import credential_problems
from slide_fmu.credentials.replay import Replay, replay
from slide_fmu.fmu.export import FmuError, read_fmu
from slide_fmu.fmu.libraries.sources import FOLDER as SOURCES
from slide_fmu.pipeline.agreement import agreement_problems

CHANGEABLE = (BINARIES, f"{SOURCES}/")
"""Users may compile libraries of their own; what is run then is not known here."""


@dataclass(frozen=True)
class Checked:
    """This says what came of checking an FMU.

    Attributes:
        problems: one sentence each, with its remedy where there is one; empty when it is fine.
        replay: how its experiment went here; None if it was not repeated, or there is none.
    """

    problems: list[str]
    replay: Replay | None = None

    def figures(self, fmu: Path) -> dict[str, Any]:
        """Return what is written as JSON."""
        repeated = {} if self.replay is None else {"replay": asdict(self.replay)}
        return {"fmu": str(fmu), "problems": self.problems, **repeated}


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
        problems += credential_problems(fmu, surrogate)
        problems += agreement_problems(fmu, surrogate, provenance)
        # what is said above says more of a member than that its hash is another one
        problems = problems or hash_problems(fmu, CHANGEABLE if run else ())
        if problems or not run:
            return Checked(problems)
        found = replay(fmu, surrogate)
    except (FmuError, OSError) as error:
        return Checked([*problems, str(error)])
    except CoSimulationError as error:
        return Checked([f"the experiment cannot be repeated: {error}"])
    return Checked([] if found is None else found.problems(), found)
