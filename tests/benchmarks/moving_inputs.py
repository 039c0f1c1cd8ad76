"""How honest an FMU's time is where inputs move: a quarter car over roads that no training saw.

    python tests/benchmarks/moving_inputs.py --json -

The surrogate is trained first (some minutes; ``--surrogate FILE`` keeps it, or takes it from
there). Errors are relative: RMSE over the standard deviation of the reference, in %, of body
acceleration, suspension travel and tyre deflection, after the window is filled.

``known``: every input is known to the step's end (``inputs_at_step_end`` = 1, fed one step early),
which is the surrogate's own error, as on a card. ``simulate``: ``slide_fmu.simulate`` on times as
far apart as the factor says, in sample steps. ``plain``: ``fmpy.simulate_fmu`` with a table of
u(t), at the FMU's own step. ``held``: the same with an FMU that holds the value that was set.
``late``: the same with an FMU that takes it as reached by the step's end.
"""

from __future__ import annotations

import argparse
import dataclasses
import tempfile
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
from figures_out import measure_and_write
from quarter_car import OUTPUTS, ROAD, STEP, SUBSTEPS, Effort, rough_road, simulate, train

import slide_fmu as slide
from slide_fmu.core.progress import Stages
from slide_fmu.core.signals import FloatArray
from slide_fmu.surrogate.input_forecast import InputForecast
from slide_fmu.surrogate.surrogate import Surrogate

FACTORS = (0.5, 1.0, 1.3, 2.0)
DURATION, SETTLED = 30.0, 5.0
"""In s; the first part is not scored."""

FINE = 20
"""Parts of a sample step in which the reference is found."""


def two_sines(time: FloatArray) -> FloatArray:
    """A road of 1.1 and 3.7 Hz, in m."""
    return np.asarray(
        0.03 * np.sin(2 * np.pi * 1.1 * time) + 0.006 * np.sin(2 * np.pi * 3.7 * time)
    )


def roads_of(step: float) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Times and heights of the unseen roads at samples a step (s) apart."""
    time = step * np.arange(round(DURATION / step) + 1)
    rough = rough_road(np.random.default_rng(20260001), len(time), 0.015, 5.0, step)
    return {"two_sines": (time, two_sines(time)), "rough": (time, rough)}


def relative(found: FloatArray, true: FloatArray, time: FloatArray) -> list[float]:
    """Errors in % of the outputs, (N, n_outputs), after the window is filled."""
    scored = time >= SETTLED
    error = np.sqrt(np.mean((found[scored] - true[scored]) ** 2, axis=0))
    return [float(value) for value in 100 * error / true[scored].std(axis=0)]


def truth(time: FloatArray, heights: FloatArray) -> FloatArray:
    """Outputs of the reference at the times, of a road that is straight between them."""
    step = time[1] - time[0]
    return simulate(heights[None], step, max(SUBSTEPS, round(SUBSTEPS * step / STEP)))[0]


def smooth_truth(time: FloatArray) -> FloatArray:
    """Outputs of the reference at the times, of the two sines themselves."""
    step = time[1] - time[0]
    fine = step / FINE * np.arange((len(time) - 1) * FINE + 1)
    return np.asarray(simulate(two_sines(fine)[None], step / FINE, 2)[0][::FINE])


def plain_run(fmu: Path, time: FloatArray, heights: FloatArray, **others: Any) -> FloatArray:
    """Outputs by ``fmpy.simulate_fmu`` with a table of inputs, shape (N, n_outputs)."""
    table = np.zeros(len(time), dtype=[("time", float), (ROAD[0].name, float)])
    table["time"], table[ROAD[0].name] = time, heights
    names = [signal.name for signal in OUTPUTS]
    result = fmpy.simulate_fmu(
        str(fmu), stop_time=time[-1], output_interval=STEP, input=table, output=names, **others
    )
    return np.stack([result[name] for name in names], axis=1)


def figures_of(surrogate: Surrogate, folder: Path) -> dict[str, Any]:
    """All errors of one surrogate, by the road and the way to run it."""
    held = dataclasses.replace(surrogate, name="held", forecast=InputForecast())
    paths = {s.name: slide.export_fmu(s, folder / f"{s.name}.fmu") for s in (surrogate, held)}
    own = paths[surrogate.name]
    figures: dict[str, Any] = {name: {} for name in roads_of(STEP)}
    for name, (time, heights) in roads_of(STEP).items():
        true = truth(time, heights)
        runs = {
            "known": np.vstack([true[:1], surrogate.predict_newest(heights[1:, None])]),
            "plain": plain_run(own, time, heights),
            "held": plain_run(paths["held"], time, heights),
            "late": plain_run(own, time, heights, start_values={"inputs_at_step_end": 1}),
        }
        figures[name] = {way: relative(found, true, time) for way, found in runs.items()}
    for factor in FACTORS:
        for name, (time, heights) in roads_of(factor * STEP).items():
            true = smooth_truth(time) if name == "two_sines" else truth(time, heights)
            found = slide.simulate(own, time, heights)
            figures[name][f"simulate_{factor:g}"] = relative(found, true, time)
    return {"outputs": [signal.name for signal in OUTPUTS], "relative_rmse_percent": figures}


def measure(arguments: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Train where there is no surrogate yet, then run it."""
    place = None if arguments.surrogate is None else Path(arguments.surrogate)
    if place is not None and place.is_file():
        surrogate = slide.Surrogate.from_bytes(place.read_bytes())
    else:
        surrogate = train(Effort(), 1, bar("training"))
        if place is not None:
            surrogate.save(place)
    with tempfile.TemporaryDirectory() as folder:
        return figures_of(surrogate, Path(folder))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--surrogate", help="file that keeps the trained surrogate")
    measure_and_write(parser, measure)


if __name__ == "__main__":
    main()
