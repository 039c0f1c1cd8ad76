"""This app adds credentials: files of an FMU, their checks, and a run that importers can
repeat."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from slide_fmu.pipeline.apps import App, Release, RepeatedRun

if TYPE_CHECKING:
    from slide_fmu.fmu.export import Provenance
    from slide_fmu.surrogate.surrogate import Surrogate


def _members(release: Release) -> Mapping[str, bytes]:
    from slide_fmu.apps.credentials.files import members_of

    return members_of(release)


def _problems(fmu: Path, surrogate: Surrogate, provenance: Provenance | None) -> list[str]:
    from slide_fmu.apps.credentials.problems import credential_problems, metadata_problems

    return [
        *credential_problems(fmu, surrogate),
        *metadata_problems(fmu, surrogate, provenance),
    ]


def _repeat(fmu: Path, surrogate: Surrogate) -> RepeatedRun | None:
    from slide_fmu.apps.credentials.replay import replay

    run_again = replay(fmu, surrogate)
    return None if run_again is None else run_again.repeated()


def _example_run(fmu: Path) -> tuple[Mapping[str, float], dict[str, bytes]] | None:
    """Return the parameters and the CSV files of the experiment of an FMU; None if it has none.

    Raises:
        CredentialError: the experiment is damaged.
    """
    from slide_fmu.apps.credentials import members
    from slide_fmu.apps.credentials.experiment import read_experiment
    from slide_fmu.fmu.export import read_member

    experiment = read_experiment(fmu)
    if experiment is None:
        return None
    files = {
        "inputs": members.INPUTS,
        "results": members.RESULTS,
        "reference": members.REFERENCE_MODEL,
    }
    read = {name: read_member(fmu, member) or b"" for name, member in files.items()}
    return experiment.parameters, read


APP = App(
    members=_members,
    problems=_problems,
    repeat=_repeat,
    example_run=_example_run,
)
