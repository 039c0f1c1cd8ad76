"""Random moves of the robot, optimised by its surrogate, beside shapers; the finest model judges.

    python tests/benchmarks/chosen_motions.py --moves 20 --json -

Both places are drawn within 60 % of the joints' ranges; the limits are those of docs/tutorials/
pick_and_place.toml. Settled means within 0.1 mm of rest for good, by the reference model.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any

import numpy as np
from figures_out import measure_and_write
from seeds import CHOSEN_MOTIONS

from slide_fmu.apps.motion import MoveTask, coordinates_of, read_task
from slide_fmu.apps.motion.solve import solve
from slide_fmu.core.figures import plain
from slide_fmu.core.progress import Stages
from slide_fmu.fmu.export import load
from slide_fmu.surrogate.surrogate import Surrogate

ROOT = Path(__file__).parents[2]
FMU = ROOT / "fmus" / "robot_6r" / "robot_6r.fmu"
TASK = ROOT / "docs" / "tutorials" / "pick_and_place.toml"
REACH = 0.6
OPTIMISED = "optimised"


def random_task(surrogate: Surrogate, rng: np.random.Generator) -> MoveTask:
    """Draw start and goal of a task; the rest is that of the tutorial."""
    joints = coordinates_of(surrogate.inputs)
    low, high = (REACH * np.array([getattr(j, end) for j in joints]) for end in ("low", "high"))
    start, goal = rng.uniform(low, high, (2, len(joints)))
    task = read_task(TASK)
    assert isinstance(task, MoveTask)
    return task.model_copy(update={"start": tuple(start.tolist()), "goal": tuple(goal.tolist())})


def judged(task: MoveTask) -> dict[str, Any]:
    """Solve a task, and judge all its moves by the reference model."""
    begin = time.process_time()
    solve(FMU, task)
    seconds = time.process_time() - begin
    solved = solve(FMU, task, verify=True)
    figures = plain(solved.figures())
    true, moves = figures["reference"], {}
    for name, rows in (("predicted", figures), ("true", true)):
        moves[name] = {row["name"]: row for row in (rows["move"], *rows["baselines"])}
    unshaped = moves["true"]["not shaped"]["settled_s"]
    best = min(
        (row["settled_s"] or np.inf for name, row in moves["true"].items() if "Z" in name),
        default=np.inf,
    )
    settled = true["move"]["settled_s"] or np.inf
    return {
        "move": true["move"]["name"],
        "settled_s": settled,
        "trapezoid_s": unshaped,
        "best_shaper_s": best,
        "earlier_than_trapezoid": 1 - settled / unshaped,
        "earlier_than_best_shaper": 1 - settled / best,
        "residual": true["move"]["residual"],
        "predicted": figures["move"]["residual"],
        "with_margin": figures["move"]["residual_with_margin"],
        "cpu_s": seconds,
    }


def measure(chosen: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Judge all moves, and say what they have in common."""
    surrogate, rng = load(FMU), np.random.default_rng(chosen.seed)
    rows, progress = [], bar("moves")
    for done in range(chosen.moves):
        progress(done, chosen.moves)
        rows.append(judged(random_task(surrogate, rng)))
    progress(chosen.moves, chosen.moves)
    names = "earlier_than_trapezoid", "earlier_than_best_shaper", "residual", "cpu_s"
    return {
        "seed": chosen.seed,
        **{name: _quantiles([row[name] for row in rows]) for name in names},
        "within_margin": sum(row["residual"] <= row["with_margin"] for row in rows),
        "optimised": sum(row["move"] == OPTIMISED for row in rows),
        "moves": rows,
    }


def _quantiles(values: list[float]) -> dict[str, float]:
    return {"least": min(values), "median": float(np.median(values)), "most": max(values)}


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--moves", type=int, default=20)
    parser.add_argument("--seed", type=int, default=CHOSEN_MOTIONS)
    measure_and_write(parser, measure)
