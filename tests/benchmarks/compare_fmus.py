"""Compares two FMUs of the same surrogate: largest difference of their outputs, and their speed.

    python tests/benchmarks/compare_fmus.py OLD.fmu NEW.fmu --json -

Both FMUs take the same inputs, drawn by the excitation of the recipe that the new FMU names, with
a seed that no training saw. The difference of an output is given over the width of its range. The
time is that of set, doStep and get through fmpy; the FMUs take turns, so that other work on the
machine slows both alike. The time of batch prediction is that of as many windows as there are
steps, by the functions that the FMU's own library has for it; it is left out for feed-forward
networks, whose features are formed in Python. Only what both FMUs have is compared; their
reference model is not run.
"""

from __future__ import annotations

import argparse
import ctypes
import statistics
import time
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
from figures_out import write_figures
from seeds import COMPARE_FMUS

from slide_fmu.core.signals import FloatArray
from slide_fmu.cosim.run import Run, UnpackedFmu, run_fmu, unpacked
from slide_fmu.data.draws import TEST, Stream, draw
from slide_fmu.fmu.export import read_fmu
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.pipeline.run_folder import recipe_of_provenance
from slide_fmu.recipe.systems import reference_system
from slide_fmu.surrogate.surrogate import Surrogate


def unseen_inputs(fmu: Path, steps: int, seed: int) -> FloatArray:
    """Inputs of the recipe's excitation, shape (steps, n_inputs), in the inputs' units."""
    _, provenance = read_fmu(fmu)
    recipe = recipe_of_provenance(provenance, str(fmu))
    duration = steps * recipe.window.step
    recipe = recipe.model_copy(
        update={"data": recipe.data.model_copy(update={"duration": duration, "burn_in": 0.0})}
    )
    drawn = draw(recipe, reference_system(recipe), Stream(TEST, seed, (1.0, 1.0), duration), 0)
    return drawn.inputs[:steps]


class Batch:
    """A batch holds windows of physical inputs, and a library of an FMU that predicts them."""

    def __init__(self, fmu: UnpackedFmu, inputs: FloatArray, surrogate: Surrogate) -> None:
        n_in = surrogate.window.n_in
        platforms = (fmpy.platform, fmpy.platform_tuple)
        binaries = fmu.folder / "binaries"
        paths = [
            path for name in platforms for path in (binaries / name).glob("*") if path.is_file()
        ]
        payload, message = (fmu.folder / "resources/surrogate.slide").read_bytes(), bytes(400)
        self._library = ctypes.CDLL(str(paths[0]))
        if not hasattr(self._library, "slide_native_records"):
            raise RuntimeError(
                f"{paths[0].name} is of a version whose windows of cells were others; compare two "
                "FMUs that have slide_native_records"
            )
        size = ctypes.c_size_t
        self._library.slide_native_open.restype = ctypes.c_void_p
        self._handle = ctypes.c_void_p(
            self._library.slide_native_open(
                payload, size(len(payload)), size(0), message, size(len(message))
            )
        )
        if not self._handle:
            raise RuntimeError(message.split(b"\0")[0].decode())
        self._record, self._count = np.ascontiguousarray(inputs), len(inputs) - n_in + 1
        shape = (self._count, surrogate.window.n_out, len(surrogate.outputs))
        self.values = np.empty(shape)
        self._sizes = [ctypes.c_size_t(k) for k in (self._count, n_in, 1, 0, shape[1])]

    def seconds(self) -> float:
        """Predict all windows, and return the processor's time for one."""
        begin = time.thread_time()
        failed = self._library.slide_native_records(
            self._handle, self._record.ctypes, *self._sizes, self.values.ctypes
        )
        if failed:
            raise RuntimeError("a feature of the windows is not finite")
        return (time.thread_time() - begin) / self._count


def batch_times(
    old: UnpackedFmu, new: UnpackedFmu, inputs: FloatArray, surrogate: Surrogate, rounds: int
) -> dict[str, float]:
    """Median times (microseconds) of a window, the two libraries in turns."""
    batches = {"old": Batch(old, inputs, surrogate), "new": Batch(new, inputs, surrogate)}
    found: dict[str, list[float]] = {name: [] for name in batches}
    for _ in range(rounds):
        for name, batch in batches.items():
            found[name].append(batch.seconds())
    return {name: 1e6 * statistics.median(times) for name, times in found.items()}


def compare(old: Path, new: Path, steps: int, rounds: int, seed: int) -> dict[str, Any]:
    """Drive both FMUs in turns and compare them."""
    surrogate, _ = read_fmu(new)
    rows = unseen_inputs(new, steps, seed)
    inputs = {signal.name: rows[:, k] for k, signal in enumerate(surrogate.inputs)}
    names = [signal.name for signal in surrogate.outputs]
    widths = np.array([signal.high - signal.low for signal in surrogate.outputs])
    runs: dict[str, list[Run]] = {"old": [], "new": []}
    with unpacked(old) as before, unpacked(new) as after:
        fmus: dict[str, UnpackedFmu] = {"old": before, "new": after}
        for _ in range(rounds):
            for name, fmu in fmus.items():
                runs[name].append(run_fmu(fmu, inputs, names, step=surrogate.window.step))
        batches: dict[str, float] = {}
        if isinstance(surrogate.network, StateSpace):
            batches = batch_times(before, after, rows, surrogate, rounds)
    difference = np.abs(runs["old"][0].values - runs["new"][0].values).max(axis=0) / widths
    times = {
        name: 1e6 * statistics.median(float(np.median(run.seconds)) for run in found)
        for name, found in runs.items()
    }
    return {
        "old": str(old),
        "new": str(new),
        "steps": steps,
        "largest_difference_over_range": dict(zip(names, difference.tolist(), strict=True)),
        "set_step_get_microseconds": times,
        "new_over_old": times["new"] / times["old"],
        "batch_microseconds": batches,
        "batch_new_over_old": batches["new"] / batches["old"] if batches else None,
        "bytes": {"old": old.stat().st_size, "new": new.stat().st_size},
    }


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("old", type=Path)
    parser.add_argument("new", type=Path)
    parser.add_argument("--steps", type=int, default=1000)
    parser.add_argument("--rounds", type=int, default=11)
    parser.add_argument("--seed", type=int, default=COMPARE_FMUS)
    parser.add_argument("--json", default="-")
    arguments = parser.parse_args()
    figures = compare(
        arguments.old, arguments.new, arguments.steps, arguments.rounds, arguments.seed
    )
    write_figures(figures, arguments.json)


if __name__ == "__main__":
    main()
