"""What the card of a record prints, against the half of the record that nobody gave.

    python tests/benchmarks/unseen_halves.py --json -
    python tests/benchmarks/unseen_halves.py --record drive --seed 1 --json -

Each record is made here, twice as long as what is given: ``slide-fmu init`` and ``run`` see the
first half, by defaults and with nothing edited. The error that the card prints, in the call with
known inputs, stands next to the error of the same FMU on the second half, by ``predict``, by
``predict_newest`` and in the plain call of fmpy. ``ratio`` is the larger of the card's and that of
``predict_newest`` over the smaller, of the output where they differ most. Both are of measured
outputs, with their noise.

- ``drive``: a motor turns a generator through a shaft with play; both have dry friction. The level
  of the voltage changes from stretch to stretch, so that the halves differ.
- ``moves``: 54 moves of a flexible joint of 0.5 s at 1 kHz, each from rest and in its own file.
- ``noise_1``, ``noise_10``: an oscillator with a hardening spring, and 1 or 10 % of noise.
- ``rows_lost``: the same with 1 % of noise, where 2 % of the rows of the given half are lost.
- ``held_output``, ``held_input``: the same, where the sensor of the travel, or of the force,
  stands still for a tenth of the given half.
- ``modes``: three forces and three places of a structure with 28 lightly damped states, in 18
  files of two periods each, with 0.3 % of noise; as many others are not given.

A command that refuses is no failure here: its message is a figure. If its recipe has
keys that would mend the record, they are typed, too, and the figures are those of the second try.
"""

from __future__ import annotations

import argparse
import json
import re
import resource
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
from figures_out import measure_and_write
from scipy.linalg import block_diag, expm
from scipy.signal import butter, sosfilt

from slide_fmu import load
from slide_fmu.core.progress import Stages
from slide_fmu.core.signals import FloatArray

FINE = 20
"""Steps of the solver in a sample of the drive."""
PLAY = 0.004
"""Half of the play in the shaft of the drive, in rad."""
DRIVE_STEP, JOINT_STEP, STEP = 0.02, 1e-3, 0.01
LOST, STOOD = 0.02, 0.1
"""Part of the rows that are lost, and of the time for which a sensor stands still."""


Signals = tuple[FloatArray, FloatArray]
"""Inputs, (N, q), and outputs, (N, p)."""


@dataclass(frozen=True, eq=False)
class Whole:
    """A whole record, of which the first half is given.

    Attributes:
        step: sample step in s.
        names: columns of inputs and of outputs, with units.
        files: one file, which is cut in the middle; or several, of which the first half is given.
        from_rest: whether each of several files begins at rest.
        spoilt: spoils the table of a given file: times, inputs and outputs; None for no change.
    """

    step: float
    names: tuple[tuple[str, ...], tuple[str, ...]]
    files: list[Signals]
    from_rest: bool = True
    spoilt: Callable[[FloatArray], FloatArray] | None = None

    @property
    def given(self) -> list[FloatArray]:
        """The tables that ``init`` and ``run`` see: times, inputs and outputs."""
        files = self.files[: max(1, len(self.files) // 2)]
        if len(self.files) == 1:
            [(inputs, outputs)] = files
            files = [(inputs[: len(inputs) // 2], outputs[: len(inputs) // 2])]
        tables = [np.column_stack([self.step * np.arange(len(u)), u, y]) for u, y in files]
        return tables if self.spoilt is None else [self.spoilt(table) for table in tables]

    def unseen(self, lead: int) -> list[tuple[FloatArray, FloatArray, int]]:
        """Inputs, outputs and the first scored sample of all else; a lead fills the window."""
        if len(self.files) > 1:
            first = 1 if self.from_rest else lead
            return [(*both, first) for both in self.files[len(self.files) // 2 :]]
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
    names = ("voltage [V]",), ("speed [rad/s]",)
    return Whole(DRIVE_STEP, names, [(voltage[:, None], noisy[:, None])])


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
        noisy = answer + 1e-3 * rng.normal(size=len(torque))
        files.append((torque[:, None], noisy[:, None]))
    return Whole(JOINT_STEP, (("torque [N.m]",), ("speed [rad/s]",)), files)


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
    return Whole(STEP, (("force [N]",), ("travel [m]",)), [(force[:, None], noisy[:, None])])


def rows_lost(seed: int) -> Whole:
    """The oscillator with 1 % of noise, of which every fiftieth given row or so is lost."""
    rng = np.random.default_rng(100 + seed)

    def spoilt(table: FloatArray) -> FloatArray:
        return table[rng.random(len(table)) > LOST]

    return replace(oscillator(0.01, seed), spoilt=spoilt)


def held(column: int, seed: int) -> Whole:
    """The oscillator with 1 % of noise, of which a column stands still for a while."""

    def spoilt(table: FloatArray) -> FloatArray:
        first = int(0.45 * len(table))
        still = table.copy()
        still[first : first + int(STOOD * len(table)), column] = table[first, column]
        return still

    return replace(oscillator(0.01, seed), spoilt=spoilt)


def modes(seed: int, count: int = 36, period: int = 2048, pairs: int = 14) -> Whole:
    """A structure of three forces and three places under multisines, each file of two periods."""
    rng, n = np.random.default_rng(seed), 2 * pairs
    turn = 2 * np.pi * np.geomspace(3, 30, pairs) * rng.uniform(0.97, 1.03, pairs)
    damping = rng.uniform(0.01, 0.02, pairs)
    blocks = [[[-z * w, w], [-w, -z * w]] for z, w in zip(damping, turn, strict=True)]
    b, c = np.zeros((n, 3)), np.zeros((3, n))
    b[1::2] = rng.normal(size=(pairs, 3)) * np.sqrt(turn)[:, None]
    c[:, ::2] = (rng.normal(size=(pairs, 3)) / np.sqrt(turn)[:, None]).T
    whole = np.block([[block_diag(*blocks), b], [np.zeros((3, n + 3))]])
    stepped = expm(STEP * whole)
    a, b = stepped[:n, :n], stepped[:n, n:]
    lines, files = np.arange(1, round(35 * STEP * period) + 1), []
    for _ in range(count):
        spectrum = np.zeros((period // 2 + 1, 3), complex)
        spectrum[lines] = np.exp(2j * np.pi * rng.uniform(size=(len(lines), 3)))
        force = np.fft.irfft(spectrum, period, axis=0)
        force, state = np.tile(force / force.std(axis=0), (4, 1)), np.zeros(n)
        place = np.empty_like(force)
        for k, value in enumerate(force):
            place[k] = c @ state
            state = a @ state + b @ value
        files.append((force[-2 * period :], place[-2 * period :]))
    size = np.concatenate([place for _, place in files]).std(axis=0)
    noisy = [(u, y + 3e-3 * size * rng.normal(size=y.shape)) for u, y in files]
    names = tuple(f"f{k} [N]" for k in (1, 2, 3)), tuple(f"q{k} [m]" for k in (1, 2, 3))
    return Whole(STEP, names, noisy, from_rest=False)


RECORDS: dict[str, Callable[[int], Whole]] = {
    "drive": drive,
    "moves": moves,
    "noise_1": lambda seed: oscillator(0.01, seed),
    "noise_10": lambda seed: oscillator(0.1, seed),
    "rows_lost": rows_lost,
    "held_output": lambda seed: held(2, seed),
    "held_input": lambda seed: held(1, seed),
    "modes": modes,
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
    signals = [[words.split(" ")[0] for words in group] for group in whole.names]
    header = ",".join(["time [s]", *whole.names[0], *whole.names[1]])
    files = []
    for number, table in enumerate(whole.given):
        files.append(f"bench_{number:02d}.csv")
        np.savetxt(folder / files[-1], table, "%.9g", ",", header=header, comments="")
    columns = [word for one in signals[0] for word in ("--input", one)]
    columns += [word for one in signals[1] for word in ("--output", one)]
    recipe = f"{name}.toml"
    first = ("init", *files, *columns, "-o", recipe, "--name", name, "--force")
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    refused, said = typed(first, folder)
    if refused is not None:
        proposed = re.search(r"^# (parameters = .*)$", (folder / recipe).read_text(), re.MULTILINE)
        if proposed is None:
            return {"refused_by": "init", "message": refused, "remarks": said}
        keys = tomllib.loads(proposed[1])["parameters"].items()
        more = [word for key, value in keys for word in ("--read", f"{key}={value}")]
        again, said = typed((*first, *more), folder)
        if again is not None:
            return {"refused_by": "init", "message": refused, "mended": more, "then": again}
        refused = f"{refused} | mended by {' '.join(more)}"
    stopped, remarks = typed(("run", recipe, "--json", "report.json", "--seed", str(seed)), folder)
    if stopped is not None:
        return {
            "refused_by": "run",
            "message": stopped,
            "init": refused,
            "remarks": said + remarks,
        }
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    outputs = report["validation"]["in range"]["outputs"]
    fmu = folder / "runs" / name / f"{name}.fmu"
    errors = errors_on_unseen(fmu, whole, [one["rms_reference_about_mean"] for one in outputs])
    card = [one["relative_rmse"] for one in outputs]
    pairs = list(zip(card, errors["predict_newest"], strict=True))
    return {
        "cpu_s": after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime,
        "init_refused": refused,
        "card": card,
        "card_plain": [one.get("plain_relative_rmse") for one in outputs],
        "card_of_blocks": [one["relative_rmse_of_trajectories"] for one in outputs],
        "unseen": errors,
        "ratio": max(max(pair) / min(pair) for pair in pairs),
        "noise_floor": [one.get("relative_noise_floor") for one in outputs],
        "n_in": report["window"]["window"]["n_in"],
        "sizes": report.get("sizes_tried"),
        "remark": report["remark"],
        "remarks": said + remarks,
    }


def typed(words: Sequence[str], folder: Path) -> tuple[str | None, list[str]]:
    """Type a command; return its message if it refuses, else None, and its remarks."""
    done = subprocess.run(
        [sys.executable, "-m", "slide_fmu", *words], cwd=folder, capture_output=True, text=True
    )
    text = " ".join((done.stdout + done.stderr).split())
    return text[-1500:] if done.returncode else None, text.split("remark: ")[1:]


def errors_on_unseen(fmu: Path, whole: Whole, sizes: Sequence[float]) -> dict[str, list[float]]:
    """Return RMS errors on what was not given, relative to sizes of the outputs: the card's."""
    surrogate = load(fmu)
    names = [signal.name for signal in surrogate.outputs]
    # with a zero-order hold, an output answers the input one sample earlier
    later = 1 if surrogate.hold == "zero_order" else 0
    found: dict[str, list[FloatArray]] = {}
    for given, truth, first in whole.unseen(3 * surrogate.memory_length):
        first = min(first, len(given) // 2)
        inputs = given[1 - later : len(given) - later]
        time = whole.step * np.arange(len(given))
        table = np.zeros(
            len(given), [("time", float), *((one.name, float) for one in surrogate.inputs)]
        )
        table["time"] = time
        for index, one in enumerate(surrogate.inputs):
            table[one.name] = given[:, index]
        plain = fmpy.simulate_fmu(
            str(fmu), input=table, output=names, stop_time=time[-1], output_interval=whole.step
        )
        answers = {
            "predict": surrogate.predict(inputs),
            "predict_newest": surrogate.predict_newest(inputs),
            "plain_call_of_fmpy": np.stack([plain[one][1 : len(given)] for one in names], axis=1),
        }
        for way, outputs in answers.items():
            found.setdefault(way, []).append((outputs - truth[1:])[first - 1 :])
    return {
        way: (np.sqrt(np.mean(np.concatenate(errors) ** 2, axis=0)) / sizes).tolist()
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
