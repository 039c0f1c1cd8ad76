"""A simulation joined with a record: the simulation's damping is 20 % less than that measured.

    python tests/benchmarks/joined.py --seeds 3 --json -

The released Duffing FMU was learnt from a simulation. A record of the same oscillator with 20 %
more damping and 50 dB of noise is short. Three surrogates are measured on a further stretch of the
damped oscillator, without noise: that of the simulation alone, one that was learnt from the record
alone by defaults, and one whose training begins with the first and goes on with the record
(``training.start``).
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from figures_out import measure_and_write

from mbs_models.oscillators import DuffingOscillator
from slide_fmu import Surrogate, learn, load
from slide_fmu.core.measures import rms
from slide_fmu.core.progress import Stages
from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.simulation import simulate

FMU = Path(__file__).parents[2] / "fmus" / "duffing" / "duffing.fmu"
STEP, FORCE, MORE_DAMPING, NOISE = 0.03, 1000.0, 1.2, 10 ** (-50 / 20)


def moved(samples: int, seed: int) -> tuple[FloatArray, FloatArray]:
    """Return forces in N, and positions in m of the more damped oscillator, one more of them."""
    system = DuffingOscillator(damping=8.0 * MORE_DAMPING, step=STEP)
    force = np.random.default_rng(seed).uniform(-FORCE, FORCE, (samples, 1))
    return force[:, 0], simulate(system, force).outputs[:, 0]


def write_record(path: Path, samples: int, seed: int) -> None:
    """Write the force that acts from each sample on, and the position measured at it."""
    force, position = moved(samples, seed)
    noise = NOISE * position.std() * np.random.default_rng(seed + 1).normal(size=samples)
    table = np.stack([STEP * np.arange(samples), force, position[:-1] + noise], axis=1)
    np.savetxt(path, table, "%.9g", ",", header="time,force,position", comments="")


def error_of(surrogate: Surrogate, force: FloatArray, position: FloatArray) -> float:
    """Return the relative RMSE on a further stretch, without its beginning."""
    outputs = surrogate.predict_newest(force[:, None])[:, 0]
    scored = slice(200, None)
    error = (outputs - position[1:])[scored, None]
    return float(rms(error)[0] / rms(position[1:][scored, None])[0])


def measure(arguments: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Measure all seeds."""
    rows = []
    progress = bar("seeds")
    for seed in range(arguments.seeds):
        progress(seed, arguments.seeds)
        with tempfile.TemporaryDirectory() as folder:
            rows.append(of_seed(Path(folder), seed, arguments.samples))
    names = ("simulation", "record", "joined")
    found = {name: [row[name] for row in rows] for name in names}
    return {
        "samples": arguments.samples,
        "relative_rmse": {
            name: {"median": float(np.median(v)), "range": [min(v), max(v)]}
            for name, v in found.items()
        },
        "worst_ratio": max(r["joined"] / min(r["simulation"], r["record"]) for r in rows),
        "cpu_s": [row["cpu_s"] for row in rows],
    }


def of_seed(folder: Path, seed: int, samples: int) -> dict[str, Any]:
    """Learn from the record alone, and beginning with the simulation's network."""
    record = folder / "record.csv"
    write_record(record, samples, 100 * seed + 1)
    force, position = moved(4000, 100 * seed + 3)
    found: dict[str, Any] = {"simulation": error_of(load(FMU), force, position), "cpu_s": {}}
    for name, start in (("record", {}), ("joined", {"start": str(FMU)})):
        begin = time.process_time()
        learnt = learn(
            {
                "kind": "record",
                "model": str(record),
                "inputs": {"force": {"range": [-FORCE, FORCE], "unit": "N", "hold": "zero_order"}},
                "outputs": {"position": {"range": [-2.5, 2.5], "unit": "m"}},
            },
            f"{name}_{seed}",
            runs=folder / "runs",
            workers=0,
            window={"step": STEP, "remaining_amplitude": 0.001},
            training={"seed": seed, **start},
        )
        found[name] = error_of(learnt.surrogate, force, position)
        found["cpu_s"][name] = time.process_time() - begin
    return found


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--samples", type=int, default=3000, help="length of the record")
    measure_and_write(parser, measure)


if __name__ == "__main__":
    main()
