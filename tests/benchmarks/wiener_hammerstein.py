"""The measured Wiener-Hammerstein record of 2009: a state-space network against published errors.

    python tests/benchmarks/wiener_hammerstein.py --data FOLDER --json -

The record is not part of this project (nonlinearbenchmark.org). FOLDER holds it as HDF5 files
whose names contain train, valid and test, with keys u and y in V, which make the whole record in
this order. Protocol: samples 5200 to 105199 to learn from (the last tenth to choose by), free
simulation from the inputs 105200 to 183999, the first 50 samples of which are not scored.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import torch
from figures_out import measure_and_write

from slide_fmu.core.measures import rms
from slide_fmu.core.progress import Progress, Stages
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import Window
from slide_fmu.features.differences import Differences
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.fitting.problem import Problem
from slide_fmu.fitting.state_space.fit import fit_state_space
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.recipe.learning import LeastSquaresRecipe, StateSpaceRecipe

SAMPLE_RATE = 51_200.0
LEARN, CHOOSE, TEST = slice(5_200, 95_200), slice(95_200, 105_200), slice(105_200, 184_000)
NOT_SCORED = 50
WINDOW = Window(1 / SAMPLE_RATE, 72 + 256, 256)
"""72 samples truncated: the circuit's linear part decays to 1 % within 38 to 67."""
FEATURES = FeatureMap(Differences(1))
"""The input as it is."""


@dataclass(frozen=True)
class Record:
    """Inputs and outputs in V, shape (N,) each, and what they are divided by."""

    inputs: FloatArray
    outputs: FloatArray
    scale: tuple[float, float]

    def part(self, which: slice) -> tuple[FloatArray, FloatArray]:
        """Scaled inputs (1, N, 1) and outputs (1, N + 1, 1); output k + 1 is that of input k."""
        inputs = self.inputs[which] / self.scale[0]
        outputs = self.outputs[which] / self.scale[1]
        first = outputs[:1]  # of no input; never scored
        return inputs[None, :, None], np.concatenate([first, outputs])[None, :, None]

    def learnt(self, which: slice) -> tuple[torch.Tensor, torch.Tensor]:
        """Features (1, N, 1) and scaled outputs (1, N + 1, 1)."""
        inputs, outputs = self.part(which)
        features = torch.as_tensor(FEATURES.along(inputs), dtype=torch.float64)
        return features, torch.as_tensor(outputs)


@dataclass(frozen=True, eq=False)
class Fitted:
    """One seed: the network, its validation error in mV, and what it took."""

    network: StateSpace
    validation_rmse: float
    cpu_seconds: float


def read(folder: Path) -> Record:
    """Read the record.

    Raises:
        SystemExit: a file is missing.
    """
    parts = []
    for name in ("train", "valid", "test"):
        found = sorted(folder.glob(f"*{name}*.h*5"))
        if len(found) != 1:
            raise SystemExit(
                f"{folder}: {len(found)} HDF5 files with {name!r} in their names; "
                "expected one: give the folder of the record with --data"
            )
        with h5py.File(found[0]) as file:
            parts.append([np.asarray(file[key], dtype=np.float64).ravel() for key in "uy"])
    inputs, outputs = (np.concatenate(values) for values in zip(*parts, strict=True))
    scale = float(inputs[LEARN].std()), float(outputs[LEARN].std())
    return Record(inputs, outputs, scale)


def fit(record: Record, recipe: StateSpaceRecipe, seed: int, advance: Progress) -> Fitted:
    """Fit one seed."""
    begin = time.process_time()
    to_millivolts = 1e3 * record.scale[1]

    def progress(done: int, total: int, error: float | None = None) -> None:
        advance(done, total, None if error is None else to_millivolts * error)

    with tempfile.TemporaryDirectory() as folder:
        checkpoint = Path(folder) / "fit.pt"
        parts = record.learnt(LEARN), record.learnt(CHOOSE)
        problem = Problem(WINDOW, FEATURES, *parts, checkpoint)
        training = LeastSquaresRecipe(seed=seed)
        found = fit_state_space(problem, recipe, training, progress)
        network, history = found.network, found.history
    seconds = time.process_time() - begin
    return Fitted(network, to_millivolts * min(history.validation_error), seconds)


def errors_on_test(network: StateSpace, record: Record) -> tuple[float, float]:
    """Errors in mV on the test record: simulated from zero state, and as the FMU does."""
    inputs, targets = record.part(TEST)
    simulated, _ = network.run(network.features.along(inputs))
    result = []
    for values in (simulated, network.stream(inputs)):
        error = (values[0] - targets[0, 1:])[NOT_SCORED:] * record.scale[1]
        result.append(1e3 * float(rms(error)[0]))
    return result[0], result[1]


def study(arguments: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Fit and test every seed."""
    torch.set_num_threads(1)
    record = read(arguments.data)
    sizes = {} if arguments.automatic else {"order": arguments.order, "hidden": arguments.hidden}
    recipe = StateSpaceRecipe(**sizes)
    seeds = range(arguments.seed, arguments.seed + arguments.seeds)
    fits = [fit(record, recipe, seed, bar(f"seed {seed}")) for seed in seeds]
    tests = [errors_on_test(fitted.network, record) for fitted in fits]
    return {
        "test_rmse_mV": [simulated for simulated, _ in tests],
        "test_rmse_as_fmu_mV": [streamed for _, streamed in tests],
        "validation_rmse_mV": [fitted.validation_rmse for fitted in fits],
        "cpu_seconds": [fitted.cpu_seconds for fitted in fits],
        "parameters": [fitted.network.count_parameters() for fitted in fits],
        "states": [len(fitted.network.cell.a) for fitted in fits],
        "units": [len(fitted.network.cell.w) for fitted in fits],
    }


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, required=True, help="folder of the record")
    parser.add_argument("--seeds", type=int, choices=range(1, 100), default=3, metavar="N")
    parser.add_argument("--seed", type=int, default=0, help="the first of them")
    parser.add_argument("--order", type=int, default=6)
    parser.add_argument("--hidden", type=int, default=16)
    parser.add_argument(
        "--automatic", action="store_true", help="sizes and kind of units are found by search"
    )
    measure_and_write(parser, study)


if __name__ == "__main__":
    main()
