"""What ``NativeSurrogate.predict`` costs by the number of sequences that it is given at once.

    python tests/benchmarks/batch_sizes.py fmus/*/*.fmu --json -
    python tests/benchmarks/batch_sizes.py FMU --against OLD/slide_python.so --json -

``us_per_sample`` is the processor time of one thread over samples times sequences, median over the
rounds, in which all sizes take turns. ``over_fewer`` is that over the least time of this size or
fewer: 1 where no batch is slower, per sample, than a smaller one. With ``--against``, the library
for Python of another version runs in the same rounds, every other time first: ``over_against`` are
medians over pairs, and ``equal_bits`` says whether both give the same.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
from compare_fmus import unseen_inputs
from figures_out import measure_and_write
from seeds import WHOLE_RECORDS
from whole_records import cut

from slide_fmu.core.progress import Stages
from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu import native_library
from slide_fmu.fmu.export import read_fmu
from slide_fmu.fmu.native import NativeSurrogate
from slide_fmu.surrogate.surrogate import Surrogate

SIZES = (*range(1, 10), 12, 16, 17, 20, 24, 25, 31, 32, 33, 34, 40, 48, 64)
LENGTH = 600
"""Samples of a sequence."""


def opened(surrogate: Surrogate, library: Path | None) -> NativeSurrogate:
    """A surrogate in a library, or in that of this version."""
    if library is None:
        return NativeSurrogate(surrogate)
    with mock.patch.object(native_library, "library_path", return_value=library):
        return NativeSurrogate(surrogate)


def seconds_of(native: NativeSurrogate, sequences: FloatArray) -> float:
    """Processor time in s of one thread per sample."""
    begin = time.thread_time()
    native.predict(sequences, threads=1)
    return (time.thread_time() - begin) / (len(sequences) * sequences.shape[1])


def measure_fmu(path: Path, rounds: int, against: Path | None) -> dict[str, Any]:
    """Figures of one FMU."""
    surrogate, _ = read_fmu(path)
    record = unseen_inputs(path, 2 * LENGTH, WHOLE_RECORDS)
    batches = {size: cut(record, size, LENGTH) for size in SIZES}
    own, other = opened(surrogate, None), against and opened(surrogate, against)
    natives = {"own": own, **({"against": other} if other else {})}
    times: dict[str, dict[int, list[float]]] = {name: {} for name in natives}
    for number in range(rounds):
        order = list(natives.items())[:: 1 if number % 2 else -1]
        for size, batch in batches.items():
            for name, native in order:
                times[name].setdefault(size, []).append(seconds_of(native, batch))
    per_sample = {size: float(np.median(found)) for size, found in times["own"].items()}
    least = np.minimum.accumulate(list(per_sample.values()))
    ratios = {
        size: one / fewest
        for (size, one), fewest in zip(per_sample.items(), least.tolist(), strict=True)
    }
    figures: dict[str, Any] = {
        "us_per_sample": {size: 1e6 * seconds for size, seconds in per_sample.items()},
        "over_fewer": ratios,
        "largest_over_fewer": max(ratios.values()),
    }
    if other:
        figures["over_against"] = {
            size: float(np.median(np.array(times["own"][size]) / times["against"][size]))
            for size in SIZES
        }
        figures["equal_bits"] = all(
            own.predict(batch).tobytes() == other.predict(batch).tobytes()
            for batch in batches.values()
        )
    return figures


def measure(arguments: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Figures of all FMUs."""
    figures, show = {}, bar("FMUs")
    for number, fmu in enumerate(arguments.fmus):
        figures[fmu.stem] = measure_fmu(fmu, arguments.rounds, arguments.against)
        show(number + 1, len(arguments.fmus))
    return {"rounds": arguments.rounds, "samples": LENGTH, "fmus": figures}


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("fmus", type=Path, nargs="+")
    parser.add_argument("--against", type=Path, help="a library slide_python of another version")
    parser.add_argument("--rounds", type=int, default=20)
    measure_and_write(parser, measure)


if __name__ == "__main__":
    main()
