"""What a communication step costs in C and through fmpy, by call and by communication step.

    python tests/benchmarks/step_cost.py fmus/*/*.fmu --json -
    python tests/benchmarks/step_cost.py NEW/robot_6r.fmu --against OLD --json -
    python tests/benchmarks/step_cost.py FMU --steps h,h/2,h/8,0.001,irregular --calls plain

``plain``: inputs are those at the begin of the step. ``known``: they are those at its end
(``inputs_at_step_end``; FMUs that hold their inputs have no such call). Inputs are set before each
step and move as in the trajectory that the FMU carries, there and back without an end. After each
step outputs are read or, ``with_bounds``, also error estimates, error bounds and ``trusted``.

``c_us`` is the time of set, step and read called from a loop in C, ``fmpy_us`` that of the same
calls of fmpy: medians over the rounds, processor time of the thread. Every variant has an instance
of its own whose memory is filled before; all take turns, some milliseconds each. So ratios are
medians over pairs in one round: ``*_over_own_step`` to the same call at H = h, ``*_over_against``
to the FMU of the same file name in the folder (or the file) ``--against``, each at its own h.

``state_bytes`` is the size of a saved state, nearly all that an instance has of its own.

Steps H are given in s or as h, 2h, h/4, h/1.7; ``irregular`` draws every step from h/10 to h,
``mixed`` from h, h/2, h/4, h/5 and h/8.
"""

from __future__ import annotations

import argparse
import ctypes
import re
import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from c_steps import CSteps, load_steps
from figures_out import measure_and_write
from scipy.interpolate import CubicSpline

from slide_fmu.apps.credentials.experiment import read_experiment
from slide_fmu.core.progress import Stages
from slide_fmu.core.signals import FloatArray
from slide_fmu.importer.file import UnpackedFmu, unpacked
from slide_fmu.importer.instance import Instance, instantiated

CALLS = ("plain", "known")
KNOWN, TRUSTED = "inputs_at_step_end", "trusted"
COSTLY = ("_error_estimate", "_error_bound")
"""Ends of the names of variables that tell the error of an output."""
STEPS = "h,2h,h/2,h/4,h/8,0.001,0.01,irregular,mixed"
IRREGULAR, MIXED, LEAST = "irregular", "mixed", 0.1
"""Irregular steps are at least this part of h."""
PARTS = (1, 2, 4, 5, 8)
"""Of h, of which mixed steps are drawn."""
TURN, FEWEST, MOST = 3e-3, 128, 2000
"""Seconds of a turn, and limits of the number of its steps; 1 ms has 125 phases in 31.25 ms."""
UNTIMED = 32
"""Steps at the begin of a turn, until caches hold the instance again."""
FILLED, CHUNK, LONGEST = ("window_filled", "error_bound_filled"), 200, 2.0
"""Variables that tell that memory is filled, steps between two looks at them, and the time after
the first of them at which the second is not waited for any more, over that of the first."""

Motion = Callable[[FloatArray], FloatArray]
"""Gives inputs, shape (N, n_inputs), at times in s, shape (N,)."""


@dataclass(frozen=True)
class Case:
    """A Case is what is asked of every file of one FMU.

    Attributes:
        inputs: names of the inputs.
        outputs: names of the outputs.
        motion: how the inputs move.
    """

    inputs: list[str]
    outputs: list[str]
    motion: Motion


@dataclass(frozen=True)
class Variant:
    """A Variant is one way to step an FMU.

    Attributes:
        call: one of ``CALLS``.
        bounds: whether error estimates, bounds and ``trusted`` are read.
        step: the communication step, as given.
    """

    call: str
    bounds: bool
    step: str

    def possible(self, fmu: UnpackedFmu) -> bool:
        """Whether the FMU has the variables that this needs."""
        return (self.call != "known" or KNOWN in fmu.references) and (
            not self.bounds or TRUSTED in fmu.references
        )


def length_of(step: str, own: float) -> float | None:
    """The communication step in s of an FMU whose own is given; None if steps are drawn.

    Raises:
        ValueError: it is neither seconds nor a multiple or a part of h.
    """
    if step in (IRREGULAR, MIXED):
        return None
    found = re.fullmatch(r"([\d.]*)h(?:/([\d.]+))?", step)
    if found is not None:
        return float(found[1] or 1) * own / float(found[2] or 1)
    try:
        return float(step)
    except ValueError:
        raise ValueError(
            f"communication step {step!r}; "
            f"expected seconds, {IRREGULAR}, {MIXED}, or such as h, 2h, h/4"
        ) from None


class Stepper:
    """A Stepper steps one instance of an FMU, in C and through fmpy by turns.

    Args:
        fmu: where the instance is from.
        instance: the instance.
        variant: how it is stepped.
        case: its inputs and outputs.
        steps: the library of ``c/steps.c``.

    Attributes:
        instance: the instance.
    """

    def __init__(
        self,
        fmu: UnpackedFmu,
        instance: Instance,
        variant: Variant,
        case: Case,
        steps: ctypes.CDLL,
    ) -> None:
        self.instance, self._variant, self._motion = instance, variant, case.motion
        self._own, self.length = fmu.step, length_of(variant.step, fmu.step)
        self._rng, self._time = np.random.default_rng(0), 0.0
        names = list(case.outputs)
        if variant.bounds:
            told = [name + end for name in case.outputs for end in COSTLY]
            names += [name for name in told if name in fmu.references] + [TRUSTED]
        fmu.require(*case.inputs, *names)
        self._inputs = [fmu.references[name] for name in case.inputs]
        at = [fmu.references[name] for name in names]
        self._booleans = [fmu.references[TRUSTED]] if variant.bounds else []
        self._reals = [reference for reference in at if reference not in self._booleans]
        calls, component = instance.calls, ctypes.c_void_p(instance.calls.component)
        self._c = CSteps(steps, calls.dll, component, self._inputs, self._reals, self._booleans)
        self._filled = [fmu.references[name] for name in FILLED if name in fmu.references]
        first = case.motion(np.zeros(1))[0].tolist()
        instance.set_up({KNOWN: 1.0} if variant.call == "known" else {})
        calls.setReal(self._inputs, first)
        instance.enter_initialization()
        calls.setReal(self._inputs, first)
        instance.exit_initialization()
        self._fill()
        self.count = self._count()

    def _next(self, count: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Times and lengths in s of the next steps, and the inputs that are set before them."""
        if self._variant.step == MIXED:
            lengths = self._own / self._rng.choice(PARTS, count)
        elif self.length is None:
            lengths = self._own * self._rng.uniform(LEAST, 1.0, count)
        else:
            lengths = np.full(count, self.length)
        ends = self._time + np.cumsum(lengths)
        times = np.append(self._time, ends[:-1])
        self._time = float(ends[-1])
        return times, lengths, self._motion(ends if self._variant.call == "known" else times)

    def _fill(self) -> None:
        """Step until the memory is filled, as far as the FMU says that of this step."""
        first = None
        while first is None or self._time < LONGEST * first:
            self._c.run(*self._next(CHUNK))
            filled = self.instance.calls.getReal(self._filled)
            if first is None and filled[0] >= 1:
                first = self._time
            if min(filled) >= 1:
                return

    def _count(self) -> int:
        """The number of steps in a turn."""
        seconds = self._c.run(*self._next(FEWEST))[1] / FEWEST
        return int(np.clip(TURN / seconds, FEWEST, MOST))

    def in_c(self) -> float:
        """Processor time in s of a step that C does, in a turn."""
        self._c.run(*self._next(UNTIMED))
        return self._c.run(*self._next(self.count))[1] / self.count

    def through_fmpy(self) -> float:
        """Processor time in s of a step through fmpy, in a turn."""
        self._loop(UNTIMED)
        return self._loop(self.count) / self.count

    def _loop(self, count: int) -> float:
        times, lengths, inputs = (values.tolist() for values in self._next(count))
        calls, references = self.instance.calls, self._inputs
        begin = time.thread_time()
        for start, length, row in zip(times, lengths, inputs, strict=True):
            calls.setReal(references, row)
            calls.doStep(start, length)
            calls.getReal(self._reals)
            if self._booleans:
                calls.getBoolean(self._booleans)
        return time.thread_time() - begin


def case_of(fmu: Path) -> Case:
    """What an FMU carries: its inputs move by cubic splines, there and back without an end.

    Raises:
        ValueError: it carries no trajectory.
    """
    found = read_experiment(fmu)
    if found is None:
        raise ValueError(f"{fmu}: it carries no trajectory; expected an FMU that slide-fmu wrote")
    values = np.stack(list(found.inputs.values()), axis=1)
    spline = CubicSpline(found.step * np.arange(len(values)), values)
    end = found.step * (len(values) - 1)

    def motion(times: FloatArray) -> FloatArray:
        return np.asarray(spline(end - np.abs(times % (2 * end) - end)))

    return Case(list(found.inputs), list(found.reference), motion)


def other_of(fmu: Path, against: Path | None) -> Path | None:
    """The FMU to compare with: a file, or that of the same file name below a folder.

    Raises:
        FileNotFoundError: the folder has not exactly one such file.
    """
    if against is None or against.is_file():
        return against
    found = sorted(against.rglob(fmu.name))
    if len(found) != 1:
        raise FileNotFoundError(f"{against}: {len(found)} files {fmu.name}; expected one")
    return found[0]


Times = dict[tuple[str, Variant, str], list[float]]
"""Seconds of a step in every round, by file, variant and ``c`` or ``fmpy``."""


def measure_fmu(fmu: Path, arguments: argparse.Namespace, steps: ctypes.CDLL) -> dict[str, Any]:
    """Figures of one FMU."""
    case, other = case_of(fmu), other_of(fmu, arguments.against)
    files = {"own": fmu} if other is None else {"own": fmu, "against": other}
    wanted = [
        Variant(call, bounds, step)
        for call in arguments.calls
        for bounds in (False, True)
        for step in arguments.steps
    ]
    steppers: dict[tuple[str, Variant], Stepper] = {}
    with ExitStack() as stack:
        for name, file in files.items():
            opened = stack.enter_context(unpacked(file))
            for variant in wanted:
                if variant.possible(opened):
                    instance = stack.enter_context(instantiated(opened))
                    steppers[name, variant] = Stepper(opened, instance, variant, case, steps)
        sizes = {name: state_bytes(stepper.instance) for (name, _), stepper in steppers.items()}
        times: Times = {}
        for _ in range(arguments.rounds):
            for (name, variant), stepper in steppers.items():
                times.setdefault((name, variant, "c"), []).append(stepper.in_c())
                times.setdefault((name, variant, "fmpy"), []).append(stepper.through_fmpy())
    return {
        "files": {name: str(file) for name, file in files.items()},
        "state_bytes": sizes,
        "rows": [
            {
                "file": name,
                "call": variant.call,
                "with_bounds": variant.bounds,
                "step": variant.step,
                "step_s": stepper.length,
                **figures_of(times, name, variant),
            }
            for (name, variant), stepper in steppers.items()
        ],
    }


def state_bytes(instance: Instance) -> int:
    """Size of a serialised state of an instance of FMI 2.0."""
    state = instance.save()
    size = len(instance.calls.serializeFMUstate(state))
    instance.free_state(state)
    return size


def figures_of(times: Times, name: str, variant: Variant) -> dict[str, float]:
    """Medians over the rounds of times in us, and of ratios in one round."""
    own_step = Variant(variant.call, variant.bounds, "h")
    beside = {"over_own_step": (name, own_step)}
    if name == "own":
        beside["over_against"] = ("against", variant)
    found = {}
    for way in ("c", "fmpy"):
        seconds = np.array(times[name, variant, way])
        found[f"{way}_us"] = 1e6 * float(np.median(seconds))
        for kind, (file, other) in beside.items():
            pairs = times.get((file, other, way))
            if pairs is not None:
                found[f"{way}_{kind}"] = float(np.median(seconds / np.array(pairs)))
    return found


def measure(arguments: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Figures of all FMUs."""
    arguments.steps, arguments.calls = arguments.steps.split(","), arguments.calls.split(",")
    figures, show = {}, bar("FMUs")
    with tempfile.TemporaryDirectory() as folder:
        steps = load_steps(Path(folder))
        for number, fmu in enumerate(arguments.fmus):
            figures[fmu.stem] = measure_fmu(fmu, arguments, steps)
            show(number + 1, len(arguments.fmus))
    return {"rounds": arguments.rounds, "fmus": figures}


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("fmus", type=Path, nargs="+")
    parser.add_argument("--against", type=Path, help="an FMU, or a folder that has the same files")
    parser.add_argument(
        "--steps", default=STEPS, help=f"communication steps; {STEPS} if not given"
    )
    parser.add_argument("--calls", default=",".join(CALLS))
    parser.add_argument("--rounds", type=int, default=15)
    measure_and_write(parser, measure)


if __name__ == "__main__":
    main()
