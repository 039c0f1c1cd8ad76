"""What coupled runs of machines that were cut in two are measured by.

Errors are RMS errors of the partner's responses against the whole machine in one model, relative
to the RMS about the mean. The energy that a coupling adds is the work of the partner less the work
that the same motion does on the exact half, as a part of the energy that passed the cut: with a
surrogate it contains the surrogate's own error.
"""

from __future__ import annotations

import argparse
import math
import tempfile
import time
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from slide_fmu.apps.couple.result import CoupledRun
from slide_fmu.core.progress import Stages
from slide_fmu.core.signals import FloatArray
from slide_fmu.importer.errors import CoSimulationError
from tests.benchmarks.coupled_trust import FINER, best_speeds, has_bound, replayed, truth
from tests.own_models.systems.cut_machine import CutMachine, relative_error

METHODS: dict[str, dict[str, str]] = {
    "newton": {"method": "newton"},
    "gauss_seidel": {"method": "gauss_seidel"},
}
Surrogates = Mapping[str, Path]
"""FMUs of surrogates, by the component that they replace: ``half`` or ``partner``."""

FIRST, FACTOR, TIMES = 0.0001, 2**0.25, (1, 2, 5, 10, 20, 50, 100)
"""Explicit steps grow from the first one in s by this factor; implicit ones are tried at these
multiples of the longest stable explicit step."""
PARTS = (2, 5, 10)
"""Parts of the machine's step at which explicit steps are tried too."""
FREE_STEPS, REST = (60, 3000), 3.0
"""A partner that was let go must come to rest within this time in s, in a number of steps between
these."""
LONGEST = 1.0
"""Longest explicit step in s that is tried."""
USUAL_RUN, LONGEST_RUN, DRIVEN_STEPS, MUCH_FURTHER = 20.0, 200.0, 600, 3.0
"""A driven partner must stay within this multiple of what it moves in the first time in s; the
command lasts for the second time in s, and the test for at most this number of steps."""
SEED = 9000
"""Seed of the first partner's command; no training draws commands."""
REPEATS = 5
STEPS = (2000, 24)
"""Steps of the runs whose CPU time is measured: the fewer ones where explicit steps grow."""
SHORT = 20.0
"""Time in s of the runs whose speed is measured."""


def accuracy(
    run_with: Callable[..., CoupledRun], true: Mapping[str, FloatArray], machine: CutMachine
) -> dict[str, Any]:
    """Return errors, iterations and the energy that was added, of both methods."""
    found: dict[str, Any] = {}
    for name, how in METHODS.items():
        try:
            run = run_with(**how)
        except CoSimulationError as error:
            found[name] = {"failed": str(error)}
            continue
        third = len(run.time) // 3
        parts = {
            "all": slice(None),
            "first third": slice(third),
            "last third": slice(-third, None),
        }
        errors = {
            response: {
                part: rms_error(run[_named(response)][where], values[where], values)
                for part, where in parts.items()
            }
            for response, values in true.items()
        }
        figures = run.figures
        found[name] = {"errors": errors, "iterations": figures.iterations}
        found[name]["most iterations"] = figures.most_iterations
        if name == "newton" and "partner.work" in run.values:
            added = run["partner.work"][-1] - machine.work(run, machine.step)
            found[name]["energy added"] = float(added / run["partner.exchanged"][-1])
    return found


def _named(response: str) -> str:
    """Return the name in a run of a response, which is the partner's if it names no component."""
    return response if "." in response else f"partner.{response}"


def rms_error(found: FloatArray, true: FloatArray, whole: FloatArray) -> float:
    """Return the RMS error of a part of a run, relative to the RMS about the mean of the whole."""
    return relative_error(found, true) * float(true.std() / whole.std())


def steps_in(step: float) -> int:
    """Return the number of steps, each of this length in s, of a test of stability."""
    return min(max(FREE_STEPS[0], math.ceil(REST / step)), FREE_STEPS[1])


def is_stable(
    machine: CutMachine, folder: Path, surrogates: Surrogates, step: float, how: Any
) -> bool:
    """Return whether a partner that is let go comes to rest."""
    partner, response, begun = machine.free
    count = steps_in(step)
    try:
        run = machine.run(folder, surrogates, partner, machine.let_go, step, count * step, **how)
    except CoSimulationError:
        return False
    last = np.abs(run[f"partner.{response}"][-count // 4 :])
    return bool(last.max() < 0.5 * begun)


def stability(machine: CutMachine, folder: Path, surrogates: Surrogates) -> dict[str, Any]:
    """Return the longest stable explicit step in s, and how far the implicit method goes.

    A step is stable if a partner that is let go comes to rest, and the driven one moves not much
    further than by Newton's method at the machine's step. The search begins at the first step of
    all, since long steps may be stable again: the partner rests within each of them. It begins at
    the machine's step where the first one is unstable, since a surrogate may be stable at its own
    step, but not at parts of it.
    """
    explicit, implicit = METHODS["gauss_seidel"], METHODS["newton"]
    partner, response, _ = machine.free
    command = machine.drive(partner, SEED, LONGEST_RUN)

    def moved(step: float, stop: float, how: Any) -> float:
        run = machine.run(folder, surrogates, partner, command, step, stop, **how)
        return float(np.abs(run[f"partner.{response}"]).max())

    usual = moved(machine.step, USUAL_RUN, implicit)

    def stable(step: float, how: Any = explicit) -> bool:
        if not is_stable(machine, folder, surrogates, step, how):
            return False
        try:
            count = min(steps_in(step), DRIVEN_STEPS)
            return moved(step, count * step, how) < MUCH_FURTHER * usual
        except CoSimulationError:
            return False

    step = FIRST if stable(FIRST) else machine.step
    if not stable(step):
        return {"unstable_s": step}
    while step * FACTOR < LONGEST and stable(step * FACTOR):
        step *= FACTOR
    return {
        "gauss_seidel_s": step,
        "gauss_seidel, stable at these parts of the machine's step": [
            part for part in PARTS if stable(machine.step / part)
        ],
        "newton, stable at these multiples": [n for n in TIMES if stable(n * step, implicit)],
    }


def cost(machine: CutMachine, folder: Path, surrogates: Surrogates) -> dict[str, float]:
    """Return CPU times of a step in s at the machine's step, without the begin of a run."""
    partner = next(iter(machine.partners.values()))
    command = machine.drive(partner, SEED, STEPS[0] * machine.step)

    def cpu_time(steps: int, how: Any) -> float:
        before = time.process_time()
        stop = steps * machine.step
        machine.run(folder, surrogates, partner, command, machine.step, stop, **how)
        return time.process_time() - before

    def of_a_step(steps: int) -> dict[str, float]:
        lengths = steps, 4
        runs = [
            {name: [cpu_time(n, how) for n in lengths] for name, how in METHODS.items()}
            for _ in range(REPEATS)  # methods take turns: the processor's pace changes
        ]
        least = {name: np.min([run[name] for run in runs], axis=0) for name in METHODS}
        return {name: float(np.ptp(both)) / (steps - 4) for name, both in least.items()}

    try:
        found = of_a_step(STEPS[0])
    except CoSimulationError:
        found = of_a_step(STEPS[1])
    return {**found, "newton over gauss_seidel": found["newton"] / found["gauss_seidel"]}


def speeds(machine: CutMachine, folder: Path, kinds: Mapping[str, Surrogates]) -> dict[str, float]:
    """Return simulated seconds for each second of computing: the whole machine, and coupled."""
    partner = next(iter(machine.partners.values()))
    command = machine.drive(partner, SEED, SHORT)
    ways: dict[str, Callable[[], Any]] = {
        f"newton, {kind}": partial(
            machine.run, folder, surrogates, partner, command, machine.step, SHORT
        )
        for kind, surrogates in kinds.items()
    }
    ways["whole machine"] = partial(machine.whole, partner, command, machine.step, SHORT)
    return best_speeds(SHORT, ways, 2)


def bounds(
    machine: CutMachine, folder: Path, surrogates: Surrogates, stop: float, smooth: bool = False
) -> Any:
    """Return how often error bounds hold, by component, as means over runs of all partners.

    ``smooth`` lays a spline through the command, which has kinks at every second sample at most.
    """
    found: dict[str, list[dict[str, float]]] = {}
    short = machine.step * round(stop / len(machine.partners) / machine.step)
    for number, partner in enumerate(machine.partners.values()):
        command = machine.drive(partner, SEED + number, short)
        if smooth:
            knots = np.arange(0.0, short + machine.step, 2 * machine.step)
            command = CubicSpline(knots, command(knots))
        run = machine.run(folder, surrogates, partner, command, machine.step, short)
        for name in (name for name, fmu in surrogates.items() if has_bound(fmu)):
            exact = (
                machine.write_half(folder, machine.step / FINER)
                if name == "half"
                else machine.write_partner(folder, machine.step / FINER, partner)
            )
            sources, targets = zip(*machine.links, strict=True)
            inputs = [one.partition(".")[2] for one in targets if one.startswith(f"{name}.")]
            given = {one: CubicSpline(run.time, run[f"{name}.{one}"]) for one in inputs}
            if name == "partner":
                given[machine.command] = command
            output = next(one.partition(".")[2] for one in sources if one.startswith(f"{name}."))
            true = truth(exact, given, run, output)
            of_run = replayed(run, name, surrogates[name], list(given), output, true)
            found.setdefault(name, []).append(of_run)
    return {
        name: {key: float(np.mean([one[key] for one in runs])) for key in runs[0]}
        for name, runs in found.items()
    }


def kinds_of(arguments: argparse.Namespace) -> dict[str, Surrogates]:
    """Return the surrogates of each kind of run."""
    named = {"half": arguments.surrogate, "partner": arguments.partner}
    given = {name: fmu for name, fmu in named.items() if fmu is not None}
    kinds: dict[str, Surrogates] = {"exact halves": {}}
    if len(given) > 1:
        kinds |= {f"surrogate of the {name}": {name: fmu} for name, fmu in given.items()}
    if given:
        kinds["surrogate" if len(given) == 1 else "two surrogates"] = given
    return kinds


def measure(machine: CutMachine, arguments: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Measure all figures of a machine, with exact halves and with surrogates."""
    kinds = kinds_of(arguments)
    found: dict[str, Any] = {"duration_s": arguments.stop, "step_s": machine.step}
    found |= {kind: {} for kind in kinds}
    work = [(name, kind) for name in machine.partners for kind in kinds]
    progress, step, stop = bar("coupled"), machine.step, arguments.stop
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        for number, (name, kind) in enumerate(work):
            progress(number, len(work))
            partner = machine.partners[name]
            if number % len(kinds) == 0:
                seed = SEED + number // len(kinds)
                command = machine.drive(partner, seed, stop)
                true = machine.whole(partner, command, step, stop)
            ride = partial(machine.run, folder, kinds[kind], partner, command, step, stop)
            found[kind][name] = accuracy(ride, true, machine)
        for kind, surrogates in kinds.items() if arguments.steps else []:
            found[kind]["stable steps"] = stability(machine, folder, surrogates)
            found[kind]["seconds of a step"] = cost(machine, folder, surrogates)
        if arguments.steps:
            found["simulated seconds in a second"] = speeds(machine, folder, kinds)
        for kind, surrogates in kinds.items():
            if any(map(has_bound, surrogates.values())):
                found[kind]["bounds"] = bounds(machine, folder, surrogates, stop)
                found[kind]["bounds, command without kinks"] = bounds(
                    machine, folder, surrogates, stop, smooth=True
                )
        progress(len(work), len(work))
    return found


def parser_of(text: str | None) -> argparse.ArgumentParser:
    """Return the command line of a benchmark of a machine."""
    parser = argparse.ArgumentParser(
        description=text, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--surrogate", type=Path, help="FMU in the place of the exact half")
    parser.set_defaults(partner=None)  # the partner's place, which some benchmarks offer
    parser.add_argument("--stop", type=float, default=60.0, help="duration of a run in s")
    parser.add_argument(
        "--no-steps", dest="steps", action="store_false", help="no stable steps and no CPU times"
    )
    return parser
