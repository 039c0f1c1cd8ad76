"""A machine that is cut in two: its halves as FMUs, its partners, and the whole as truth."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from slide_fmu.apps.couple.result import CoupledRun
from slide_fmu.apps.reference.reference_slave import write_reference_fmu
from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.base import Stepping, go_on
from slide_fmu.systems.loading import load_system
from slide_fmu.systems.specification import Specification
from tests.couple_here import couple_here

Partner = Mapping[str, float]
"""Parameters of the partner, by name."""


@dataclass(frozen=True)
class CutMachine:
    """A CutMachine has a half and a partner that takes its force; surrogates may replace them.

    Attributes:
        half: class of the half, whose parameters ``step`` and ``substeps`` are its steps; or its
            equations in a file, as those of the partner.
        partner: model of the partner; its outputs ``work`` and ``exchanged``, in J, are the work
            on the half and the energy that passed the cut, where it has them.
        partners: their parameters, by the words that name them.
        links: connections of the components ``half`` and ``partner``.
        force, motion: the output of the half, and the inputs of the half that move.
        command: the partner's input that moves it.
        step: communication step in s.
        integration: longest integration step of the half in s; None of equations.
        free: parameters of a partner that is let go and must come to rest, its output that shows
            it, and the largest value at the start.
        drive: gives the command over time of a partner, from a seed and an end time in s.
        whole: gives the true responses at the communication points of a step in s, from the
            partner and the command.
        place: gives the way on which the force does work, from the inputs of the half, (N, n).
        let_go: command of the partner that is let go.
    """

    half: str
    partner: str
    partners: Mapping[str, Partner]
    links: Sequence[tuple[str, str]]
    force: str
    motion: Sequence[str]
    command: str
    step: float
    integration: float | None
    free: tuple[Partner, str, float]
    drive: Callable[[Partner, int, float], Callable[[FloatArray], FloatArray]]
    whole: Callable[[Partner, Callable[[FloatArray], FloatArray], float, float], Any]
    place: Callable[[FloatArray], FloatArray]
    let_go: Callable[[float], float] | float = 0.0

    def half_system(self, step: float) -> Stepping:
        """Make the exact half with a step in s."""
        system = load_system(self._half(step))
        assert isinstance(system, Stepping)
        return system

    def _half(self, step: float) -> Specification:
        if self.integration is None:
            return Specification(self.half, {}, step, "function")
        substeps = max(1, math.ceil(step / self.integration - 1e-9))
        return Specification(self.half, {"step": step, "substeps": substeps})

    def write_half(self, folder: Path, step: float) -> Path:
        """Write the exact half as an FMU that takes steps of this length in s."""
        return write_reference_fmu(self._half(step), folder / f"half_{step:.9g}.fmu")

    def write_partner(self, folder: Path, step: float, partner: Partner) -> Path:
        """Write a partner as an FMU that takes steps of this length in s."""
        values = "_".join(f"{value:g}" for value in partner.values())
        path = folder / f"partner_{step:.9g}_{values}.fmu"
        made = Specification(self.partner, dict(partner), step, "function")
        return write_reference_fmu(made, path)

    def run(
        self,
        folder: Path,
        surrogates: Mapping[str, Path],
        partner: Partner,
        command: Any,
        step: float,
        stop: float,
        **how: Any,
    ) -> CoupledRun:
        """Run ``partner`` and ``half`` together; those without a surrogate are exact."""
        exact = {
            "partner": lambda: self.write_partner(folder, step, partner),
            "half": lambda: self.write_half(folder, step),
        }
        return couple_here(
            {name: surrogates.get(name) or write() for name, write in exact.items()},
            self.links,
            step=step,
            stop=stop,
            inputs={f"partner.{self.command}": command},
            **how,
        )

    def work(self, run: CoupledRun, step: float) -> float:
        """Return the work in J that the motion of a run does on the exact half.

        Force and way are smooth between the communication points, as splines are.
        """
        inputs = np.stack([run[f"half.{name}"] for name in self.motion], axis=1)
        system = self.half_system(step)
        system.begin(inputs[0])
        force = go_on(system, inputs[1:])[:, 0]
        speed = CubicSpline(run.time, self.place(inputs)).derivative()(run.time)
        return float(CubicSpline(run.time, force * speed).integrate(0.0, run.time[-1]))


def smooth_command(
    seed: int, middle: float, size: float, frequencies: tuple[float, float]
) -> Callable[[FloatArray], FloatArray]:
    """Return a sum of eight sines between frequencies in rad/s, which fades in within 2 s."""
    rng = np.random.default_rng(seed)
    rates = np.exp(rng.uniform(*np.log(frequencies), 8))
    phases, parts = rng.uniform(0, 2 * np.pi, 8), rng.uniform(0.5, 1.0, 8)
    parts = parts * size / parts.sum()

    def command(time: FloatArray) -> FloatArray:
        time = np.asarray(time, dtype=np.float64)
        waves = np.sin(np.multiply.outer(time, rates) + phases) @ parts
        fade = np.clip(time / 2.0, 0.0, 1.0)
        return np.asarray(fade**2 * (3 - 2 * fade) * (middle + waves))

    return command


def relative_error(found: FloatArray, true: FloatArray) -> float:
    """Return the RMS error, relative to the RMS about the mean of the truth."""
    return float(np.sqrt(np.mean((found - true) ** 2) / np.mean((true - true.mean()) ** 2)))
