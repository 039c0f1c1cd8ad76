"""Very many whole records on a device of torch, beside the C runtime on all cores: in one run.

    python tests/benchmarks/device_records.py fmus/*/*.fmu --device cuda --json -

Inputs are drawn as for ``whole_records.py``. ``simulated_seconds_per_second`` is of the time that
passes, the median over the rounds: ``device`` from records in memory to outputs in memory, with
features that numpy forms on one core, ``network`` of the network alone on the device, and
``runtime`` of ``NativeSurrogate.predict`` on all cores. Records begin with n_in held samples,
which are computed and not counted. ``difference`` is the largest one from the runtime, over the
scale of its output.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import torch
from compare_fmus import unseen_inputs
from figures_out import measure_and_write
from seeds import WHOLE_RECORDS
from whole_records import cut

from slide_fmu.apps.autodiff.device_surrogate import DeviceSurrogate
from slide_fmu.core.progress import Stages
from slide_fmu.fmu.export import load
from slide_fmu.fmu.native import NativeSurrogate

LENGTH = 600


def passed(task: Callable[[], object], rounds: int) -> float:
    """Median time in s that a task takes; it runs once before, unmeasured."""
    found = []
    for _ in range(rounds + 1):
        begin = time.perf_counter()
        task()
        found.append(time.perf_counter() - begin)
    return float(np.median(found[1:]))


def measure_fmu(path: Path, device: str, count: int, rounds: int) -> dict[str, Any]:
    """Measure one FMU on a device."""
    surrogate = load(path)
    records = cut(unseen_inputs(path, 10 * LENGTH, WHOLE_RECORDS), count, LENGTH)
    on_device, native = DeviceSurrogate(surrogate, device), NativeSurrogate(surrogate)
    block = next(iter(on_device.blocks(records)))

    def network() -> None:
        on_device.evaluate(block)
        if on_device.device.type == "cuda":
            torch.cuda.synchronize(on_device.device)

    simulated = LENGTH * surrogate.window.step
    error = on_device.predict(records) - native.predict(records)
    return {
        "records": count,
        "records_in_a_block": block.shape[1],
        "simulated_seconds_per_second": {
            "device": count * simulated / passed(lambda: on_device.predict(records), rounds),
            "network": block.shape[1] * simulated / passed(network, rounds),
            "runtime": count * simulated / passed(lambda: native.predict(records), rounds),
        },
        "difference": float(np.abs(error / surrogate.output_scaling.scale).max()),
    }


def measure(arguments: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Measure all FMUs; those with another network than a state-space one are refused."""
    device, done, figures = arguments.device, bar("FMUs"), {}
    done(0, len(arguments.fmus))
    for index, path in enumerate(arguments.fmus):
        figures[path.stem] = measure_fmu(path, device, arguments.records, arguments.rounds)
        done(index + 1, len(arguments.fmus))
    cuda = device.startswith("cuda")
    name = torch.cuda.get_device_name(torch.device(device)) if cuda else device
    return {"device": name, "fmus": figures}


def main() -> None:
    """Read the command line, measure, and write the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("fmus", nargs="+", type=Path)
    parser.add_argument("--device", default="cuda", help="as torch names it")
    parser.add_argument("--records", type=int, default=16384, help="of 600 samples each")
    parser.add_argument("--rounds", type=int, default=3)
    measure_and_write(parser, measure)


if __name__ == "__main__":
    main()
