"""The window of a recipe is sized by the decay along its own motions, linearized and measured.

The eigenvalues of the linearized equations decide. Where the measured decay asks for more, this is
a remark.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import Window
from slide_fmu.data.draws import Draw, Stream, draw, split_stream
from slide_fmu.memory.decay import (
    Decay,
    decay_along,
    decay_in_stretches,
    measured_decay,
    recommend_window,
    too_short,
)
from slide_fmu.memory.modes import Spectrum, UnstableModeError, spectrum
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.systems.base import Linearizable, State, System

MOTIONS = 40
"""At most this many pairs of motions are measured."""
LINEARIZED_MOTIONS = 20
"""The equations are linearized along at most this many motions."""
WINDOWS_PER_MOTION = 10
"""These motions are at most this many input windows long."""
POINTS_PER_WINDOW = 8
"""The equations are linearized at this many states in each of these windows."""
MEASURED_DECAYS = 3.0
"""The measured motions are at least this many linearized decay times long."""
MEASURED_SAMPLES, LEAST_MEASURED = 20_000, 4
"""No more motions are measured after this many samples, but at least this many motions: where the
decay takes long, a few pairs show what the window needs."""


class ShortWindowError(ValueError):
    """The recipe's window is too short for its system."""


@dataclass(frozen=True, eq=False)
class Sizing:
    """A sizing says what the window of a recipe must hold, and what it holds.

    Attributes:
        window: the recipe's window.
        remaining_amplitude: fraction A_rel to which initial effects shall decay.
        modes: modes of the system linearized at rest.
        linearized: decay along stretches of the recipe's motions, each as long as the input
            window, or as the mean decay time if that is longer.
        local_worst: the longest decay time in s at a single instant; infinite where a mode grows
            for a moment.
        measured: decay of the difference of two motions under the same input, one rate for each
            pair.
    """

    window: Window
    remaining_amplitude: float
    modes: Spectrum
    linearized: Decay
    local_worst: float
    measured: Decay

    @property
    def problem(self) -> str | None:
        """The text says why the window is too short; None if it is long enough."""
        if not math.isfinite(self.measured.mean):
            rigid = len(self.modes.rigid)
            return (
                f"motions from different initial states never meet in the outputs ({rigid} "
                "eigenvalues of rigid-body modes at rest): no window can hold them; fix the free "
                "direction, give the system damping, or choose outputs that it does not move"
            )
        return too_short(self.window, self.linearized.worst)

    @property
    def remark(self) -> str | None:
        """The text says that the measured decay asks for more than the eigenvalues; or None."""
        window, worst = self.window, self.measured.worst
        if self.problem is not None or worst <= window.truncation_time:
            return None
        motions = f"the slowest of {len(self.measured.rates)} measured pairs of motions"
        linearized = f"though the eigenvalues ask for {self.linearized.worst:.4g} s alone"
        truncated = f"the window truncates {window.truncation_time:.4g} s"
        if not math.isfinite(worst):
            return (
                f"{motions} never met in a record of several decay times; {truncated}, "
                f"{linearized}. Raise window.n_in, excite less (data.excitation), or give the "
                "system more damping"
            )
        needed = recommend_window(worst, window.step, window.n_out).n_in
        return (
            f"{motions} takes {worst:.4g} s to meet, but {truncated}, {linearized}. Raise "
            f"window.n_in from {window.n_in} to {needed} to hold that one too"
        )

    def figures(self) -> dict[str, Any]:
        """Return the figures as plain values with SI units in their names, as written to JSON."""
        recommended = recommend_window(self.linearized.worst, self.window.step, self.window.n_out)
        return {
            "remaining_amplitude": self.remaining_amplitude,
            "decay_time_s": {
                **_times(self.linearized),
                "local_worst": finite(self.local_worst),
            },
            "measured_decay_time_s": _times(self.measured),
            "modes_at_rest": [
                {
                    "frequency_rad_s": mode.natural_frequency,
                    "damping_ratio": mode.damping_ratio,
                    "decay_time_s": finite(mode.decay_time),
                }
                for mode in self.modes.modes
            ],
            "rigid_body_eigenvalues": len(self.modes.rigid),
            "window": {
                "step_s": self.window.step,
                "n_in": self.window.n_in,
                "n_out": self.window.n_out,
                "truncation_time_s": self.window.truncation_time,
            },
            "recommended_n_in": recommended.n_in,
            "sufficient": self.problem is None,
            "remark": self.remark,
        }


def size_window(recipe: Recipe, system: System, seed: int | None = None) -> Sizing:
    """Compute and measure the decay times of a recipe's system along its motions.

    The seed of the motions is the recipe's data seed if None.

    Raises:
        UnstableModeError: a mode of the system linearized at rest grows, or the slowest mode grows
            in the mean along a motion.
        SimulationError: a motion could not be simulated.
        ValueError: the system has no damping, so that initial effects never decay.
    """
    assert isinstance(system, Linearizable)
    amplitude = recipe.window.remaining_amplitude
    window = Window(recipe.window.step, recipe.window.n_in, recipe.window.n_out)
    rest = system.rest_state(np.array([signal.start_value for signal in system.inputs]))
    modes = spectrum(system.linearize(rest), amplitude)
    training = split_stream(recipe, "train", 0)
    entropy = recipe.data.seed if seed is None else seed
    duration = min(training.duration, WINDOWS_PER_MOTION * window.n_in * window.step)
    stream = Stream(training.number, entropy, (1.0, 1.0), duration)
    followed = range(min(MOTIONS, LINEARIZED_MOTIONS))
    draws = [draw(recipe, system, stream, index) for index in followed]
    stride = -(-window.n_in // POINTS_PER_WINDOW)  # rounded up
    along = _decay_along_motions(system, draws, stride, amplitude)
    linearized = _decay_over_windows(along, window, stride)
    recommend_window(linearized.worst, window.step, window.n_out)  # raises for an infinite time
    count = max(window.n_in, int(np.ceil(MEASURED_DECAYS * linearized.worst / window.step)))
    whole = replace(stream, duration=max(duration, count * window.step))
    pairs = min(MOTIONS, max(LEAST_MEASURED, MEASURED_SAMPLES // count))
    records = [draw(recipe, system, whole, index).inputs[:count] for index in range(pairs)]
    rng = np.random.default_rng(np.random.SeedSequence(entropy, spawn_key=(stream.number,)))
    measured = measured_decay(system, records, rng, amplitude)
    local_worst = max(decay.worst for decay in along)
    return Sizing(window, amplitude, modes, linearized, local_worst, measured)


def require_window(recipe: Recipe, sizing: Sizing) -> None:
    """Refuse a recipe whose window is too short, unless it says ``allow_short``.

    Raises:
        ShortWindowError: the window is too short; the message gives the numbers and the remedy.
    """
    if sizing.problem is not None and not recipe.window.allow_short:
        raise ShortWindowError(
            f"recipe {recipe.name!r}: {sizing.problem}; or set window.allow_short = true"
        )


def _decay_along_motions(
    system: Linearizable, draws: list[Draw], stride: int, remaining_amplitude: float
) -> list[Decay]:
    """Compute the decay along each of the motions, at every ``stride``-th sample."""
    along = []
    for index, drawn in enumerate(draws):
        states = _states_along(system, drawn.initial, drawn.inputs, stride)
        try:
            along.append(decay_along(system, states, remaining_amplitude))
        except UnstableModeError as error:
            raise UnstableModeError(f"motion {index} of {len(draws)}: {error}") from error
    return along


def _decay_over_windows(along: list[Decay], window: Window, stride: int) -> Decay:
    """Return the decay over stretches of the motions, one mean rate for each.

    A stretch is as long as the input window, as in the paper, but not shorter than the decay
    takes in the mean: rates at single instants say little where the decay takes many windows.
    """
    decay_time = Decay(
        np.concatenate([decay.rates for decay in along]), along[0].remaining_amplitude
    ).mean
    recommend_window(decay_time, window.step, window.n_out)  # raises for an infinite time
    samples = max(window.n_in, decay_time / window.step)
    return decay_in_stretches(along, math.ceil(samples / stride))


def _states_along(
    system: Linearizable, initial: State | None, inputs: FloatArray, stride: int
) -> list[State]:
    """Simulate a motion and return its states at every ``stride``-th sample."""
    system.begin(inputs[0]) if initial is None else system.set_state(initial)
    states = []
    for k, row in enumerate(inputs):
        system.advance(row)
        if (k + 1) % stride == 0:
            states.append(system.get_state())
    return states


def decay_rows(figures: dict[str, Any]) -> list[tuple[str, str, str, str]]:
    """Return the decay times of ``Sizing.figures`` as rows of a table, the headings first.

    Measured times are those of whole motions, so their last column is empty.
    """
    linearized, measured = figures["decay_time_s"], figures["measured_decay_time_s"]
    local = seconds(linearized["local_worst"])
    return [
        ("decay time", "mean", "worst", "at the worst instant"),
        ("linearized", seconds(linearized["mean"]), seconds(linearized["worst"]), local),
        ("measured", seconds(measured["mean"]), seconds(measured["worst"]), ""),
    ]


def seconds(value: float | None) -> str:
    """Write a decay time in s as people read it; None stands for a motion that never decays."""
    return "without end" if value is None else f"{value:.4g} s"


def _times(decay: Decay) -> dict[str, float | None]:
    return {"mean": finite(decay.mean), "worst": finite(decay.worst)}


def finite(value: float) -> float | None:
    """Return a number for JSON, which knows no infinity: None stands for it."""
    return value if math.isfinite(value) else None
