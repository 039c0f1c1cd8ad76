"""The experiment of an FMU is repeated here, and compared with the stored results."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from slide_fmu.apps.credentials.experiment import Experiment, read_experiment
from slide_fmu.core.measures import percent
from slide_fmu.cosim.bound_check import bound_deviations
from slide_fmu.cosim.check import OUTPUT_TOLERANCE
from slide_fmu.cosim.whole_run import run_fmu
from slide_fmu.importer.file import unpacked
from slide_fmu.pipeline.apps import RepeatedRun
from slide_fmu.report.table import ReportTable
from slide_fmu.surrogate.surrogate import Surrogate

SHARE_TOLERANCE = 1e-8
"""Largest difference of the filled part of the window: tables have nine digits."""


@dataclass(frozen=True)
class Replay:
    """A Replay has the differences between new outputs of an FMU and the stored ones.

    Attributes:
        steps: number of communication steps.
        differences: largest difference of each variable, in its unit, by name; for error bounds,
            novelty and domain as in ``slide_fmu.cosim.bound_check.bound_deviations``.
        allowed: largest allowed differences.
        errors: RMSE of each output against the reference over the reference's RMS, as stored.
    """

    steps: int
    differences: Mapping[str, float]
    allowed: Mapping[str, float]
    errors: Mapping[str, float]

    def repeated(self) -> RepeatedRun:
        """Return the same for ``slide-fmu check``."""
        rows = (
            (
                name,
                f"{difference:.3g}",
                f"{self.allowed[name]:.3g}",
                percent(self.errors[name]) if name in self.errors else "",
            )
            for name, difference in self.differences.items()
        )
        heading = "variable", "largest difference", "allowed", "error against the reference"
        title = f"experiment of {self.steps} steps, repeated here"
        table = ReportTable.of(heading, rows, title)
        return RepeatedRun(table, self.problems(), {"replay": asdict(self)})

    def problems(self) -> list[str]:
        """Name the variables that differ by more than rounding."""
        return [
            f"{name}: the replayed experiment differs by {difference:.3g} from the stored one; "
            f"expected at most {self.allowed[name]:.3g}: the library here is another one than "
            "that which made the results, or these were changed; export again"
            for name, difference in self.differences.items()
            if not difference <= self.allowed[name]
        ]


def replay(fmu: Path, surrogate: Surrogate) -> Replay | None:
    """Run the library of an FMU on the experiment that it carries; None if it has none.

    Args:
        fmu: the file of the FMU.
        surrogate: the surrogate of the FMU, for the ranges of its outputs.

    Raises:
        CoSimulationError: the FMU cannot be run, or has no such variables.
        CredentialError: the experiment cannot be read.
        FmuError: the file is not an FMU.
    """
    experiment = read_experiment(fmu)
    if experiment is None:
        return None
    names, step = list(experiment.results), experiment.step
    with unpacked(fmu) as files:
        values = run_fmu(files, experiment.inputs, names, experiment.parameters, step).values
    repeated = dict(zip(names, values.T, strict=True))
    differences = {
        name: float(np.max(np.abs(repeated[name] - experiment.results[name]))) for name in names
    }
    allowed = _allowed(experiment, surrogate)
    if surrogate.bound is not None:
        of_bound = bound_deviations(surrogate, repeated, experiment.results)
        differences |= {name: deviation for name, (deviation, _) in of_bound.items()}
        allowed |= {name: most for name, (_, most) in of_bound.items()}
    return Replay(experiment.steps, differences, allowed, experiment.relative_errors())


def _allowed(experiment: Experiment, surrogate: Surrogate) -> dict[str, float]:
    """Return the rounding of each variable: outputs have single precision."""
    ranges = {signal.name: signal.high - signal.low for signal in surrogate.outputs}
    return {
        name: OUTPUT_TOLERANCE * max(ranges[name], float(np.abs(values).max()))
        if name in ranges
        else SHARE_TOLERANCE
        for name, values in experiment.results.items()
    }
