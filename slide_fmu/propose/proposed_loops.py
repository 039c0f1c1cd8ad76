"""This module proposes the loops of a recipe, with partners that suit the answers of the system.

The system is simulated in the middle of its inputs, with a small step of the loop's input.
Partners get natural frequencies that the sample step shows well.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.data.closed_loop import LEAST, no_answer
from slide_fmu.excitation.loop import INERTIA, MASS, Interface, LoopRecipe, Partner
from slide_fmu.recipe.recipe import RecipeError
from slide_fmu.recipe.writing import DraftLoop
from slide_fmu.systems.base import Stepping, System
from slide_fmu.systems.errors import LoadError
from slide_fmu.systems.loading import load_system
from slide_fmu.systems.simulation import simulate
from slide_fmu.systems.specification import Specification

SAMPLES = 400
"""Length of the answer to a small step, in samples."""
SMALL = 0.01
"""The step, as a part of half the range of the input."""
FASTEST, BAND = 16, 6.0
"""Samples in a period of the fastest loop, and the ratio of fastest and slowest frequency."""
FINER = 4
"""The answer is also measured with a step this many times finer."""
HOLDS = 1e-3
"""A system does not hold its partner if it answers less at rest than this part of its answer at
the fastest frequency."""
DAMPED = 0.1
"""Least stiffness of what mainly damps, as a part of the size of its answer."""
WEIGHT = 0.3
"""Weight of motions in a loop; those of the other kinds have 1 in total."""
DAMPING = 0.2
"""Largest damping of a proposed spring, over its stiffness and the fastest angular frequency."""


@dataclass(frozen=True, eq=False)
class _Answer:
    """An _Answer holds what a system answers to a small step of the loop's input, in SI units.

    Attributes:
        step: sample step in s.
        change: change of the output at the samples after the step, over the step, (SAMPLES,).
    """

    step: float
    change: FloatArray

    def gain(self, angular_frequency: float) -> complex:
        """Return the answer at an angular frequency in rad/s."""
        pulses = np.diff(self.change, prepend=0.0)
        turns = np.exp(-1j * angular_frequency * self.step * np.arange(len(pulses)))
        return complex(np.sum(pulses * turns))


def proposed_loops(
    pairs: tuple[str, ...], specification: Specification, step: float
) -> list[DraftLoop]:
    """Propose loops for pairs ``OUTPUT:INPUT`` of a system, which is simulated.

    Raises:
        RecipeError: the pair is none, its units are no force and displacement, the system cannot
            be stepped, or its output drives its input on.
        SimulationError: the system could not be simulated.
    """
    require_pairs(pairs)
    return [_proposed(pair, specification, step) for pair in pairs]


def require_pairs(pairs: tuple[str, ...], system: System | None = None) -> None:
    """Refuse pairs that are not ``OUTPUT:INPUT``, and signals that the system does not have."""
    for pair in pairs:
        output, colon, input = pair.rpartition(":")
        if not (colon and output and input):
            raise RecipeError(
                f"--loop {pair!r}; expected OUTPUT:INPUT, the output that acts on a partner and "
                "the input by which the partner answers: correct it"
            )
        if system is not None:
            _interface(pair, system)


def _proposed(pair: str, specification: Specification, step: float) -> DraftLoop:
    output, _, input = pair.rpartition(":")
    system = load_system(replace(specification, step=step))
    at = _interface(pair, system)
    answer = _answer(system, at)
    _require_answer(pair, system, at, answer)
    slow, fast = (2 * math.pi / (FASTEST * step * by) for by in (BAND, 1.0))
    partner = _masses(answer, slow, fast) if at.force_out else _springs(answer, slow, fast)
    _require_holding(pair, at, answer)
    loop = LoopRecipe(output=output, input=input, weight=WEIGHT, **partner)
    hertz = f"{slow / (2 * math.pi):.2g} to {fast / (2 * math.pi):.2g} Hz"
    steps = f"{FASTEST} to {FASTEST * BAND:g} steps"
    found = ""
    if at.force_out:
        found = f"With such a partner, the loop oscillates at about {hertz}, in {steps}. "
    return DraftLoop(
        {"output": output, "input": input, "weight": WEIGHT, **partner},
        (
            _causality(output, input, at),
            f"{found}Give the range of your partners.",
        ),
        _warnings(loop, at, answer, _finer(specification, step, at)),
    )


def _interface(pair: str, system: System) -> Interface:
    """Return the places of a loop, with whatever partner its units ask for."""
    output, _, input = pair.rpartition(":")
    if not isinstance(system, Stepping):
        raise RecipeError(
            f"--loop {pair}: the model simulates whole motions only; expected one that goes on "
            "step by step: give f and g in place of simulate(t, u, p)"
        )
    partners: tuple[dict[str, Any], ...] = ({"mass": (1.0, 1.0)}, {"stiffness": (1.0, 1.0)})
    for partner in partners:
        loop = LoopRecipe(output=output, input=input, weight=WEIGHT, **partner)
        try:
            return loop.interface(system.inputs, system.outputs)
        except ValueError as error:
            last = error
    raise RecipeError(f"--loop {pair}: {last}") from last


def _answer(system: System, at: Interface) -> _Answer:
    """Simulate a small step in the middle of all ranges."""
    middles = np.array([0.5 * (s.low + s.high) for s in system.inputs])
    signal = system.inputs[at.input]
    small = SMALL * 0.5 * (signal.high - signal.low)
    rows = np.tile(middles, (SAMPLES + 1, 1))
    still = simulate(system, rows).outputs[2:, at.output]
    rows[1:, at.input] += small
    moved = simulate(system, rows).outputs[2:, at.output]
    return _Answer(system.step, (moved - still) * at.output_unit / (small * at.input_unit))


def _finer(specification: Specification, step: float, at: Interface) -> _Answer | None:
    """Return the answer at a finer step; None where the model has its own."""
    try:
        system = load_system(replace(specification, step=step / FINER))
    except LoadError:
        return None
    if not math.isclose(system.step, step / FINER):
        return None
    return _answer(system, at)


def _masses(answer: _Answer, slow: float, fast: float) -> dict[str, Any]:
    """Return masses, and a stiffness where the system has none, for loops of these frequencies."""
    gains = [answer.gain(turn) for turn in (slow, fast)]
    stiff = [max(-gain.real, DAMPED * abs(gain)) for gain in gains]
    masses = sorted(size / turn**2 for size, turn in zip(stiff, (slow, fast), strict=True))
    found: dict[str, Any] = {"mass": _pair(*masses)}
    if not _holds(answer, abs(gains[1])):
        middle = math.sqrt(masses[0] * masses[1]) * slow * fast
        found["stiffness"] = _pair(middle / 3, 3 * middle)
    return found


def _springs(answer: _Answer, slow: float, fast: float) -> dict[str, Any]:
    """Return springs up to the fastest loop, from much weaker ones."""
    stiffest = 1.0 / max(abs(answer.gain(fast)), np.finfo(float).tiny)
    return {
        "stiffness": _pair(stiffest / BAND**2, stiffest),
        "damping": (0.0, _tidy(DAMPING * stiffest / fast)),
    }


def _holds(answer: _Answer, size: float) -> bool:
    return bool(abs(answer.change[-1]) > HOLDS * size)


def _require_answer(pair: str, system: System, at: Interface, answer: _Answer) -> None:
    """Refuse an output that does not follow its input."""
    ends = system.inputs[at.input], system.outputs[at.output]
    moved, all_of_it = (signal.high - signal.low for signal in ends)
    change = np.abs(answer.change).max() * moved * at.input_unit
    if not change > LEAST * all_of_it * at.output_unit:
        raise RecipeError(no_answer(f"--loop {pair}", float(change)))


def _require_holding(pair: str, at: Interface, answer: _Answer) -> None:
    """Refuse a force that drives its partner on, and a displacement against its force."""
    wrong = answer.change[-1] > 0 if at.force_out else answer.change[-1] < 0
    if wrong and _holds(answer, float(np.abs(answer.change).max())):
        what = (
            "the force on the partner, which falls where the partner follows it"
            if at.force_out
            else "the displacement along the force"
        )
        raise RecipeError(
            f"--loop {pair}: at rest the output changes by {answer.change[-1]:.3g} (SI units) for "
            f"each unit of the input, which drives the partner away; expected {what}: give the "
            "output the other sign"
        )


def _causality(output: str, input: str, at: Interface) -> str:
    """Say which way the loop goes, and when that is right."""
    if at.force_out:
        return (
            f"Displacement in, force out: {output} acts on a partner with a mass, whose "
            f"displacement is {input}. This is right where the other part has a mass: it "
            "integrates the motion itself."
        )
    return (
        f"Force in, displacement out: {output} deforms a partner, whose force is {input}. This is "
        "right where the other part is a spring and damper without a mass at the cut. If it has a "
        "mass, cut the other way round: a surrogate that integrates forces drifts."
    )


def _warnings(
    loop: LoopRecipe, at: Interface, answer: _Answer, finer: _Answer | None
) -> tuple[str, ...]:
    """Say where explicit steps of an importer do not work, and where no step would."""
    first, step = abs(answer.change[0]), answer.step
    if at.force_out:
        extreme = Partner(loop.mass[0], loop.stiffness[0], loop.damping[0])
        if finer is not None and _follows_acceleration(answer, finer):
            added = first * step**2
            return (
                f"{loop.output} follows the acceleration of {loop.input}, as of a mass of "
                f"{added:.2g} {INERTIA if at.turning else MASS}. With lighter partners, explicit "
                "steps of an importer grow, however short: take a heavier partner or an implicit "
                "method, or move this mass to the other part.",
            )
        gain = first * step**2 / extreme.mass
    else:
        extreme = Partner(0.0, loop.stiffness[1], loop.damping[1])
        gain = first * (extreme.stiffness + extreme.damping / step)
    if gain <= 1.0:
        return ()
    return (
        f"The interface is stiff: with {loop.partner_words(at.turning, extreme)}, the gain round "
        f"the loop in one step of {step:g} s is {gain:.2g}. Above 1, explicit steps of an "
        "importer grow: let it take shorter steps or an implicit method, or choose another "
        "partner.",
    )


def _follows_acceleration(answer: _Answer, finer: _Answer) -> bool:
    """Tell whether the first answer grows with the square of the step's inverse."""
    first, other = abs(answer.change[0]), abs(finer.change[0])
    return bool(first > 0 and other > FINER**1.5 * first)


def _pair(low: float, high: float) -> tuple[float, float]:
    return _tidy(low), _tidy(high)


def _tidy(value: float) -> float:
    return float(f"{value:.2g}")
