"""A source FMU and the trajectory that it carries, for the benchmarks of sources."""

from __future__ import annotations

import zipfile
from dataclasses import dataclass
from pathlib import Path

import fmpy
import numpy as np
from numpy.typing import NDArray

from slide_fmu.apps.credentials.experiment import Experiment, read_experiment
from slide_fmu.core.signals import FloatArray
from slide_fmu.cosim.whole_run import run_fmu
from slide_fmu.fmu.export import read_fmu
from slide_fmu.fmu.libraries.sources import Sources
from slide_fmu.importer.file import unpacked
from slide_fmu.pipeline.export import export_again
from slide_fmu.surrogate.surrogate import Surrogate

COSTLY = ("_error_estimate", "_error_bound")
"""Ends of the names of variables that are found only when they are read."""


@dataclass(frozen=True)
class SourceCase:
    """A SourceCase is an FMU with sources, unpacked, and inputs for it.

    Attributes:
        folder: where the FMU is unpacked.
        surrogate: what it runs.
        description: its ``modelDescription.xml``, read.
        inputs: what is set before each step, shape (N, n_inputs).
        outputs: what the compiled library gives after each step, shape (N, n_outputs).
    """

    folder: Path
    surrogate: Surrogate
    description: fmpy.model_description.ModelDescription
    inputs: FloatArray
    outputs: FloatArray

    @property
    def sources(self) -> Path:
        """The folder of the sources."""
        return self.folder / "sources"

    @property
    def ranges(self) -> FloatArray:
        """Ranges of the outputs, shape (n_outputs,), in their units."""
        return np.array([signal.high - signal.low for signal in self.surrogate.outputs])

    def references(self, names: list[str]) -> NDArray[np.uint32]:
        """Value references of variables."""
        known = {v.name: v.valueReference for v in self.description.modelVariables}
        return np.array([known[name] for name in names], dtype=np.uint32)

    @property
    def input_references(self) -> NDArray[np.uint32]:
        """Value references of the inputs."""
        return self.references([signal.name for signal in self.surrogate.inputs])

    @property
    def output_references(self) -> NDArray[np.uint32]:
        """Value references of the outputs."""
        return self.references([signal.name for signal in self.surrogate.outputs])

    @property
    def costly_references(self) -> NDArray[np.uint32]:
        """Value references of error estimates and bounds, which are found when they are read."""
        names = [v.name for v in self.description.modelVariables]
        return self.references([name for name in names if name.endswith(COSTLY)])

    def deviation(self, outputs: FloatArray) -> float:
        """Largest difference to what the library gives, over the range of the output."""
        return float(np.max(np.abs(outputs - self.outputs) / self.ranges))


def open_case(fmu: Path, folder: Path, sources: Sources) -> SourceCase:
    """Write an FMU again with sources, unpack it, and run its library on what it carries.

    Raises:
        ValueError: it carries no trajectory.
    """
    surrogate, _ = read_fmu(fmu)
    experiment = read_experiment(fmu)
    if experiment is None:
        raise ValueError(f"{fmu} carries no trajectory; expected an FMU that `run` has finished")
    path = export_again(fmu, folder / f"{surrogate.name}.fmu", 2, sources)
    unpacked_to = folder / f"{surrogate.name}_{sources}"
    with zipfile.ZipFile(path) as archive:
        archive.extractall(unpacked_to)
    inputs, outputs = _answers(path, surrogate, experiment)
    return SourceCase(unpacked_to, surrogate, fmpy.read_model_description(path), inputs, outputs)


def _answers(
    path: Path, surrogate: Surrogate, experiment: Experiment
) -> tuple[FloatArray, FloatArray]:
    """Inputs and outputs of the compiled library, parameters being at their start values."""
    names = [signal.name for signal in surrogate.outputs]
    inputs = {signal.name: experiment.inputs[signal.name] for signal in surrogate.inputs}
    with unpacked(path) as files:
        values = run_fmu(files, inputs, names, step=surrogate.window.step).values
    return np.stack(list(inputs.values()), axis=1), values[1:]
