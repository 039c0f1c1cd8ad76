"""How finite differences of an FMU's outputs compare with the derivatives that it tells.

    python tests/benchmarks/derivative_check.py fmus/slider_crank_payload/*.fmu --json -

Derivatives are those by the first physical parameter. Outputs are in single precision, and what
the network forgets between its two states is felt in differences, not in the derivatives: so the
figures depend on the distance. Deviations are relative to the largest difference. Besides: how
much outputs change, relative to their scales, that begin with constant inputs and a known past.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from figures_out import measure_and_write
from fmpy import read_model_description
from fmpy.fmi2 import FMU2Slave
from seeds import DERIVATIVE_CHECK

from slide_fmu.core.progress import Stages
from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.export import read_fmu
from slide_fmu.importer.file import unpacked
from slide_fmu.surrogate.surrogate import Surrogate

DISTANCES = (0.1, 0.03, 0.01, 0.003, 0.001)
"""Of the differences, in parts of the parameter's range."""
WINDOWS = 1.25
"""Length of a run in windows; constant inputs: twice as long."""


class Runs:
    """Runs of one FMU by fmpy."""

    def __init__(self, fmu: Path, folder: Path) -> None:
        self.surrogate, _ = read_fmu(fmu)
        self.description = read_model_description(str(fmu))
        self.folder = folder
        self.places = {v.name: v.valueReference for v in self.description.modelVariables}
        self.outputs = [self.places[one.name] for one in self.surrogate.outputs]
        self.inputs = [self.places[one.name] for one in self.surrogate.inputs]

    @contextmanager
    def started(self, first: FloatArray, **parameters: float) -> Iterator[FMU2Slave]:
        """An instance before whose start the first inputs were held."""
        model = self.description.coSimulation.modelIdentifier
        fmu = FMU2Slave(
            guid=self.description.guid,
            unzipDirectory=str(self.folder),
            modelIdentifier=model,
            instanceName="one",
        )
        before = dict(
            zip((f"initial_{s.name}" for s in self.surrogate.inputs), first, strict=True)
        )
        values = {"prehistory_known": 1.0, **before, **parameters}
        fmu.instantiate()
        fmu.setupExperiment()
        fmu.enterInitializationMode()
        fmu.setReal([self.places[name] for name in values], list(values.values()))
        fmu.setReal(self.inputs, first.tolist())
        fmu.exitInitializationMode()
        yield fmu
        fmu.terminate()
        fmu.freeInstance()

    def run(
        self, inputs: FloatArray, by: str | None = None, **parameters: float
    ) -> tuple[FloatArray, FloatArray]:
        """Return outputs (1 + n, n_outputs), and derivatives by a parameter, (n, n_outputs)."""
        step = self.surrogate.window.step
        slopes: list[list[float]] = []
        with self.started(inputs[0], **parameters) as fmu:
            found = [fmu.getReal(self.outputs)]
            for k, row in enumerate(inputs):
                fmu.setReal(self.inputs, row.tolist())
                fmu.doStep(k * step, step)
                found.append(fmu.getReal(self.outputs))
                if by is not None:
                    known = [self.places[by]]
                    slopes.append(fmu.getDirectionalDerivative(self.outputs, known, [1.0]))
        return np.array(found), np.array(slopes)


def smooth_inputs(surrogate: Surrogate, count: int) -> FloatArray:
    """Draw smooth inputs within their ranges, (count, n_inputs); directors turn on the circle."""
    rng = np.random.default_rng(DERIVATIVE_CHECK)
    walk = np.cumsum(rng.normal(0, 0.15, (count + 20, len(surrogate.inputs))), axis=0)
    smooth = np.stack([walk[k : k + 20].mean(axis=0) for k in range(count)])
    middle = np.array([(one.low + one.high) / 2 for one in surrogate.inputs])
    half = np.array([(one.high - one.low) / 2 for one in surrogate.inputs])
    values = middle + half * np.sin(smooth)
    for place, signal in enumerate(surrogate.inputs):
        if signal.angle == "cosine":
            values[:, place] = np.cos(smooth[:, place])
            values[:, place + 1] = np.sin(smooth[:, place])
    return values


def of_parameter(runs: Runs, inputs: FloatArray, bar: Stages) -> list[dict[str, float]]:
    """Compare the derivatives by the first parameter with differences, at its start value."""
    parameter = runs.surrogate.parameters[0]
    progress, found = bar("differences"), []
    _, slopes = runs.run(inputs, parameter.name, **{parameter.name: parameter.start})
    for number, distance in enumerate(DISTANCES):
        progress(number, len(DISTANCES))
        far = distance * (parameter.high - parameter.low)
        there, back = (
            runs.run(inputs, **{parameter.name: parameter.start + side * far})[0][1:]
            for side in (1, -1)
        )
        differences = (there - back) / (2 * far)
        deviation = np.abs(slopes - differences).max() / np.abs(differences).max()
        found.append({"distance": distance, "deviation": float(deviation)})
    progress(len(DISTANCES), len(DISTANCES))
    return found


def measure(arguments: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Measure all FMUs."""
    figures: dict[str, Any] = {}
    for path in arguments.fmus:
        with unpacked(path) as files:
            runs = Runs(path, Path(files.folder))
            surrogate = runs.surrogate
            count = round(WINDOWS * surrogate.window.n_in)
            inputs = smooth_inputs(surrogate, count)
            held, _ = runs.run(np.repeat(inputs[count // 2][None], 2 * count, axis=0))
            change = np.abs(held - held[0]).max(axis=0) / surrogate.output_scaling.scale
            figures[path.stem] = {"constant_inputs_change": float(change.max())}
            if surrogate.parameters:
                figures[path.stem]["differences"] = of_parameter(runs, inputs, bar)
    return figures


def main() -> None:
    """Measure the FMUs that the command line names."""
    parser = argparse.ArgumentParser(description=str(__doc__).split("\n", maxsplit=1)[0])
    parser.add_argument("fmus", nargs="+", type=Path)
    measure_and_write(parser, measure)


if __name__ == "__main__":
    main()
