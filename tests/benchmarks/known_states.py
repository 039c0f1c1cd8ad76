"""A network of a function, fitted from states that it shows, and by the search without them.

    slide-fmu init tests/benchmarks/unprepared/drive.py
    python tests/benchmarks/known_states.py drive.toml --json -

Both learn from the same trajectories, which lie in the run folder; the fit without states may take
many times as long, and ``--known`` leaves it out. Validation errors are RMS from zero state over
the outputs' standard deviation. The first one leaves out motions with more than one response to
the same inputs, and says how many: ``without`` has them too.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

from figures_out import measure_and_write

from slide_fmu.core.progress import Stages, quiet
from slide_fmu.data.workplace import Workplace
from slide_fmu.fitting.preparation import Work, prepare, scales_of
from slide_fmu.fitting.problem import Problem
from slide_fmu.fitting.state_space.fit import fit_state_space
from slide_fmu.pipeline.job import checked, open_job
from slide_fmu.pipeline.stages import choose_numbers, generate_data
from slide_fmu.recipe.learning import LeastSquaresRecipe, StateSpaceRecipe


def measure(arguments: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Fit with the states, and without them."""
    place = Workplace()
    job = checked(open_job(arguments.recipe, arguments.runs, bar))
    job = choose_numbers(job, place)
    generate_data(job, place)
    with tempfile.TemporaryDirectory() as name:
        work = Work(job.case, job.folder.trajectories, Path(name), bar)
        splits = work.splits("train", "validation")
        prepared = prepare(work, scales_of(work, splits), splits)
        assert isinstance(prepared.table, StateSpaceRecipe)
        assert isinstance(work.recipe.training, LeastSquaresRecipe)
        tables = prepared.table, work.recipe.training
        fits = {"known": prepared.problem(splits, Path(name) / "known.pt")}
        if not arguments.known:
            other = Path(name) / "without.pt"
            fits["without"] = replace(fits["known"], states=None, checkpoint=other)
        results = {key: fitted(problem, *tables) for key, problem in fits.items()}
    return {
        "recipe": work.recipe.name,
        "trajectories": len(splits[0].inputs),
        "window_samples": work.recipe.window.n_in,
        **results,
    }


def fitted(
    problem: Problem, network: StateSpaceRecipe, training: LeastSquaresRecipe
) -> dict[str, Any]:
    """Fit a network, and say how well and how long."""
    begin = time.process_time()
    found = fit_state_space(problem, network, training, quiet)
    assert isinstance(found.table, StateSpaceRecipe)
    return {
        "validation_error": min(found.history.validation_error),
        "states": found.table.order,
        "hidden_units": found.table.hidden,
        "cpu_s": time.process_time() - begin,
        "explanations": list(found.history.explanations),
        "remark": found.history.remark,
    }


def main() -> None:
    """Read the command line, measure, and write the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recipe", type=Path, help="recipe of a function, as init writes it")
    parser.add_argument("--runs", type=Path, default=Path("runs"), help="folder of run folders")
    parser.add_argument("--known", action="store_true", help="leave out the fit without states")
    measure_and_write(parser, measure)


if __name__ == "__main__":
    main()
