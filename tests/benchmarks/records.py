"""From a measured record to its FMU by the commands that a user types.

    python tests/benchmarks/records.py --record quarter_car --json -
    python tests/benchmarks/records.py --record wiener_hammerstein --data FOLDER --json -

``slide-fmu init`` writes the recipe, nothing in it is edited, and ``slide-fmu run`` goes the whole
way by defaults. The records:

- ``quarter_car``: road and suspension travel of a nonlinear quarter car, 100 000 samples with
  50 dB of noise, of which the first 88 % are given. The truth without noise is known, so the error
  beside it is too, on the rest.
- ``wiener_hammerstein``: the measured record of 2009 (``wiener_hammerstein.py`` says where it is
  from), samples 5200 to 105199; measured on 105200 to 183999, of which the first 50 count not.
- ``integrator``: a position under force. ``bouc_wen``: a spring with hysteresis. ``tiny``: 1000
  samples of the quarter car. ``one_period``: one period that comes again and again.

A command that refuses is no failure here: its message is a figure.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import fmpy
import h5py
import numpy as np
import quarter_car
import scipy.signal
from figures_out import measure_and_write

from slide_fmu import load
from slide_fmu.core.measures import rms
from slide_fmu.core.progress import Stages
from slide_fmu.core.signals import FloatArray

NOISE = 10 ** (-50 / 20)
"""RMS of the noise over that of the output's motion."""
NOT_SCORED = 50
UNSEEN = 0.88
"""This part of a record is given; the FMU is measured beside the truth of the rest, too."""
PARTS = 4
"""Steps of the solver in a sample of the quarter car: long records take minutes with more."""


@dataclass(frozen=True, eq=False)
class Case:
    """A record, and what it is measured against.

    Attributes:
        file: name of its file.
        options: what ``init`` is told.
        inputs, truth: inputs and outputs without noise, (N,) each, by which the surrogate is
            measured beside what the report says; None if there are none.
        first: the first of these samples that counts.
        noise: RMS of the noise over that of the output; None if unknown.
    """

    file: str
    options: tuple[str, ...]
    inputs: FloatArray | None = None
    truth: FloatArray | None = None
    first: int = NOT_SCORED
    noise: float | None = None


def road_and_travel(samples: int, seed: int) -> tuple[FloatArray, FloatArray]:
    """Return heights of a rough road, and the travel of the suspension without noise, in m."""
    rng = np.random.default_rng(seed)
    road = quarter_car.rough_road(rng, samples, 0.02, 10.0)
    road = scipy.signal.lfilter(*scipy.signal.butter(2, 0.3), road)
    return road, quarter_car.simulate(road[None], substeps=PARTS)[0][:, 1]


def write_csv(path: Path, step: float, names: str, *columns: FloatArray) -> None:
    """Write columns behind a column of times."""
    time = step * np.arange(len(columns[0]))
    table = np.stack([time, *columns], axis=1)
    np.savetxt(path, table, "%.9g", ",", header=f"time [s],{names}", comments="")


def lay_quarter_car(folder: Path, data: Path | None, samples: int = 100_000) -> Case:
    """Write the record of a quarter car."""
    del data
    road, travel = road_and_travel(samples, 1)
    measured = travel + NOISE * travel.std() * np.random.default_rng(2).normal(size=samples)
    given = round(UNSEEN * samples)
    columns = road[:given], measured[:given]
    write_csv(folder / "car.csv", quarter_car.STEP, "road [m],travel [m]", *columns)
    options = ("--input", "road", "--output", "travel")
    return Case("car.csv", options, road, travel, given, NOISE)


def lay_tiny(folder: Path, data: Path | None) -> Case:
    """Write a record of 1000 samples."""
    return lay_quarter_car(folder, data, 1000)


def lay_one_period(folder: Path, data: Path | None) -> Case:
    """Write a record that repeats one period of 1000 samples twenty times."""
    del data
    road = np.tile(road_and_travel(1000, 1)[0], 20)
    travel = quarter_car.simulate(road[None], substeps=PARTS)[0][:, 1]
    write_csv(folder / "car.csv", quarter_car.STEP, "road [m],travel [m]", road, travel)
    return Case("car.csv", ("--input", "road", "--output", "travel"))


def lay_integrator(folder: Path, data: Path | None) -> Case:
    """Write a position under force: a mass with friction in proportion to its speed."""
    del data
    rng, step, pole = np.random.default_rng(1), 0.01, np.exp(-3.0 * 0.01)
    force = scipy.signal.lfilter(*scipy.signal.butter(2, 0.2), rng.normal(size=20_000))
    speed = scipy.signal.lfilter([(1 - pole) / 3.0], [1, -pole], force)
    write_csv(folder / "mass.csv", step, "force [N],position [m]", force, step * np.cumsum(speed))
    return Case("mass.csv", ("--input", "force"))


def lay_bouc_wen(folder: Path, data: Path | None) -> Case:
    """Write a mass on a Bouc-Wen spring (Noel and Schoukens, 2016) under a multisine."""
    del data
    rate, samples, parts = 750.0, 30_000, 20
    rng = np.random.default_rng(1)
    lines = np.zeros(samples // 2 + 1, complex)
    band = slice(round(5 * samples / rate), round(150 * samples / rate))
    lines[band] = np.exp(2j * np.pi * rng.random(len(lines[band])))
    force = np.fft.irfft(lines)
    force *= 50.0 / force.std()
    fine = np.interp(np.arange(parts * samples) / parts, np.arange(samples), force)
    position = np.empty(samples)
    y, v, z, h = 0.0, 0.0, 0.0, 1.0 / (rate * parts)
    for k, f in enumerate(fine):
        if k % parts == 0:
            position[k // parts] = y
        v += h * (f - 10.0 * v - 5e4 * y - z) / 2.0
        y += h * v
        z += h * (5e4 * v - 1e3 * (0.8 * abs(v) * z - 1.1 * v * abs(z)))
    write_csv(folder / "spring.csv", 1 / rate, "force [N],position [m]", force, position)
    return Case("spring.csv", ("--input", "force"))


def lay_wiener_hammerstein(folder: Path, data: Path | None) -> Case:
    """Write the part of the measured record that is learnt from, and keep the rest."""
    assert data is not None, "--data FOLDER; expected the folder of the record"
    whole = {}
    for key in ("u", "y"):
        found = [next(data.glob(f"*{part}*")) for part in ("train", "valid", "test")]
        whole[key] = np.concatenate([np.ravel(h5py.File(file)[key]) for file in found])
    with h5py.File(folder / "circuit.h5", "w") as file:
        for key, values in whole.items():
            file[key] = values[5_200:105_200]
    rest = slice(105_200, 184_000)
    options = ("--input", "u", "--output", "y", "--step", str(1 / 51_200))
    return Case("circuit.h5", options, whole["u"][rest], whole["y"][rest])


RECORDS: dict[str, Callable[[Path, Path | None], Case]] = {
    "quarter_car": lay_quarter_car,
    "wiener_hammerstein": lay_wiener_hammerstein,
    "integrator": lay_integrator,
    "bouc_wen": lay_bouc_wen,
    "tiny": lay_tiny,
    "one_period": lay_one_period,
}


def measure(arguments: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Go the way of one record."""
    del bar  # the commands show their own progress
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(arguments.folder or temporary)
        folder.mkdir(parents=True, exist_ok=True)
        data = None if arguments.data is None else Path(arguments.data)
        return go_through(
            arguments.record, RECORDS[arguments.record](folder, data), folder, arguments.seed
        )


def go_through(name: str, case: Case, folder: Path, seed: int) -> dict[str, Any]:
    """Type the commands in a folder, and return what they said and what came out."""
    recipe = f"{name}.toml"
    commands = (
        ("init", case.file, *case.options, "-o", recipe, "--name", name, "--force"),
        ("run", recipe, "--json", "report.json", "--seed", str(seed)),
    )
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    said: list[str] = []
    figures: dict[str, Any] = {"record": name, "seed": seed}
    for words in commands:
        done = subprocess.run(
            [sys.executable, "-m", "slide_fmu", *words], cwd=folder, capture_output=True, text=True
        )
        text = " ".join((done.stdout + done.stderr).split())
        said += [part for part in text.split("remark: ")[1:]]
        if done.returncode:
            return {**figures, "refused_by": words[0], "message": text[-1500:], "remarks": said}
    used = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
    report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    [output] = report["validation"]["in range"]["outputs"]
    return {
        **figures,
        "cpu_s": used,
        "relative_rmse": output["relative_rmse"],
        "free_relative_rmse": output.get("free_relative_rmse"),
        "noise_floor": output.get("relative_noise_floor"),
        "true_noise": case.noise,
        "parameters": report["parameters"],
        "n_in": report["window"]["window"]["n_in"],
        **_beside_truth(case, folder / "runs" / name / f"{name}.fmu"),
        "remark": report["remark"],
        "remarks": said,
    }


def _beside_truth(case: Case, fmu: Path) -> dict[str, float]:
    """Measure the surrogate on a stretch whose outputs are known without noise."""
    if case.inputs is None or case.truth is None:
        return {}
    surrogate = load(fmu)
    outputs = surrogate.predict_newest(case.inputs[1:, None])[:, 0]
    scored = slice(max(case.first, surrogate.network.memory_length), None)
    step, name = surrogate.window.step, surrogate.outputs[0].name
    table = np.zeros(len(case.inputs), [("time", float), (surrogate.inputs[0].name, float)])
    table["time"] = step * np.arange(len(table))
    table[surrogate.inputs[0].name] = case.inputs
    plain = fmpy.simulate_fmu(
        str(fmu), input=table, output=[name], stop_time=table["time"][-1], output_interval=step
    )
    error, of_plain = (
        float(rms((values - case.truth[1:])[scored, None])[0])
        for values in (outputs, plain[name][1 : len(table)])
    )
    size = float(rms(case.truth[1:][scored, None])[0])
    return {
        "rmse_beside_truth": error,
        "relative_beside_truth": error / size,
        "plain_call_of_fmpy": of_plain,
    }


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--record", choices=RECORDS, default="quarter_car")
    parser.add_argument("--seed", type=int, default=0, help="seed of the training")
    parser.add_argument("--data", help="folder of the record of 2009")
    parser.add_argument("--folder", help="where the work goes and stays; else it is removed")
    measure_and_write(parser, measure)


if __name__ == "__main__":
    main()
