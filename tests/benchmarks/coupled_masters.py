"""The quarter car in two halves in other masters, compared with ``slide-fmu couple``.

libcosim, Ecos and FMPy take explicit steps of all components at once, with held values. Printed
are the largest differences of the body's position and of the force, as parts of their ranges: from
``couple`` with the method ``jacobi`` and ``zero``, and from Newton's method. A package that is not
installed has null.

    PYTHONPATH=. python tests/benchmarks/coupled_masters.py [--surrogate FMU] --json -
"""

from __future__ import annotations

import argparse
import tempfile
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from slide_fmu.core.progress import Stages
from tests.benchmarks.figures_out import measure_and_write
from tests.own_models.halves.cut_car import write_halves
from tests.own_models.halves.other_masters import MASTERS, OUTPUTS, ours, write_car_ssp

STEPS = (0.02, 0.01, 0.005)
"""Communication steps in s."""


def differences(ssp: Path, step: float, stop: float, moving: list[str]) -> dict[str, Any]:
    """Return how far the masters are from ours, for position and force."""
    run = ssp, OUTPUTS, step, round(stop / step)
    explicit = ours(*run, moving=moving, method="jacobi", extrapolation="zero")
    implicit, size = ours(*run, moving=moving), np.ptp(explicit, axis=0)
    figures: dict[str, Any] = {}
    for name, master in MASTERS.items():
        figures[name] = None
        if find_spec(name) is not None:
            found = master(*run)
            figures[name] = {
                "from jacobi, zero": (np.max(np.abs(found - explicit), axis=0) / size).tolist(),
                "from newton": (np.max(np.abs(found - implicit), axis=0) / size).tolist(),
            }
    return figures


def measure(arguments: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Measure at all steps."""
    figures, progress = {}, bar("masters")
    with tempfile.TemporaryDirectory() as folder:
        halves = write_halves(Path(folder))
        if arguments.surrogate is not None:
            halves["lower"] = arguments.surrogate
        moving = [] if arguments.surrogate is not None else ["lower"]
        for number, step in enumerate(STEPS):
            progress(number, len(STEPS))
            ssp = write_car_ssp(Path(folder) / "car.ssp", halves, step, arguments.stop)
            figures[f"{1e3 * step:g} ms"] = differences(ssp, step, arguments.stop, moving)
        progress(len(STEPS), len(STEPS))
    return figures


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--stop", type=float, default=10.0, help="duration of a ride in s")
    parser.add_argument("--surrogate", type=Path, help="FMU in the place of the lower half")
    measure_and_write(parser, measure)
