"""What an FMU saves: its step beside that of the models it stands for, all in one run.

    python tests/benchmarks/speed_up.py fmus/robot_6r/robot_6r.fmu --json -

Every round simulates one input window of a test motion with the recipe's model, with its reference
model and with the settings of the paper's authors (the robot in their formulation, which needs the
extra ``mesh``; the slider-crank with 20 elements and 20 substeps, the nearest that our model has;
null for others), and runs the FMU. Given is the median over the rounds of the time per output
sample, in microseconds: CPU time of models, doStep alone of the FMU, the same step inside C.

The paper's speed-up of a model is S = t_sim / t_NN * n_out / n_in, t_sim the time of n_in samples
of the model, t_NN that of a forward pass, which gives n_out outputs. For the FMU, t_NN is n_out
steps (``fmu_step``: doStep called through ctypes; ``runtime_step``: inside C); for
``window_in_numpy`` one whole window. ``runtime_step_and_read``: inside C, error estimates
and bounds read after every step.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from figures_out import write_figures
from seeds import SPEED_UP
from timing import Part, TimedSurrogate, part_times

from mbs_models.slider_crank.slider_crank import SliderCrank
from slide_fmu.cosim.whole_run import run_fmu
from slide_fmu.data.draws import TEST, Draw, Stream, draw
from slide_fmu.fmu.export import read_fmu
from slide_fmu.importer.file import unpacked
from slide_fmu.pipeline.run_folder import recipe_of_provenance
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import System
from slide_fmu.systems.simulation import simulate

Timer = Callable[[Draw], float]
"""Gives the time per sample in s on a motion."""
AUTHORS_ELEMENTS, AUTHORS_SUBSTEPS = 20, 20
AUTHORS: dict[str, dict[str, Any]] = {
    "SliderCrank": {"elements": AUTHORS_ELEMENTS, "substeps": AUTHORS_SUBSTEPS},
    "Robot6R": {"formulation": "redundant coordinates", "substeps": AUTHORS_SUBSTEPS},
}
"""Settings of the paper's authors by the name of our model."""
LOOP, WINDOWS = 200, 20
"""Steps in one loop inside C; windows in numpy in each round."""
FORWARD = ("fmu_step", "runtime_step", "runtime_step_and_read", "window_in_numpy")


def measure(arguments: argparse.Namespace) -> dict[str, Any]:
    """Medians over the rounds, everything taking turns."""
    surrogate, found = read_fmu(arguments.fmu)
    recipe = recipe_of_provenance(found, str(arguments.fmu))
    window = surrogate.window
    models = timers(recipe)
    stream = Stream(TEST, arguments.seed, (1.0, 1.0), window.n_in * window.step)
    drawing = case_of(recipe).system
    values = np.random.default_rng(0).uniform(-1, 1, (arguments.steps, 1))
    scaling = surrogate.input_scaling
    rows = scaling.offset + values * scaling.scale
    inputs = {signal.name: rows[:, i] for i, signal in enumerate(surrogate.inputs)}
    outputs = [signal.name for signal in surrogate.outputs]
    times: dict[str, list[float]] = {}
    inside = TimedSurrogate(surrogate)
    with unpacked(arguments.fmu) as fmu:
        for index in range(arguments.rounds):
            drawn = draw(recipe, drawing, stream, index)
            for name, timer in models.items():
                times.setdefault(name, []).append(timer(drawn))
            run = run_fmu(fmu, inputs, outputs, step=window.step, timed=True)
            times.setdefault("fmu_step", []).extend(run.step_seconds)
            times.setdefault("runtime_step", []).extend(
                part_times(inside, Part.STEP, WINDOWS, LOOP)
            )
            if surrogate.estimates_errors:
                read = part_times(inside, Part.STEP_AND_READ, WINDOWS, LOOP)
                times.setdefault("runtime_step_and_read", []).extend(read)
            windows = window_times(surrogate, drawn)
            times.setdefault("window_in_numpy", []).extend(windows)
    medians = {name: 1e6 * float(np.median(found)) for name, found in times.items()}
    window_us = medians["window_in_numpy"]
    medians["window_in_numpy"] /= window.n_out
    return {
        "recipe": recipe.name,
        "rounds": arguments.rounds,
        "n_in": window.n_in,
        "n_out": window.n_out,
        "step_s": window.step,
        "models": {
            "model": dict(recipe.system.parameters),
            "reference": dict(recipe.system.reference) or None,
            "authors_settings": AUTHORS.get(_model(recipe)),
        },
        "per_output_sample_us": {"reference": None, "authors_settings": None, **medians},
        "one_window": {
            **{f"{name}_ms": 1e-3 * window.n_in * medians[name] for name in models},
            "forward_pass_in_numpy_us": window_us,
            "fmu_n_out_steps_us": window.n_out * medians["fmu_step"],
        },
        "speed_up": {
            name: {
                forward: medians[name] / medians[forward]
                for forward in FORWARD
                if forward in medians
            }
            for name in models
        },
    }


def timers(recipe: Recipe) -> dict[str, Timer]:
    """What is timed beside the FMU, by name."""
    found = {"model": simulation_timer(case_of(recipe).system)}
    if recipe.system.reference:
        found["reference"] = simulation_timer(case_of(recipe).reference)
    if _model(recipe) == "SliderCrank":
        parameters: dict[str, Any] = {
            **case_of(recipe).systems.specification.parameters,
            "step": recipe.window.step,
            **AUTHORS["SliderCrank"],
        }
        found["authors_settings"] = simulation_timer(SliderCrank(**parameters))
    if _model(recipe) == "Robot6R":
        found["authors_settings"] = redundant_robot_timer(recipe.window.step)
    return found


def _model(recipe: Recipe) -> str:
    return recipe.system.model.rpartition(":")[2]


def simulation_timer(system: System) -> Timer:
    """CPU time per sample of a system on the motion's end, from rest."""

    def seconds(drawn: Draw) -> float:
        inputs = drawn.inputs[drawn.burn_in :]
        rest = system.rest_state(inputs[0])
        simulate(system, inputs[:1], rest)  # builds the model
        begin = time.process_time()
        simulate(system, inputs, rest)
        return (time.process_time() - begin) / len(inputs)

    return seconds


def redundant_robot_timer(step: float) -> Timer:
    """The same for the robot as its authors modelled it."""
    from redundant_robot import AUTHORS_MESH, RedundantRobot

    def seconds(drawn: Draw) -> float:
        inputs = drawn.inputs[drawn.burn_in :]
        robot = RedundantRobot(AUTHORS_MESH, inputs, step)
        robot.run(AUTHORS_SUBSTEPS)
        return robot.seconds / (len(inputs) - 1)

    return seconds


def window_times(surrogate: Surrogate, drawn: Draw) -> list[float]:
    """Seconds of single forward passes over a whole window, in numpy."""
    window, times = drawn.inputs[None, -surrogate.window.n_in :], []
    for _ in range(WINDOWS):
        begin = time.perf_counter()
        surrogate.predict_windows(window)
        times.append(time.perf_counter() - begin)
    return times


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("fmu", type=Path)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--steps", type=int, default=2000, help="of the FMU in each round")
    parser.add_argument("--seed", type=int, default=SPEED_UP, help="of the motions")
    parser.add_argument("--json", default="-")
    arguments = parser.parse_args()
    write_figures(measure(arguments), arguments.json)


if __name__ == "__main__":
    main()
