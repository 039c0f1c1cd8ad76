"""Window sizing for a recipe: decay along its own motions, linearized and measured."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from slide_fmu.data.sampling import Stream, draw, split_stream
from slide_fmu.decay import Decay, decay_along, measured_decay, recommend_window, too_short
from slide_fmu.modes import Spectrum, spectrum
from slide_fmu.recipe import Recipe
from slide_fmu.signals import FloatArray
from slide_fmu.systems.base import State, System
from slide_fmu.window import Window

MOTIONS = 40
"""Motions along which is linearized, and pairs of motions whose meeting is measured."""
POINTS_PER_MOTION = 10
"""States along each motion, an input window apart at most."""
MEASURED_DECAYS = 3.0
"""Length of the measured motions, in decay times."""
MEASURED_SAMPLES, LEAST_MEASURED = 40_000, 4
"""Samples after which no more motions are measured, but at least so many motions: where the decay
takes long, a few pairs tell what the window needs."""


class ShortWindowError(ValueError):
    """The recipe's window is too short for its system."""


@dataclass(frozen=True, eq=False)
class Sizing:
    """What the window of a recipe must hold, and what it holds.

    Attributes:
        window: the recipe's window.
        remaining_amplitude: fraction to which initial effects shall decay.
        modes: of the system at rest.
        linearized: decay times at many states along the recipe's motions.
        measured: decay times of the difference of two motions under the same input.
    """

    window: Window
    remaining_amplitude: float
    modes: Spectrum
    linearized: Decay
    measured: Decay

    @property
    def problem(self) -> str | None:
        """Why the window is too short; None if it is long enough."""
        if not math.isfinite(self.measured.mean):
            rigid = len(self.modes.rigid)
            return (
                f"motions from different initial states never meet in the outputs ({rigid} "
                "eigenvalues of rigid-body modes at rest): no window can hold them; fix the free "
                "direction, give the system damping, or choose outputs that it does not move"
            )
        return too_short(self.window, self.linearized.worst)

    def figures(self) -> dict[str, Any]:
        """The figures as plain values, as written to JSON."""
        recommended = recommend_window(self.linearized.worst, self.window.step, self.window.n_out)
        return {
            "remaining_amplitude": self.remaining_amplitude,
            "decay_time_s": _times(self.linearized),
            "measured_decay_time_s": _times(self.measured),
            "modes_at_rest": [
                {
                    "frequency_rad_s": mode.natural_frequency,
                    "damping_ratio": mode.damping_ratio,
                    "decay_time_s": _finite(mode.decay_time),
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
        }


def size_window(recipe: Recipe, system: System, seed: int | None = None) -> Sizing:
    """Compute and measure the decay times of a recipe's system along its motions.

    Args:
        seed: of the motions; the recipe's data seed if None.

    Raises:
        UnstableModeError: a mode of the linearized system grows.
        SimulationError: a motion could not be simulated.
        ValueError: the system has no damping, so that its motions never meet.
    """
    amplitude = recipe.window.remaining_amplitude
    window = Window(recipe.window.step, recipe.window.n_in, recipe.window.n_out)
    training = split_stream(recipe, "train", 0)
    entropy = recipe.data.seed if seed is None else seed
    duration = min(training.duration, POINTS_PER_MOTION * window.n_in * window.step)
    stream = Stream(training.number, entropy, (1.0, 1.0), duration)
    draws = [draw(recipe, system, stream, index) for index in range(MOTIONS)]
    states = [state for d in draws for state in _states_along(system, d.initial, d.inputs)]
    linearized = decay_along(system, states, amplitude)
    recommend_window(linearized.worst, window.step, window.n_out)  # refuses a lasting motion
    count = max(window.n_in, int(np.ceil(MEASURED_DECAYS * linearized.worst / window.step)))
    measured_draws = draws[: max(LEAST_MEASURED, MEASURED_SAMPLES // count)]
    records = [np.resize(d.inputs, (count, d.inputs.shape[1])) for d in measured_draws]
    rng = np.random.default_rng(np.random.SeedSequence(entropy, spawn_key=(stream.number,)))
    measured = measured_decay(system, records, rng, amplitude)
    rest = system.rest_state(np.array([signal.start_value for signal in system.inputs]))
    modes = spectrum(system.linearize(rest), amplitude)
    return Sizing(window, amplitude, modes, linearized, measured)


def require_window(recipe: Recipe, sizing: Sizing) -> None:
    """Refuse a recipe whose window is too short, unless it says ``allow_short``.

    Raises:
        ShortWindowError: with the numbers and the remedy.
    """
    if sizing.problem is not None and not recipe.window.allow_short:
        raise ShortWindowError(
            f"recipe {recipe.name!r}: {sizing.problem}; or set window.allow_short = true"
        )


def _states_along(system: System, initial: State, inputs: FloatArray) -> list[State]:
    """States at evenly spread samples of a motion."""
    stride = max(1, len(inputs) // POINTS_PER_MOTION)
    system.set_state(initial)
    states = []
    for k, row in enumerate(inputs[: stride * POINTS_PER_MOTION]):
        system.advance(row)
        if (k + 1) % stride == 0:
            states.append(system.get_state())
    return states


def seconds(value: float | None) -> str:
    """A decay time as people read it."""
    return "without end" if value is None else f"{value:.4g} s"


def _times(decay: Decay) -> dict[str, float | None]:
    return {"mean": _finite(decay.mean), "worst": _finite(decay.worst)}


def _finite(value: float) -> float | None:
    """A number for JSON, which knows no infinity: a motion that never decays has no time."""
    return value if math.isfinite(value) else None
