"""A machine that is cut in two: its halves as FMUs, its partners, and the whole as truth."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from slide_fmu.apps.couple.couple import couple
from slide_fmu.apps.couple.result import Coupled
from slide_fmu.apps.reference.reference_slave import write_reference_fmu
from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.base import Stepping
from slide_fmu.systems.loading import load_system
from slide_fmu.systems.specification import Specification

NODES = 4
"""The exact half takes this number of steps in a communication step, for the mean of its force."""
REPLAYED = 16
"""Steps of the exact half in a communication step, where its work is integrated."""

Partner = Mapping[str, float]
"""Parameters of the partner, by name."""


@dataclass(frozen=True)
class CutMachine:
    """A CutMachine has a half that a surrogate may replace, and a partner that takes its force.

    Attributes:
        half: class of the half, whose parameters ``step`` and ``substeps`` are its steps.
        partner: model of the partner; its outputs ``work`` and ``exchanged``, in J, are the work
            on the half and the energy that passed the cut.
        partners: their parameters, by the words that name them.
        links: connections of the components ``half`` and ``partner``.
        force, motion: the output of the half, and the inputs of the half that move.
        command: the partner's input that moves it.
        step: communication step in s.
        integration: longest integration step of the half in s.
        free: parameters of a partner that is let go and must come to rest, its output that shows
            it, and the largest value at the start.
        drive: gives the command over time of a partner, from a seed and an end time in s.
        whole: gives the true responses at the communication points of a step in s, from the
            partner and the command.
        place: gives the way on which the force does work, from the inputs of the half, (N, n).
    """

    half: str
    partner: str
    partners: Mapping[str, Partner]
    links: Sequence[tuple[str, str]]
    force: str
    motion: Sequence[str]
    command: str
    step: float
    integration: float
    free: tuple[Partner, str, float]
    drive: Callable[[Partner, int, float], Callable[[FloatArray], FloatArray]]
    whole: Callable[[Partner, Callable[[FloatArray], FloatArray], float, float], Any]
    place: Callable[[FloatArray], FloatArray]

    def half_system(self, step: float) -> Stepping:
        """Make the exact half with a step in s."""
        system = load_system(self._half(step))
        assert isinstance(system, Stepping)
        return system

    def _half(self, step: float) -> Specification:
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
        half: Path | None,
        partner: Partner,
        command: Any,
        step: float,
        stop: float,
        nodes: int = NODES,
        **how: Any,
    ) -> Coupled:
        """Run the halves together; without a surrogate as half, the exact one.

        An exact half needs several steps in a communication step of an implicit method.
        """
        exact = half is None
        return couple(
            {
                "partner": self.write_partner(folder, step, partner),
                "half": half or self.write_half(folder, step / nodes),
            },
            self.links,
            step=step,
            stop=stop,
            inputs={f"partner.{self.command}": command},
            moving=["half"] if exact else [],
            **how,
        )

    def work(self, run: Coupled, step: float) -> float:
        """Return the work in J that the motion of a run does on the exact half.

        The inputs move straight from one communication point to the next. The force jumps where
        a step begins: its value there continues those behind it.
        """
        inputs = np.stack([run[f"half.{name}"] for name in self.motion], axis=1)
        system = self.half_system(step / REPLAYED)
        system.begin(inputs[0])
        parts = (np.arange(REPLAYED) + 1)[:, None] / REPLAYED
        way, work = self.place(inputs), 0.0
        for k in range(len(inputs) - 1):
            rows = inputs[k] + parts * (inputs[k + 1] - inputs[k])
            force = np.array([system.advance(row)[0] for row in rows])
            first = 2 * force[0] - force[1]
            mean = (0.5 * first + force[:-1].sum() + 0.5 * force[-1]) / REPLAYED
            work += float(mean * (way[k + 1] - way[k]))
        return work


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
