"""Source FMUs, compiled here, beside the library of the FMU: outputs and time of a step.

    python tests/benchmarks/scalar_sources.py fmus/*/*.fmu --json -

Each FMU is written again with scalar sources and with those that have vector types, which are
compiled by ``cc -std=c99`` and ``--optimize``: for every processor of the kind, unless that names
one. All run the trajectory that the FMU carries, in turns, called from C with inputs set and
outputs read in each step. ``microseconds`` are the least time of a step in all rounds, ``ratio``
that over the library's, ``deviation`` the largest difference of an output from the library's, over
the output's range.
"""

from __future__ import annotations

import argparse
import ctypes
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from c_steps import CSteps, load_steps
from figures_out import measure_and_write
from source_case import SourceCase, open_case

from slide_fmu.core.progress import Stages
from slide_fmu.fmu.libraries.sources import Sources

TIMES = 5
"""How often an FMU runs before it is the next one's turn."""
KINDS: dict[str, Sources] = {"vector types": True, "scalar": "scalar"}


class Runner:
    """A Runner is an instance of an FMU in some library, whose steps C repeats."""

    def __init__(self, case: SourceCase, library: Path, steps: ctypes.CDLL) -> None:
        self._library = ctypes.CDLL(str(library))
        instantiate = self._library.fmi2Instantiate
        instantiate.restype = ctypes.c_void_p
        location = (case.folder / "resources").as_uri().encode()
        guid = case.description.guid.encode()
        self._instance = ctypes.c_void_p(instantiate(b"one", 1, guid, location, None, 0, 0))
        if not self._instance:
            raise RuntimeError(f"{library}: fmi2Instantiate gave NULL")
        references = (case.input_references.tolist(), case.output_references.tolist())
        self._steps = CSteps(steps, self._library, self._instance, *references)
        self._inputs, length = case.inputs, case.surrogate.window.step
        self._times = length * np.arange(len(self._inputs))
        self._lengths = np.full(len(self._inputs), length)
        self.outputs = np.empty_like(case.outputs)
        self._least_first = self._least = float("inf")

    def seconds(self, rounds: int) -> float:
        """Least time of a step but the first, which settles the past, in this and earlier calls.

        Raises:
            RuntimeError: a call failed.
        """
        count = len(self.outputs)
        for _ in range(rounds):
            self._least_first = min(self._least_first, self._spent(1))
            self._least = min(self._least, self._spent(count))
        return (self._least - self._least_first) / (count - 1)

    def _spent(self, count: int) -> float:
        zero = ctypes.c_double(0)
        self._library.fmi2Reset(self._instance)
        self._library.fmi2SetupExperiment(self._instance, 0, zero, zero, 0, zero)
        self._library.fmi2EnterInitializationMode(self._instance)
        self._library.fmi2ExitInitializationMode(self._instance)
        outputs, spent = self._steps.run(
            self._times[:count], self._lengths[:count], self._inputs[:count]
        )
        self.outputs[:count] = outputs
        return spent


def compiled(sources: list[Path], library: Path, optimize: str) -> Path:
    """Compile C sources with the compiler of this computer.

    Raises:
        subprocess.CalledProcessError: it refused them.
    """
    command = ["cc", "-std=c99", *optimize.split(), "-shared", "-fPIC", *map(str, sources), "-lm"]
    subprocess.run([*command, "-o", str(library)], check=True)
    return library


def measure_fmu(fmu: Path, rounds: int, optimize: str) -> dict[str, Any]:
    """Figures of one FMU, by what runs it."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        steps = load_steps(folder)
        runners = {}
        for kind, sources in KINDS.items():
            case = open_case(fmu, folder, sources)
            files = sorted(case.sources.glob("*.c"))
            own = compiled(files, folder / f"{kind}.so", optimize)
            runners[kind] = Runner(case, own, steps)
        (library,) = (case.folder / "binaries" / "linux64").iterdir()
        runners["library"] = Runner(case, library, steps)
        times: dict[str, float] = {}
        for _ in range(rounds):
            for kind, runner in runners.items():
                times[kind] = runner.seconds(TIMES)
        return {
            kind: {
                "microseconds": 1e6 * times[kind],
                "ratio": times[kind] / times["library"],
                "deviation": case.deviation(runner.outputs),
            }
            for kind, runner in runners.items()
        }


def measure(arguments: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Figures of all FMUs."""
    figures, show = {}, bar("FMUs")
    for number, fmu in enumerate(arguments.fmus):
        figures[fmu.stem] = measure_fmu(fmu, arguments.rounds, arguments.optimize)
        show(number + 1, len(arguments.fmus))
    return {"optimize": arguments.optimize, "rounds": arguments.rounds, "fmus": figures}


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("fmus", type=Path, nargs="+")
    parser.add_argument("--rounds", type=int, default=20)
    parser.add_argument("--optimize", default="-O2", help="flags, one or several")
    measure_and_write(parser, measure)


if __name__ == "__main__":
    main()
