"""How many small faults the tests find: ``python -m tests.mutation.run --json -``.

Every mutant of a module is a copy of its source with one fault. The tests of the module run on a
copy of the repository that holds the mutant; it is killed if they fail. Those that survive are
listed: either a test is missing, or the fault changes nothing that anybody can see.
"""

from __future__ import annotations

import argparse
import json
import random
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, field
from pathlib import Path
from queue import SimpleQueue
from typing import Any

from tests.mutation.mutants import Mutant, c_mutants
from tests.mutation.planted import plant_all
from tests.mutation.python_mutants import python_mutants
from tests.mutation.trials import copies, outcome

RUNTIME = "slide_fmu/fmu/runtime"
PATIENCE = 4.0
"""A mutant whose tests take so many times as long as those of the sources hangs: it is killed."""


@dataclass(frozen=True)
class Module:
    """Sources that are mutated, and the tests that shall find it.

    Attributes:
        sources: paths below the root.
        tests: files of tests.
        essential: whether tests marked ``extended`` are left out, which would take too long.
    """

    sources: tuple[str, ...]
    tests: tuple[str, ...]
    essential: bool = False

    def options(self) -> tuple[str, ...]:
        """Return what pytest is given: the tests and the marks of those that run."""
        return (*self.tests, "-m", "not extended") if self.essential else self.tests


MODULES = {
    "window": Module(("slide_fmu/core/window.py",), ("tests/core/test_window.py",)),
    "validation": Module(
        (
            "slide_fmu/validation/validate.py",
            "slide_fmu/validation/comparison.py",
            "slide_fmu/validation/results.py",
            "slide_fmu/validation/calls.py",
            "slide_fmu/validation/input_courses.py",
            "slide_fmu/validation/row.py",
            "slide_fmu/validation/speed.py",
        ),
        ("tests/validation/test_row.py", "tests/validation/test_input_courses.py",
         "tests/validation/test_calls.py", "tests/validation/test_estimates.py",
         "tests/report/test_figures.py", "tests/validation/test_comparison.py",
         "tests/validation/test_speed.py", "tests/validation/test_validation.py",
         "tests/validation/test_moving_inputs.py", "tests/validation/test_inputs_that_bend.py",
         "tests/validation/test_parameters.py", "tests/report/test_charts.py",
         "tests/validation/test_worker_processes.py", "tests/validation/test_at_once.py"),
    ),
    "sizing": Module(
        ("slide_fmu/memory/sizing.py", "slide_fmu/memory/motions.py"),
        ("tests/memory/test_sizing.py", "tests/memory/test_path_dependence.py",
         "tests/memory/test_time_budget.py",
         "tests/memory/test_lengths.py", "tests/memory/test_motion_lengths.py"),
    ),
    "stability": Module(
        ("slide_fmu/memory/stability.py",),
        ("tests/memory/test_stability.py", "tests/validation/test_parameters.py"),
    ),
    "estimate": Module(
        ("slide_fmu/surrogate/error_estimator.py",),
        ("tests/surrogate/test_error_estimator.py", "tests/surrogate/test_surrogate.py"),
    ),
    "bound": Module(
        ("slide_fmu/bounds/judge.py", "slide_fmu/bounds/error_bound.py",
         "slide_fmu/surrogate/error_bound.py",
         "slide_fmu/surrogate/bound_statistics.py"),
        ("tests/surrogate/test_trust.py", "tests/surrogate/test_span_estimate.py",
         "tests/surrogate/test_bound_parts.py", "tests/surrogate/test_error_bound.py",
         "tests/bounds/test_head_loss.py", "tests/bounds/test_judge.py",
         "tests/bounds/test_error_bound.py"),
        essential=True,
    ),
    "estimate in C": Module(
        (f"{RUNTIME}/network/estimate.c",),
        ("tests/fmu/test_ranges.py", "tests/fmu/test_estimates.py", "tests/fmu/test_runtime.py",
         "tests/fmu/test_moving_inputs.py"),
    ),
}  # fmt: skip


@dataclass
class Score:
    """What became of the mutants of a module.

    Attributes:
        all: mutants that there are.
        tried: those that ran; a sample if time was short.
        killed: those that the tests found.
        hung: those of the killed whose tests did not end in time.
        survivors: file, line and fault of the others.
    """

    all: int
    tried: int = 0
    killed: int = 0
    hung: int = 0
    survivors: list[str] = field(default_factory=list)


def mutants_of(source: str, text: str) -> list[tuple[str, Mutant]]:
    """All mutants of a source, with its path below the root."""
    make = c_mutants if source.endswith(".c") else python_mutants
    return [(source, mutant) for mutant in make(text)]


def label(source: str, mutant: Mutant) -> str:
    """File, line and fault: how a mutant is called among the survivors."""
    return f"{source}:{mutant.line}: {mutant.fault}"


def sample_of(
    mutants: list[tuple[str, Mutant]], seed: int, count: int | None, former: list[str] | None
) -> list[tuple[str, Mutant]]:
    """The mutants that are tried, in a random order.

    Args:
        mutants: all mutants of a module.
        seed: of the order.
        count: the first so many of them; None is all.
        former: survivors of a former run, of which alone it is asked again; None asks for all.
    """
    order = list(mutants)
    random.Random(seed).shuffle(order)
    sample = order[:count]
    return sample if former is None else [pair for pair in sample if label(*pair) in former]


def measure(module: Module, places: list[Path], seconds: float, choice: tuple[Any, ...]) -> Score:
    """Try mutants of a module until all are tried or the time is over.

    Args:
        module: whose sources are mutated.
        places: copies of the repository; as many mutants are tried at once.
        seconds: no mutant is begun after so many.
        choice: which are tried, and in which order: seed, count and former of ``sample_of``.

    Raises:
        RuntimeError: the tests fail on the sources as they are.
    """
    texts = {source: (places[0] / source).read_text("utf-8") for source in module.sources}
    mutants = [mutant for source, text in texts.items() for mutant in mutants_of(source, text)]
    tried = sample_of(mutants, *choice)
    begin = time.monotonic()
    if outcome(places[0], module.sources, module.options(), 600.0) != "passed":
        raise RuntimeError(f"{' '.join(module.tests)} fail on the sources as they are; mend them")
    patience = PATIENCE * (time.monotonic() - begin) + 10
    begin = time.monotonic()
    score, free = Score(len(mutants)), SimpleQueue[Path]()
    for place in places:
        free.put(place)

    def attempt(source: str, mutant: Mutant) -> None:
        if time.monotonic() - begin > seconds:
            return
        place = free.get()
        (place / source).write_text(mutant.text, encoding="utf-8")
        end = outcome(place, module.sources, module.options(), patience)
        (place / source).write_text(texts[source], encoding="utf-8")
        free.put(place)
        score.tried += 1
        score.killed += end != "passed"
        score.hung += end == "hung"
        if end == "passed":
            score.survivors.append(label(source, mutant))

    with ThreadPoolExecutor(len(places)) as pool:
        for _ in pool.map(lambda pair: attempt(*pair), tried):
            pass
    return score


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", metavar="FILE", help="write the scores there; - is stdout")
    parser.add_argument("--limit", type=float, default=600.0, help="seconds for each module")
    parser.add_argument(
        "--count", type=int, help="mutants of each module; all of them if left out"
    )
    parser.add_argument("--seed", type=int, default=0, help="of the order of the mutants")
    parser.add_argument("--only", choices=MODULES, action="append", help="one module of all")
    parser.add_argument("--again", metavar="FILE", help="only the survivors in these scores")
    parser.add_argument("--workers", type=int, default=2, help="mutants that are tried at once")
    parser.add_argument(
        "--planted", action="store_true", help="the faults that once no test saw, and those alone"
    )
    task = parser.parse_args()
    if task.planted:
        sys.exit(plant_all())
    former = None if task.again is None else json.loads(Path(task.again).read_text("utf-8"))
    scores: dict[str, Score] = {}
    with copies(task.workers) as places:
        for name in task.only or former or MODULES:
            again = None if former is None else former[name]["survivors"]
            choice = task.seed, task.count, again
            score = scores[name] = measure(MODULES[name], places, task.limit, choice)
            share = 100 * score.killed / max(1, score.tried)
            print(
                f"{name}: {score.killed} of {score.tried} killed ({share:.0f} %), "
                f"{score.hung} of them by time, of {score.all} mutants",
                file=sys.stderr, flush=True,
            )  # fmt: skip
            for line in score.survivors:
                print(f"  survived: {line}", file=sys.stderr, flush=True)
    if task.json is not None:
        text = json.dumps({name: asdict(score) for name, score in scores.items()}, indent=2) + "\n"
        sys.stdout.write(text) if task.json == "-" else Path(task.json).write_text(text, "utf-8")


if __name__ == "__main__":
    main()
