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
- ``moves``: 54 moves of a flexible joint of 0.5 s at 1 kHz, each from rest and in its own file.
- ``noise_1``, ``noise_10``: an oscillator with a hardening spring, and 1 or 10 % of noise.

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
from scipy.signal import butter, sosfilt

from slide_fmu import load
from slide_fmu.core.progress import Stages
from slide_fmu.core.signals import FloatArray

FINE = 20
"""Steps of the solver in a sample of the drive."""
PLAY = 0.004
"""Half of the play in the shaft of the drive, in rad."""
DRIVE_STEP, JOINT_STEP, STEP = 0.02, 1e-3, 0.01


Signals = tuple[FloatArray, FloatArray]
"""Inputs and outputs, (N,) each."""


@dataclass(frozen=True, eq=False)
class Whole:
    """A whole record of one input and one output, of which the first half is given.

    Attributes:
        step: sample step in s.
        names: columns of input and output, with units.
        files: one file, which is cut in the middle; or several, of which the first half is given.
    """

    step: float
    names: tuple[str, str]
    files: list[Signals]

    @property
    def given(self) -> list[Signals]:
        """The files that ``init`` and ``run`` see."""
        if len(self.files) > 1:
            return self.files[: len(self.files) // 2]
        [(inputs, outputs)] = self.files
        return [(inputs[: len(inputs) // 2], outputs[: len(inputs) // 2])]

    def unseen(self, lead: int) -> list[tuple[FloatArray, FloatArray, int]]:
        """Inputs, outputs and the first scored sample of all else; a lead fills the window."""
        if len(self.files) > 1:  # each begins at rest
            return [(*both, 1) for both in self.files[len(self.files) // 2 :]]
        [(inputs, outputs)] = self.files
        half = len(inputs) // 2
        begin = max(0, half - lead)
        return [(inputs[begin:], outputs[begin:], half - begin)]


def drive(seed: int, samples: int = 8_000) -> Whole:
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
            play = twist - float(np.clip(twist, -PLAY, PLAY))
            torque = 8.0 * play + (0.05 * (motor - generator) if play else 0.0)
            motor += h / 0.05 * (voltage[k] - 0.15 * motor - 0.08 * np.tanh(motor / 0.05) - torque)
            generator += h / 0.08 * (torque - 0.2 * generator - 0.05 * np.tanh(generator / 0.05))
            twist += h * (motor - generator)
    noisy = speed + 2e-3 * speed.std() * rng.normal(size=samples)
    return Whole(DRIVE_STEP, ("voltage [V]", "speed [rad/s]"), [(voltage, noisy)])


def moves(seed: int, count: int = 54, rest: int = 150) -> Whole:
    """Moves of a joint with a bent spring, torque in, speed out: each from rest, in a file."""
    rng, files = np.random.default_rng(seed), []
    shape = np.sin(np.pi * np.arange(500) / 500) ** 2
    for _ in range(count):
        wave = np.cumsum(rng.normal(size=500))
        wave -= np.linspace(wave[0], wave[-1], 500)
        move = shape * (rng.uniform(-1, 1) + 0.5 * wave / np.abs(wave).max())
        torque = np.concatenate([np.zeros(rest), move, np.zeros(rest)])
        h, place, speed, answer = JOINT_STEP / 4, 0.0, 0.0, np.empty(len(torque))
        for k, value in enumerate(torque):
            answer[k] = speed
            for _ in range(4):
                speed += h * (60.0 * value - 12.0 * speed - 900.0 * place - 6e3 * place**3)
                place += h * speed
        files.append((torque, answer + 1e-3 * rng.normal(size=len(torque))))
    return Whole(JOINT_STEP, ("torque [N.m]", "speed [rad/s]"), files)


def oscillator(noise: float, seed: int, samples: int = 12_000) -> Whole:
    """An oscillator with a bent spring, and noise relative to its standard deviation.

    The force is limited, so that no half moves far beyond the other.
    """
    rng = np.random.default_rng(seed)
    wanted = sosfilt(butter(2, 0.1, output="sos"), rng.normal(size=samples))
    force = np.tanh(wanted / wanted.std())
    place, speed, h, travel = 0.0, 0.0, STEP / 8, np.empty(samples)
    for k in range(samples):
        travel[k] = place
        for _ in range(8):
            speed += h * (400.0 * force[k] - 8.0 * speed - 400.0 * place - 300.0 * place**3)
            place += h * speed
    noisy = travel + noise * travel.std() * rng.normal(size=samples)
    return Whole(STEP, ("force [N]", "travel [m]"), [(force, noisy)])


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
    given, answer = (words.split(" ")[0] for words in whole.names)
    files = []
    for number, (inputs, outputs) in enumerate(whole.given):
        table = np.stack([whole.step * np.arange(len(inputs)), inputs, outputs], axis=1)
        header = ",".join(["time [s]", *whole.names])
        files.append(f"bench_{number}.csv")
        np.savetxt(folder / files[-1], table, "%.9g", ",", header=header, comments="")
    columns = "--input", given, "--output", answer
    recipe = f"{name}.toml"
    commands = (
        ("init", *files, *columns, "-o", recipe, "--name", name, "--force"),
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
    errors = errors_on_unseen(fmu, whole, output["rms_reference_about_mean"])
    card, newest = output["relative_rmse"], errors["predict_newest"]
    return {
        "cpu_s": used,
        "card": card,
        "card_plain": output.get("plain_relative_rmse"),
        "card_of_blocks": output["relative_rmse_of_trajectories"],
        "unseen": errors,
        "ratio": max(card, newest) / min(card, newest),
        "noise_floor": output.get("relative_noise_floor"),
        "n_in": report["window"]["window"]["n_in"],
        "sizes": report.get("sizes_tried"),
        "remark": report["remark"],
        "remarks": said,
    }


def errors_on_unseen(fmu: Path, whole: Whole, size: float) -> dict[str, float]:
    """Return RMS errors on what was not given, relative to a size of the output: the card's."""
    surrogate = load(fmu)
    name = surrogate.outputs[0].name
    # with a zero-order hold, an output answers the input one sample earlier
    later = 1 if surrogate.hold == "zero_order" else 0
    found: dict[str, list[FloatArray]] = {}
    truths = []
    for given, truth, first in whole.unseen(3 * surrogate.memory_length):
        inputs = given[1 - later : len(given) - later, None]
        time = whole.step * np.arange(len(given))
        table = np.array(
            list(zip(time, given, strict=True)),
            dtype=[("time", float), (surrogate.inputs[0].name, float)],
        )
        plain = fmpy.simulate_fmu(
            str(fmu), input=table, output=[name], stop_time=time[-1], output_interval=whole.step
        )
        answers = {
            "predict": surrogate.predict(inputs)[:, 0],
            "predict_newest": surrogate.predict_newest(inputs)[:, 0],
            "plain_call_of_fmpy": np.asarray(plain[name])[1 : len(given)],
        }
        scored = slice(first - 1, None)
        truths.append(truth[1:][scored])
        for way, outputs in answers.items():
            found.setdefault(way, []).append(outputs[scored] - truths[-1])
    return {
        way: float(np.sqrt(np.mean(np.concatenate(errors) ** 2)) / size)
        for way, errors in found.items()
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
