"""The quarter car cut in two as an SSP, and other masters that run it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from slide_fmu.apps.couple.ssp import read_ssp
from slide_fmu.apps.reference.input_source import write_input_source
from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.cosim.ssp import Connection, write_system
from tests.acceptance.importers import Outputs, run_ecos, run_fmpy, run_libcosim
from tests.couple_here import couple_here
from tests.own_models.halves.cut_car import LINKS, road

MASTERS: Mapping[str, Callable[[Path, Outputs, float, int], FloatArray]] = {
    "libcosimpy": run_libcosim,
    "ecospy": run_ecos,
    "fmpy": run_fmpy,
}
"""Masters by the packages that they come in; all of them step all components at once (Jacobi)."""

ROAD = Signal("road", "m", -0.05, 0.05, hold="first_order")


OUTPUTS = [("upper", "position"), ("lower", "force")]


def write_car_ssp(path: Path, halves: Mapping[str, Path], step: float, stop: float) -> Path:
    """Write the car as SSP, with its road as a component that gives a sample for each step."""
    times = step * np.arange(round(stop / step) + 1)
    heights = np.interp(times, *road(stop))[:, None]
    source = write_input_source([ROAD], step, heights, path.with_name("inputs.fmu"))
    connections = [
        Connection((start, first), (end, second))
        for (start, first), (end, second) in (
            (a.split("."), b.split(".")) for a, b in [("inputs.road", "lower.road"), *LINKS]
        )
    ]
    return write_system(path, "car", {"inputs": source, **halves}, connections)


def ours(ssp: Path, outputs: Outputs, step: float, steps: int, **options: Any) -> FloatArray:
    """Run an SSP with ``couple``, and return what other masters do, shape (steps, n_outputs)."""
    with TemporaryDirectory() as folder:
        found = read_ssp(ssp, Path(folder))
        run = couple_here(
            found.fmus,
            found.connections,
            step=step,
            stop=steps * step,
            parameters=found.parameters,
            **options,
        )
    return np.stack([run[".".join(output)][1:] for output in outputs], axis=1)
