"""Random moves, optimised by surrogates, with and without verification; reference models judge.

    python tests/benchmarks/chosen_motions.py --moves 20 --json -

Starts and goals are drawn as by ``slide-fmu motion --calibrate``; all else is that of the tasks in
docs/tutorials. A violation is a move that leaves more than the tolerance after its arrival.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any

import numpy as np
from figures_out import measure_and_write
from seeds import CHOSEN_MOTIONS

from slide_fmu.apps.motion import MotionError, MoveTask, coordinates_of, read_task
from slide_fmu.apps.motion.calibration import random_task
from slide_fmu.apps.motion.margin import margins_of
from slide_fmu.apps.motion.solve import (
    MoveSolution,
    answer,
    factor_of,
    problem_of,
    reference_of,
    solve,
)
from slide_fmu.core.figures import plain
from slide_fmu.core.progress import Stages, quiet
from slide_fmu.fmu.export import read_fmu

ROOT = Path(__file__).parents[2]
TASKS = {
    "robot_6r": "pick_and_place",
    "slider_crank": "turned_crank",
    "slider_crank_payload": "turned_payload",
}
"""FMUs, and their tasks in docs/tutorials."""


def judged(solved: MoveSolution, seconds: float) -> dict[str, Any]:
    """Judge a move and its baselines by the reference model."""
    figures = plain(solved.figures())
    true, predicted = figures["reference"], figures["move"]
    settled = {row["name"]: row["settled_s"] or np.inf for row in true["baselines"]}
    plainly = settled.pop("not shaped")
    mine, best = true["move"]["settled_s"] or np.inf, min(settled.values(), default=np.inf)
    return {
        "move": predicted["name"],
        "settled_s": mine,
        "earlier_than_plain": 1 - mine / plainly,
        "earlier_than_best_shaper": 1 - mine / best,
        "residual": true["move"]["residual"],
        "violation": true["move"]["residual"] > solved.task.tolerance,
        "beyond_margin": true["move"]["residual"] > predicted["residual_with_margin"],
        "rounds": figures["rounds"],
        "cpu_s": seconds,
    }


def both_ways(fmu: Path, task: MoveTask) -> dict[str, Any]:
    """Solve a task with and without verification; a refusal is its message."""
    released, provenance = read_fmu(fmu)
    reference = reference_of(fmu, released, task.parameters, quiet)
    found: dict[str, Any] = {}
    for way in ("unverified", "verified"):
        begin = time.process_time()
        try:
            if way == "verified":
                solved = solve(fmu, task, verify=True)
                seconds = time.process_time() - begin
            else:
                margins = margins_of(released, provenance, factor_of(task, provenance))
                problem = problem_of(released, task, margins)
                chosen = answer(problem, task)
                seconds = time.process_time() - begin
                true = chosen.response.verified_by(reference)
                moves = (chosen.move, *chosen.baselines)
                truths = tuple(true.truth(move.motion) for move in moves)
                solved = MoveSolution(task, problem, chosen, truths)
            found[way] = judged(solved, seconds)
        except MotionError as refused:
            found[way] = str(refused)
    return found


def measure(chosen: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Judge all moves of all FMUs, and say what they have in common."""
    found: dict[str, Any] = {"seed": chosen.seed}
    for name in chosen.fmu or TASKS:
        fmu = ROOT / "fmus" / name / f"{name}.fmu"
        task = read_task(ROOT / "docs" / "tutorials" / f"{TASKS[name]}.toml")
        assert isinstance(task, MoveTask)
        if chosen.margin_factor is not None:
            task = task.model_copy(update={"margin_factor": chosen.margin_factor})
        coordinates, rng = (
            coordinates_of(read_fmu(fmu)[0].inputs),
            np.random.default_rng(chosen.seed),
        )
        rows, progress = [], bar(name)
        for done in range(chosen.moves):
            progress(done, chosen.moves)
            rows.append(both_ways(fmu, random_task(task, coordinates, rng)))
        progress(chosen.moves, chosen.moves)
        ways = {way: summary([row[way] for row in rows]) for way in ("unverified", "verified")}
        found[name] = {**ways, "moves": rows}
    return found


def summary(rows: list[Any]) -> dict[str, Any]:
    """Count violations, and give quantiles of the rest; refused tasks are counted apart."""
    answers = [row for row in rows if isinstance(row, dict)]
    counted = "violation", "beyond_margin"
    names = "earlier_than_plain", "earlier_than_best_shaper", "residual", "rounds", "cpu_s"
    return {
        "answers": len(answers),
        "refused": len(rows) - len(answers),
        "optimised": sum(row["move"] == "optimised" for row in answers),
        **{name: sum(row[name] for row in answers) for name in counted},
        **{name: _quantiles([row[name] for row in answers]) for name in names if answers},
    }


def _quantiles(values: list[float]) -> dict[str, float]:
    return {"least": min(values), "median": float(np.median(values)), "most": max(values)}


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--moves", type=int, default=20, help="number of moves of each FMU")
    parser.add_argument("--seed", type=int, default=CHOSEN_MOTIONS)
    parser.add_argument("--fmu", choices=list(TASKS), action="append", help="one FMU; may repeat")
    parser.add_argument("--margin-factor", type=float, help="in place of that in the FMUs")
    measure_and_write(parser, measure)
