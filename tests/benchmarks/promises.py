"""What is printed about an FMU, and what its user gets: the same cases by both ways.

    python tests/benchmarks/promises.py --json - --runs build/promises

Every case does what a user does: ``slide-fmu init`` and ``slide-fmu run`` with defaults where the
model is the user's own, then a plain ``fmpy.simulate_fmu`` with a table of inputs, as it stands in
any script. The truth is found without slide-fmu where that is possible: by scipy, by the user's
own FMU at its own step, or by the measured samples. ``printed`` is what the finished FMU says of
itself, ``got`` is the error that the user finds, both relative RMSE in % (RMS of the truth about
its mean).
``ratio`` is got over printed. ``--runs`` keeps the finished runs, so that a second call is quick.
"""

from __future__ import annotations

import argparse
import itertools
import json
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import fmpy
import numpy as np
from figures_out import measure_and_write
from scipy.integrate import solve_ivp

import slide_fmu as slide
from slide_fmu.core.progress import Stages
from slide_fmu.core.signals import FloatArray
from slide_fmu.data.draws import TEST, Stream, draw
from slide_fmu.fmu.export import read_fmu
from slide_fmu.pipeline.run_folder import recipe_of_provenance
from slide_fmu.recipe.case import case_of
from slide_fmu.report.run_figures import released_figures
from slide_fmu.systems.simulation import simulate
from slide_fmu.validation.constant_inputs import CORNERS
from slide_fmu.validation.row import ALL, CONSTANT, SMOOTH, RowOutput
from slide_fmu.validation.task import IN_RANGE
from tests.own_models import pendulum_trolley, quarter_car_corner, two_tanks
from tests.own_records import write_record

ROOT = Path(__file__).parents[2]
SEED = 987_654_321
"""No training, tuning, selection or validation uses this seed."""
RELEASED = {"slider_crank": 8, "robot_6r": 6}
"""Released FMUs whose inputs move, and how many motions each is driven through."""

Row = dict[str, Any]


def rms(values: FloatArray) -> FloatArray:
    """Root of the mean square of each column, (n_outputs,)."""
    return np.asarray(np.sqrt(np.mean(np.square(values), axis=0)))


def plain_call(
    fmu: Path, times: FloatArray, inputs: FloatArray, read: tuple[str, ...]
) -> FloatArray:
    """Call ``fmpy.simulate_fmu`` with a table of inputs, as users do, at the FMU's own step.

    Args:
        fmu: the FMU.
        times: times in s of the inputs, (N,).
        inputs: their values, (N, n_inputs), in the order of the model description.
        read: names of the variables that are read.

    Returns:
        Values at the communication points, (n_steps + 1, len(read)).
    """
    surrogate = slide.load(fmu)
    names = [signal.name for signal in surrogate.inputs]
    table = np.zeros(len(times), dtype=[("time", float), *((name, float) for name in names)])
    table["time"] = times
    for index, name in enumerate(names):
        table[name] = inputs[:, index]
    step = surrogate.window.step
    count = int(np.floor(times[-1] / step + 1e-6))
    result = fmpy.simulate_fmu(
        str(fmu), stop_time=count * step, output_interval=step, input=table, output=list(read)
    )
    return np.stack([result[name].astype(float) for name in read], axis=1)


def row(case: str, output: str, printed: float | None, got: float, **more: Any) -> Row:
    """Make one row of the table; both errors are fractions here and percentages there."""
    ratio = None if not printed else got / printed
    shown = None if printed is None else 100 * printed
    return {
        "case": case,
        "output": output,
        "printed_percent": shown,
        "got_percent": 100 * got,
        "ratio": ratio,
        **more,
    }


def measured_of(fmu: Path) -> dict[str, Any]:
    """Return the figures that a finished FMU carries."""
    _, provenance = read_fmu(fmu)
    assert provenance is not None
    return dict(provenance["measured"])


def printed_of(fmu: Path, group: str, inputs: str | None = None) -> list[RowOutput]:
    """Return what was printed of the outputs under some inputs, in the plain call at h."""
    measured = released_figures(read_fmu(fmu)[1])
    assert measured is not None
    (found,) = (
        row
        for row in measured.rows
        if row.group == group and inputs in (None, row.inputs) and row.is_at("plain", 1.0)
    )
    return list(found.outputs)


def released(name: str, motions: int) -> list[Row]:
    """Drive a released FMU by plain calls through motions of its kinds that nothing has seen."""
    fmu = ROOT / "fmus" / name / f"{name}.fmu"
    surrogate, provenance = read_fmu(fmu)
    recipe = recipe_of_provenance(provenance, str(fmu))
    system, step = case_of(recipe).reference, recipe.window.step
    outputs = tuple(signal.name for signal in surrogate.outputs)
    errors, truths = [], []
    for index in range(motions):
        drawn = draw(recipe, system, Stream(TEST, SEED, (1.0, 1.0), 20.0), index)
        true = simulate(system, drawn.inputs, drawn.initial).outputs
        times = step * np.arange(len(true))
        known = np.concatenate([drawn.inputs[:1], drawn.inputs])  # the values at these times
        found = plain_call(fmu, times, known, outputs)
        first = max(drawn.burn_in + 1, surrogate.network.memory_length)
        errors.append((found - true)[first:])
        truths.append(true[first:])
    true = np.concatenate(truths)
    got = rms(np.concatenate(errors)) / rms(true - true.mean(axis=0))
    printed = printed_of(fmu, IN_RANGE, ALL)
    called = f"{name}: fmpy.simulate_fmu(input=table)"
    return [
        row(called, output, figure.relative_rmse, float(error))
        for output, figure, error in zip(outputs, printed, got, strict=True)
    ]


def command(folder: Path, *words: str) -> None:
    """Run ``slide-fmu`` in a folder; its words go on to standard error."""
    subprocess.run(
        [sys.executable, "-m", "slide_fmu", *words], cwd=folder, check=True, stdout=sys.stderr
    )


def made(folder: Path, name: str, prepare: Callable[[Path], str], *options: str) -> Path:
    """Make an FMU by ``init`` and ``run`` with defaults, unless the folder has it; its path."""
    fmu = folder / "runs" / name / f"{name}.fmu"
    if not fmu.exists():
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        model = prepare(folder)
        command(folder, "init", model, "-o", f"{name}.toml", "--name", name, *options)
        command(folder, "run", f"{name}.toml")
    return fmu


def record(runs: Path) -> list[Row]:
    """Learn from a measured record, and run the part that nothing was learnt from."""
    folder = runs / "record"

    def prepare(place: Path) -> str:
        write_record(place / "bench.csv", samples=12000)
        return "bench.csv"

    fmu = made(folder, "bench", prepare, "--input", "force", "--output", "travel")
    table = np.genfromtxt(folder / "bench.csv", delimiter=",", skip_header=1)
    scored = json.loads((folder / "runs" / "bench" / "report.json").read_text("utf-8"))
    surrogate = slide.load(fmu)
    last = slice(int(0.85 * len(table)), None)  # inside the part "test", at the end of the record
    times, force, travel = table[last, 0], table[last, 1], table[last, 2]
    found = slide.simulate(fmu, times, force)
    first = surrogate.network.memory_length
    error = (
        rms((found[:, 0] - travel)[first:, None]) / (travel[first:] - travel[first:].mean()).std()
    )
    printed = scored["validation"]["in range"]["outputs"][0]["relative_rmse"]
    return [row("record: slide_fmu.simulate", "travel", printed, float(error[0]))]


def pendulum(runs: Path, own_step: float | None = None) -> list[Row]:
    """Learn from an FMU of 5 ms steps, and drive both by a smooth force of 0.9 and 3.1 rad/s.

    The FMU names no step. Without one the truth is what it does at so small steps that it does not
    matter; with ``own_step`` in s what it does as its user runs it, and as ``init`` was told.
    """
    folder = runs / ("pendulum" if own_step is None else "pendulum_by_steps")

    def prepare(place: Path) -> str:
        return pendulum_trolley.build(place).name

    options = () if own_step is None else ("--fmu-step", f"{own_step:g}")
    fmu = made(folder, "pendulum", prepare, "--input", "force=-100..100", *options)
    original = next(path for path in folder.glob("*.fmu"))
    step = own_step or 0.0005
    times = step * np.arange(round(120 / step) + 1)

    def pushed(t: FloatArray) -> FloatArray:
        return 45 * np.sin(0.9 * t) + 35 * np.sin(3.1 * t + 0.5)

    force = pushed(times)
    table = np.zeros(len(times), dtype=[("time", float), ("force", float)])
    # held over a step, the value in its middle is not late
    table["time"], table["force"] = times, force if own_step else pushed(times + 0.5 * step)
    surrogate = slide.load(fmu)
    outputs = tuple(signal.name for signal in surrogate.outputs)
    true = fmpy.simulate_fmu(
        str(original), stop_time=times[-1], output_interval=step, input=table,
        output=list(outputs),
    )  # fmt: skip
    read = (*outputs, *(f"{name}_error_bound" for name in outputs))
    found = plain_call(fmu, times, force[:, None], read)
    own = surrogate.window.step * np.arange(len(found))
    first = np.searchsorted(own, 60.0)
    rows = []
    printed = printed_of(fmu, SMOOTH)
    for index, name in enumerate(outputs):
        truth = np.interp(own, true["time"], true[name])
        error = (found[:, index] - truth)[first:]
        bound = found[first:, len(outputs) + index]
        got = float(rms(error[:, None])[0] / truth[first:].std())
        covered = float(np.mean(np.abs(error) <= bound))
        what = f"pendulum FMU by steps of {step:g} s, 0.9 and 3.1 rad/s: fmpy.simulate_fmu"
        figures = printed[index]
        told = {"covered": covered, "covered_printed": figures.covered}
        rows.append(row(what, name, figures.relative_rmse, got, **told))
    return rows


def corner(runs: Path) -> list[Row]:
    """Learn from the lower half of a quarter car, and move road and body smoothly."""
    folder = runs / "corner"

    def prepare(place: Path) -> str:
        shutil.copy(quarter_car_corner.__file__, place / "car.py")
        return "car.py"

    fmu = made(folder, "corner", prepare)
    surrogate = slide.load(fmu)
    step = surrogate.window.step
    times = step * np.arange(round(20 / step) + 1)
    p = SimpleNamespace(**quarter_car_corner.parameters)

    def moved(t: FloatArray | float) -> FloatArray:
        road = 0.02 * np.sin(7.0 * np.asarray(t)) + 0.01 * np.sin(31.0 * np.asarray(t))
        return np.stack([road, 0.03 * np.sin(6.0 * np.asarray(t) + 1.0)], axis=-1)

    def rates(t: float) -> FloatArray:
        return np.asarray((moved(t + 1e-6) - moved(t - 1e-6)) / 2e-6)

    found = plain_call(fmu, times, moved(times), ("force",))[:, 0]
    solved = solve_ivp(
        lambda t, x: quarter_car_corner.f(x, moved(t), p, rates(t)), (0.0, times[-1]),
        quarter_car_corner.start, t_eval=times, rtol=1e-9, atol=1e-12, max_step=step,
    )  # fmt: skip
    truth = np.array(
        [quarter_car_corner.g(x, moved(t), p, rates(t))[0]
         for t, x in zip(times, solved.y.T, strict=True)]
    )  # fmt: skip
    first = len(times) // 2
    got = float(rms((found - truth)[first:, None])[0] / truth[first:].std())
    printed = printed_of(fmu, SMOOTH)[0].relative_rmse
    return [row("corner of a car, road and body move smoothly", "force", printed, got)]


def tanks(runs: Path) -> list[Row]:
    """Learn from two tanks, and hold both inputs at all four corners of their ranges."""
    folder = runs / "tanks"

    def prepare(place: Path) -> str:
        shutil.copy(two_tanks.__file__, place / "two_tanks.py")
        return "two_tanks.py"

    fmu = made(folder, "two_tanks", prepare)
    surrogate = slide.load(fmu)
    outputs = tuple(signal.name for signal in surrogate.outputs)
    box = [(signal.low, signal.high) for signal in surrogate.inputs]
    step, memory = surrogate.window.step, surrogate.window.n_in
    times = step * np.arange(4 * memory)
    errors, covered = [], []
    for corner in itertools.product(*box):
        middle = np.array([(low + high) / 2 for low, high in box])
        values = np.where((times < times[memory])[:, None], middle, np.array(corner))
        read = (*outputs, *(f"{name}_error_bound" for name in outputs))
        found = plain_call(fmu, times, values, read)[-memory:]
        rest = steady_levels(np.array(corner))
        error = found[:, : len(outputs)] - rest
        covered.append(np.mean(np.abs(error) <= found[:, len(outputs) :], axis=0))
        errors.append(error)
    # as printed, relative to how far the outputs move on the motions in range
    in_range = measured_of(fmu)["validation"]["in range"]["outputs"]
    size = np.array([output["rms_reference_about_mean"] for output in in_range])
    got = rms(np.concatenate(errors)) / size
    printed = printed_of(fmu, CONSTANT, CORNERS)
    return [
        row("two tanks, steady at all four corners", name, figure.relative_rmse, float(error),
            covered=float(np.mean(covered, axis=0)[index]))
        for index, (name, figure, error) in enumerate(zip(outputs, printed, got, strict=True))
    ]  # fmt: skip


def steady_levels(inputs: FloatArray) -> FloatArray:
    """Integrate the tanks under constant inputs until they rest; the levels in m, (2,)."""
    p = SimpleNamespace(**two_tanks.parameters)
    solved = solve_ivp(
        lambda _, x: two_tanks.f(x, inputs, p), (0.0, 1e5), two_tanks.start, method="LSODA",
        rtol=1e-8, atol=1e-10,
    )  # fmt: skip
    return np.asarray(two_tanks.g(solved.y[:, -1], inputs, p))


def estimates(runs: Path) -> list[Row]:
    """Say what the error estimates of the FMUs made here are worth, next to a constant."""
    found = []
    for name in ("pendulum", "tanks"):
        fmu = next((runs / name / "runs").glob("*/*.fmu"))
        estimate = measured_of(fmu)["validation"]["in range"].get("error_estimate")
        if estimate is None:
            found.append({"case": f"{name}: error estimate", "exported": False})
            continue
        for one in estimate["without_floor"]:
            found.append({"case": f"{name}: error estimate", "exported": True, **one})
    return found


def measure(arguments: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Go through all cases that were asked for."""
    runs = Path(arguments.runs).resolve()
    cases: dict[str, Callable[[], list[Row]]] = {
        "record": lambda: record(runs),
        "pendulum": lambda: pendulum(runs),
        "pendulum_by_steps": lambda: pendulum(runs, 0.005),
        "corner": lambda: corner(runs),
        "tanks": lambda: tanks(runs),
        "estimates": lambda: estimates(runs),
        **{name: lambda name=name, n=n: released(name, n) for name, n in RELEASED.items()},  # type: ignore[misc]
    }
    wanted = arguments.cases or list(cases)
    progress, rows = bar("cases"), []
    for index, name in enumerate(wanted):
        progress(index, len(wanted))
        rows += cases[name]()
    progress(len(wanted), len(wanted))
    return {"rows": rows}


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", default="build/promises", help="folder of the runs")
    parser.add_argument("--cases", nargs="*", help="only these")
    measure_and_write(parser, measure)


if __name__ == "__main__":
    main()
