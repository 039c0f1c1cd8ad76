"""This module checks an FMU: archive, description, library, hashes, and files of apps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from slide_fmu.core.figures import spread
from slide_fmu.core.version import __version__, other_writer
from slide_fmu.core.zip_directory import open_archive
from slide_fmu.cosim.archive import BINARIES, archive_problems, hash_problems
from slide_fmu.cosim.check import check_fmu, fmi_version, runs_here, steps_of_check
from slide_fmu.fmu.export import DESCRIPTION, Provenance, read_fmu
from slide_fmu.fmu.libraries.platforms import library_members
from slide_fmu.fmu.libraries.sources import FOLDER as SOURCES
from slide_fmu.importer.errors import CoSimulationError, FmuError
from slide_fmu.pipeline.apps import RepeatedRun, app_problems, apps, repeated
from slide_fmu.pipeline.card_check import card_problems
from slide_fmu.pipeline.documents import CARD
from slide_fmu.surrogate.surrogate import Surrogate

CHANGEABLE = (BINARIES, f"{SOURCES}/")
"""Files that users may compile themselves; their content is then unknown here."""


@dataclass(frozen=True)
class CheckFigures:
    """These are the figures of a check.

    They are the problems, what was checked and what was not, and the results of apps.
    """

    fmu: str
    problems: tuple[str, ...]
    checked: tuple[str, ...]
    not_checked: tuple[str, ...]
    repeated: Mapping[str, Any] = spread()


@dataclass(frozen=True)
class CheckResult:
    """This is the result of checking an FMU.

    Attributes:
        problems: one sentence each, with its remedy where there is one; empty without problems.
        repeated: results of repeated runs, by the names of the apps.
        parts: what was checked, a few words each; empty where problems ended the check.
        left_out: what was not checked, with the reason.
    """

    problems: list[str]
    repeated: Mapping[str, RepeatedRun] = field(default_factory=dict)
    parts: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()

    def figures(self, fmu: Path) -> CheckFigures:
        """Return the figures that are written as JSON."""
        repeated = {k: v for run in self.repeated.values() for k, v in run.figures.items()}
        problems = tuple(self.problems)
        return CheckFigures(str(fmu), problems, self.parts, self.left_out, repeated)


def check(fmu: Path, run: bool) -> CheckResult:
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
            return CheckResult(problems)
    except (FmuError, OSError):  # check_fmu has reported it
        return CheckResult(problems)
    checked = _check_contents(fmu, surrogate, provenance, problems, run)
    repeatable = not run and not checked.problems
    return replace(checked, left_out=left_out(provenance, repeatable))


def left_out(provenance: Provenance | None, repeatable: bool) -> tuple[str, ...]:
    """Say what is not checked of an FMU; ``repeatable``: its outputs can be with ``--run``."""
    writer = other_writer(provenance)
    words = (
        f"the words of model card and credentials: version {writer} of slide-fmu wrote them, and "
        f"this is {__version__}"
    )
    again = "whether its outputs can be repeated (--run)"
    return (*[words] * (writer is not None), *[again] * repeatable)


def _check_contents(
    fmu: Path, surrogate: Surrogate, provenance: Provenance | None, problems: list[str], run: bool
) -> CheckResult:
    """Check what an FMU that can be read says about itself, after its library."""
    try:
        of_apps = app_problems(fmu, surrogate, provenance)
        problems += dict.fromkeys([*of_apps, *card_problems(fmu, surrogate, provenance)])
        # the problems above tell more about a member than a different hash
        problems = problems or hash_problems(fmu, CHANGEABLE if run else ())
        if problems:
            return CheckResult(problems)
        by_us = other_writer(provenance) is None
        parts = checked_parts(fmu, surrogate, run, by_us)
        if not run:
            return CheckResult(problems, parts=parts)
        runs = repeated(fmu, surrogate)
    except (FmuError, OSError) as error:
        return CheckResult([*problems, str(error)])
    except CoSimulationError as error:
        return CheckResult([f"the experiment cannot be repeated: {error}"])
    others = [problem for one in runs.values() for problem in one.problems]
    return CheckResult(
        others, runs, (*parts, *["the experiment that it carries, repeated"] * bool(runs))
    )


def checked_parts(fmu: Path, surrogate: Surrogate, run: bool, by_us: bool) -> tuple[str, ...]:
    """Say what was checked of an FMU without problems; ``by_us``: this version wrote its card."""
    with open_archive(fmu) as archive:
        names = [name for name in archive.namelist() if not name.endswith("/")]
    fmi = fmi_version(fmu)
    shipped = [member for member in library_members(surrogate.name, fmi) if member in names]
    sources = [name for name in names if name.startswith(f"{SOURCES}/")]
    platforms = [member.split("/")[1] for member in shipped]
    unknown = " (their content is not compared with --run)" if run else ", as in this version"
    steps = steps_of_check(surrogate)
    parts = [
        f"archive: {len(names)} files; hashes of all of them{' but libraries and sources' * run}",
        f"{DESCRIPTION}: valid for FMI {fmi}.0, and all variables as in this version",
        f"libraries for {', '.join(platforms)}{unknown}",
        *([f"C sources: {len(sources)} files{unknown}"] if sources else []),
    ]
    if runs_here(surrogate, fmi):
        parts.append(f"library of this computer: {steps} random steps agree with numpy")
    if CARD in names and by_us:
        parts.append("model card: it agrees with the measured figures inside")
    parts += [f"files of the app {name!r}" for name, app in apps().items() if app.problems]
    return tuple(parts)
