"""What the card of a record prints, against the half of the record that nobody gave.

    python tests/benchmarks/unseen_halves.py --json -
    python tests/benchmarks/unseen_halves.py --record drive --seed 1 --json -

Each record is made here, twice as long as what is given: ``slide-fmu init`` and ``run`` see the
first half, by defaults and with nothing edited. The error that the card prints, in the call with
known inputs, stands next to the error of the same FMU on the second half, by ``predict``, by
``predict_newest`` and in the plain call of fmpy. ``ratio`` is the larger of the card's and that of
``predict_newest`` over the smaller. Both are of measured outputs, with their noise.

- ``drive``: a motor turns a generator through a shaft with play; both have dry friction. The level
  of the voltage changes from stretch to stretch, so that the halves differ.
- ``moves``: moves of a flexible joint of 0.5 s between rests of 2 s, at 1 kHz.
- ``noise_1``, ``noise_10``: an oscillator with a bent output and 1 or 10 % of noise.

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
import numpy as np
from figures_out import measure_and_write

from slide_fmu import load
from slide_fmu.core.progress import Stages
from slide_fmu.core.signals import FloatArray
from tests.own_records import STEP, force_and_travel

FINE = 20
"""Steps of the solver in a sample of the drive."""
DRIVE_STEP, JOINT_STEP = 0.02, 1e-3


@dataclass(frozen=True, eq=False)
class Whole:
    """A whole record of one input and one output, (N,) each, of which the first half is given."""

    step: float
    given: FloatArray
    answer: FloatArray
    names: tuple[str, str]

    @property
    def half(self) -> int:
        return len(self.given) // 2


def drive(seed: int, samples: int = 4_000) -> Whole:
    """A motor (voltage in) turns a generator (speed out) through a shaft with play."""
    rng = np.random.default_rng(seed)
    voltage = np.empty(0)
    while len(voltage) < samples:
        level, size = rng.uniform(-0.6, 0.6), rng.uniform(0.3, 1.0)
        stretch = rng.integers(200, 500)
        held = np.repeat(rng.uniform(-size, size, stretch), rng.integers(5, 40, stretch))[:stretch]
        voltage = np.append(voltage, np.clip(level + held, -1.0, 1.0))
    voltage, h = voltage[:samples], DRIVE_STEP / FINE
    speed, motor, generator, twist = np.empty(samples), 0.0, 0.0, 0.0
    for k in range(samples):
        speed[k] = generator
        for _ in range(FINE):
            play = twist - float(np.clip(twist, -0.02, 0.02))
            torque = 8.0 * play + (0.05 * (motor - generator) if play else 0.0)
            motor += h / 0.05 * (voltage[k] - 0.15 * motor - 0.15 * np.tanh(motor / 0.02) - torque)
            generator += h / 0.08 * (torque - 0.2 * generator - 0.05 * np.tanh(generator / 0.02))
            twist += h * (motor - generator)
    noisy = speed + 2e-3 * speed.std() * rng.normal(size=samples)
    return Whole(DRIVE_STEP, voltage, noisy, ("voltage [V]", "speed [rad/s]"))


def moves(seed: int, count: int = 24, rest: int = 1000) -> Whole:
    """Moves of a joint with a bent spring: torque in, speed out, at rest in between."""
    rng = np.random.default_rng(seed)
    torque = np.zeros(0)
    shape = np.sin(np.pi * np.arange(500) / 500) ** 2
    for _ in range(count):
        wave = np.cumsum(rng.normal(size=500))
        wave -= np.linspace(wave[0], wave[-1], 500)
        move = shape * (rng.uniform(-1, 1) + 0.5 * wave / np.abs(wave).max())
        torque = np.concatenate([torque, np.zeros(rest), move])
    h, place, speed = JOINT_STEP / 4, 0.0, 0.0
    answer = np.empty(len(torque))
    for k, value in enumerate(torque):
        answer[k] = speed
        for _ in range(4):
            speed += h * (60.0 * value - 25.0 * speed - 900.0 * place - 6e3 * place**3)
            place += h * speed
    return Whole(JOINT_STEP, torque, answer, ("torque [N.m]", "speed [rad/s]"))


def oscillator(noise: float, seed: int, samples: int = 12_000) -> Whole:
    """An oscillator with a bent output, and noise relative to its standard deviation."""
    force, travel = force_and_travel(samples, seed)
    rng = np.random.default_rng(1000 + seed)
    noisy = travel + noise * travel.std() * rng.normal(size=samples)
    return Whole(STEP, force, noisy, ("force [N]", "travel [m]"))


RECORDS: dict[str, Callable[[int], Whole]] = {
    "drive": drive,
    "moves": moves,
    "noise_1": lambda seed: oscillator(0.01, seed),
    "noise_10": lambda seed: oscillator(0.1, seed),
}


def measure(arguments: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Go the way of all records that are asked for."""
    del bar  # the commands show their own progress
    names = list(RECORDS) if arguments.record == "all" else [arguments.record]
    found = {}
    for name in names:
        with tempfile.TemporaryDirectory() as temporary:
            folder = Path(arguments.folder or temporary) / name
            folder.mkdir(parents=True, exist_ok=True)
            whole = RECORDS[name](arguments.seed)
            found[name] = go_through(name, whole, folder, arguments.seed)
    return found


def go_through(name: str, whole: Whole, folder: Path, seed: int) -> dict[str, Any]:
    """Type the commands in a folder, and return what they said and what came out."""
    half, (given, answer) = whole.half, (w.split(" ")[0] for w in whole.names)
    time = whole.step * np.arange(half)
    table = np.stack([time, whole.given[:half], whole.answer[:half]], axis=1)
    header = ",".join(["time [s]", *whole.names])
    np.savetxt(folder / "bench.csv", table, "%.9g", ",", header=header, comments="")
    columns = "--input", given, "--output", answer
    recipe = f"{name}.toml"
    commands = (
        ("init", "bench.csv", *columns, "-o", recipe, "--name", name, "--force"),
        ("run", recipe, "--json", "report.json", "--seed", str(seed)),
    )
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    said: list[str] = []
    for words in commands:
        done = subprocess.run(
            [sys.executable, "-m", "slide_fmu", *words], cwd=folder, capture_output=True, text=True
        )
        text = " ".join((done.stdout + done.stderr).split())
        said += text.split("remark: ")[1:]
        if done.returncode:
            return {"refused_by": words[0], "message": text[-1500:], "remarks": said}
    used = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
    report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    [output] = report["validation"]["in range"]["outputs"]
    fmu = folder / "runs" / name / f"{name}.fmu"
    errors = errors_on_unseen(fmu, whole)
    card, newest = output["relative_rmse"], errors["predict_newest"]
    return {
        "cpu_s": used,
        "card": card,
        "card_plain": output.get("plain_relative_rmse"),
        "unseen": errors,
        "ratio": max(card, newest) / min(card, newest),
        "noise_floor": output.get("relative_noise_floor"),
        "n_in": report["window"]["window"]["n_in"],
        "sizes": report.get("sizes_tried"),
        "remark": report["remark"],
        "remarks": said,
    }


def errors_on_unseen(fmu: Path, whole: Whole) -> dict[str, float]:
    """Return errors on the second half, relative to the outputs' standard deviation there.

    Inputs before it are known, so that windows are full.
    """
    surrogate = load(fmu)
    begin = max(0, whole.half - 3 * surrogate.memory_length)
    # without a first-order hold, an output answers the input one sample earlier
    later = 1 if surrogate.hold == "zero_order" else 0
    inputs = whole.given[begin + 1 - later : len(whole.given) - later, None]
    truth = whole.answer[begin + 1 :]
    scored = slice(whole.half - begin, None)

    def error(outputs: FloatArray) -> float:
        apart = outputs[scored] - truth[scored]
        return float(np.sqrt(np.mean(apart**2)) / truth[scored].std())

    table = np.zeros(len(whole.given) - begin, [("time", float), ("u", float)])
    table["time"], table["u"] = whole.step * np.arange(len(table)), whole.given[begin:]
    table.dtype.names = ("time", surrogate.inputs[0].name)
    name, last = surrogate.outputs[0].name, float(table["time"][-1])
    plain = fmpy.simulate_fmu(
        str(fmu), input=table, output=[name], stop_time=last, output_interval=whole.step
    )
    return {
        "predict": error(surrogate.predict(inputs)[:, 0]),
        "predict_newest": error(surrogate.predict_newest(inputs)[:, 0]),
        "plain_call_of_fmpy": error(np.asarray(plain[name])[1 : len(truth) + 1]),
    }


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--record", choices=[*RECORDS, "all"], default="all")
    parser.add_argument("--seed", type=int, default=0, help="seed of record and training")
    parser.add_argument("--folder", help="where the work goes and stays; else it is removed")
    measure_and_write(parser, measure)


if __name__ == "__main__":
    main()
