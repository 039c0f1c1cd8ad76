"""A loop says which output acts on which input, and through what kind of partner.

A partner is a mass with a spring and a damper, on which the output acts as a force and whose
displacement is the input; or a spring with a damper, whose end the output moves and whose force is
the input. Moments and angles are forces and displacements too. Or it is a model of the user.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field, field_validator, model_validator

from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.core.toml_table import Table
from slide_fmu.excitation.base import Range, ordered
from slide_fmu.excitation.descriptions import between

FORCES = {"N": 1.0, "kN": 1e3, "MN": 1e6}
DISPLACEMENTS = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "um": 1e-6}
MOMENTS = {"N.m": 1.0, "kN.m": 1e3, "N.mm": 1e-3}
ANGLES = {"rad": 1.0, "mrad": 1e-3, "deg": math.pi / 180}
"""Units of loops, with their sizes in SI units."""

MASS, INERTIA = "kg", "kg.m2"

SIMPLE = ("mass", "stiffness", "damping")
"""Keys of a simple partner."""

WHOLE_OUTER = 0.5
"""Probability that all of what is drawn from outside acts on a partner. In the other cases a share
does. In most machines nothing acts on the partner from outside: other inputs of the system move
it, with small forces. A bound that was calibrated without such motions covers fewer errors."""

AnyRange = Annotated[tuple[float, float], AfterValidator(ordered)]
"""A range whose ends may be negative."""

LEAST_OUTER, LEAST_ALONE = 0.01, 0.1
"""Smallest shares, where the system has other inputs, and where the loop's is the only one.
Smaller ones leave networks too little to learn from."""


@dataclass(frozen=True)
class Partner:
    """A Partner closes a loop around a system. All values are in SI units.

    Attributes:
        mass: in kg, or kg.m2; 0 where it is driven by a displacement.
        stiffness: in N/m, or N.m/rad.
        damping: in N.s/m, or N.m.s/rad.
        outer: share of the outer force, or of the motion of its other end, that acts on it.
        own: names and values of ``ranges``, of a model of the user.
    """

    mass: float
    stiffness: float
    damping: float
    outer: float = 1.0
    own: tuple[tuple[str, float], ...] = ()

    def response(self, angular_frequency: FloatArray) -> NDArray[np.complex128]:
        """Return the answer of the system's input to its output, (F,), at frequencies in rad/s.

        It is a displacement over a force for a mass, and a force over a displacement without one.
        """
        own = self.stiffness + 1j * angular_frequency * self.damping
        if self.mass:
            return np.asarray(1.0 / (own - self.mass * angular_frequency**2))
        return np.asarray(-own)


@dataclass(frozen=True)
class Interface:
    """An Interface holds the places, units and causality of a loop in a system.

    Attributes:
        output, input: channels of the signals.
        output_unit, input_unit: sizes of their units in SI units; 1 for a partner of the user.
        force_out: whether the output is a force and the input a displacement.
        turning: whether these are a moment and an angle.
    """

    output: int
    input: int
    output_unit: float
    input_unit: float
    force_out: bool
    turning: bool


class LoopRecipe(Table):
    """A table ``[[loop]]`` draws motions in which an output decides an input through a partner.

    The partners have random values in the ranges. The inputs are drawn as by a kind of
    ``data.excitation``. What is drawn for the loop's input acts as an outer force on the partner,
    or moves its other end; in half of the motions, only a share of it. Other inputs of a
    ``partner`` move so too. In half of its motions, the other loops act as well, if their inputs
    differ.

    Attributes:
        output: output that acts on the partner: a force or moment, or a displacement or angle.
        input: input by which the partner answers: a displacement or angle, or a force or moment.
        weight: relative frequency of these motions among the kinds of ``data.excitation``.
        mass: range in kg, or kg.m2, for a force or moment as output; none for a displacement.
        stiffness: range in N/m, or N.m/rad.
        damping: range in N.s/m, or N.m.s/rad. The logarithms of these three are drawn uniformly;
            the values themselves where a range begins at 0.
        partner: model of your own in place of these three, as ``system.model`` names it: an FMU
            or a Python file. Output and input may then have any unit.
        through: input and output of the partner, by which the loop goes; if not given, the only
            ones.
        ranges: ranges of the partner's parameters and other inputs, by their names. Values of
            parameters are drawn as for a mass; inputs move in theirs.
    """

    output: str
    input: str
    weight: float = Field(gt=0)
    mass: Range = (0.0, 0.0)
    stiffness: Range = (0.0, 0.0)
    damping: Range = (0.0, 0.0)
    partner: str | None = None
    through: tuple[str, str] | None = None
    ranges: dict[str, AnyRange] | None = None

    @field_validator("ranges", mode="before")
    @classmethod
    def _lists_are_ranges(cls, value: Any) -> Any:
        if not isinstance(value, dict):
            return value
        return {k: tuple(v) if isinstance(v, list) else v for k, v in value.items()}

    @model_validator(mode="after")
    def _has_a_partner(self) -> LoopRecipe:
        simple = [key for key in SIMPLE if getattr(self, key)[1]]
        if self.partner is not None:
            if simple:
                raise ValueError(
                    f"partner = {self.partner!r} and {', '.join(simple)}; expected one of both: "
                    "give masses, springs and dampers in the partner's own model"
                )
            return self
        for key in ("through", "ranges"):
            if getattr(self, key) is not None:
                raise ValueError(
                    f"{key} without partner; expected both: name the model as partner"
                )
        if self.mass[0] == 0.0 < self.mass[1]:
            raise ValueError(
                f"mass = {list(self.mass)}; expected a smallest mass above 0, or no mass where "
                "the output is a displacement"
            )
        if not simple:
            raise ValueError(
                "no partner; expected a range of mass where the output is a force, of stiffness "
                "or damping where it is a displacement, or a model as partner"
            )
        return self

    @property
    def kind(self) -> str:
        """The name of these motions in reports."""
        return "loop"

    def settings(self) -> dict[str, str]:
        """Return all values but the weight by name, as text for reports."""
        simple = {name: getattr(self, name) for name in SIMPLE if getattr(self, name)[1]}
        ranges = {**simple, **(self.ranges or {})}
        kept = {name: " .. ".join(map(str, pair)) for name, pair in ranges.items()}
        own = {} if self.partner is None else {"partner": self.partner}
        return {"output": self.output, "input": self.input, **own, **kept}

    def interface(self, inputs: Sequence[Signal], outputs: Sequence[Signal]) -> Interface:
        """Return places and causality of the loop among the signals of a system.

        Raises:
            ValueError: a signal is unknown, or units and partner do not fit.
        """
        output = _named("output", self.output, outputs)
        input = _named("input", self.input, inputs)
        if self.partner is not None:
            return Interface(output, input, 1.0, 1.0, force_out=False, turning=False)
        units = outputs[output].unit.replace("*", "."), inputs[input].unit.replace("*", ".")
        causality = _causality(*units)
        if causality is None or inputs[input].angle is not None:
            raise ValueError(
                f"output {self.output!r} in {units[0]} acts on input {self.input!r} in "
                f"{units[1]}; expected a force and a displacement, or a moment and an angle, in "
                f"either order, in {', '.join((*FORCES, *DISPLACEMENTS, *MOMENTS, *ANGLES))}"
            )
        made = Interface(output, input, *causality)
        if made.force_out != bool(self.mass[1]):
            remedy = "give a range of mass" if made.force_out else "remove mass, give stiffness"
            what = "force" if made.force_out else "displacement"
            raise ValueError(
                f"mass = {list(self.mass)} with output {self.output!r} in {units[0]}; a {what} "
                f"{'moves a mass' if made.force_out else 'deforms a spring and damper'}: {remedy}"
            )
        return made

    def drawn_partner(self, rng: np.random.Generator, alone: bool) -> Partner:
        """Draw a partner, and the share of the outer force that acts on it.

        ``alone`` says that the system has no input but the loop's.
        """
        mass, stiffness, damping = (
            _between(pair, rng) for pair in (self.mass, self.stiffness, self.damping)
        )
        least = LEAST_ALONE if alone else LEAST_OUTER
        outer = 1.0 if rng.random() < WHOLE_OUTER else _between((least, 1.0), rng)
        own = [(name, _between(pair, rng)) for name, pair in (self.ranges or {}).items()]
        return Partner(mass, stiffness, damping, outer, tuple(own))

    def typical_partners(self) -> list[Partner]:
        """Return the partners at both ends of the ranges and in their geometric middle."""
        own = self.ranges or {}
        pairs = (self.mass, self.stiffness, self.damping, *own.values())
        differ = any(low < high for low, high in pairs)
        partners = [
            Partner(
                _at(self.mass, share),
                _at(self.stiffness, share),
                _at(self.damping, share),
                own=tuple((name, _at(pair, share)) for name, pair in own.items()),
            )
            for share in ((0.0, 0.5, 1.0) if differ else (0.0,))
        ]
        return list(dict.fromkeys(partners))

    def described(self, signals: Sequence[Signal], step: float) -> str:
        """Describe the motions in one sentence without its full stop, as a kind of excitation."""
        if self.partner is not None:
            return (
                f"in a loop with {self.partner_words(False)}: {self.output} acts on it, and "
                f"{self.input} is its answer; its other inputs, and those of the system, are "
                "drawn as in the other kinds"
            )
        unit = next((s.unit for s in signals if s.name == self.input), "m").replace("*", ".")
        force_out, turning = unit in (*DISPLACEMENTS, *ANGLES), unit in (*MOMENTS, *ANGLES)
        acts = "moves it" if force_out else "deforms it"
        outer = "an outer force acts on it" if force_out else "its other end moves"
        return (
            f"in a loop with {self.partner_words(turning)}: {self.output} {acts}, {self.input} is "
            f"its answer, and {outer}; these and other inputs are drawn as in the other kinds"
        )

    def partner_words(self, turning: bool, partner: Partner | None = None) -> str:
        """Name the range of partners, or one of them, such as ``a mass of 12 to 400 kg``."""
        if self.partner is not None:
            own = self.ranges or {}
            if partner is not None:
                own = {name: (float(f"{value:.3g}"),) * 2 for name, value in partner.own}
            listed = [f"{name} {between(pair)}" for name, pair in own.items()]
            return f"the model {self.partner}{' with ' if listed else ''}{', '.join(listed)}"
        units = (INERTIA, "N.m/rad", "N.m.s/rad") if turning else (MASS, "N/m", "N.s/m")
        nouns = ("an inertia" if turning else "a mass", "a stiffness", "a damping")
        words = []
        for noun, name, unit in zip(nouns, SIMPLE, units, strict=True):
            pair = getattr(self, name)
            if partner is not None:
                pair = (float(f"{getattr(partner, name):.3g}"),) * 2
            if pair[1]:
                words.append(f"{noun} of {between(pair, unit)}")
        return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def _named(what: str, name: str, signals: Sequence[Signal]) -> int:
    names = [signal.name for signal in signals]
    if name not in names:
        raise ValueError(f"{what} = {name!r}; expected one of {names}: correct it")
    return names.index(name)


def _causality(output: str, input: str) -> tuple[float, float, bool, bool] | None:
    """Return the sizes of both units, whether a force comes out, and whether it is a moment."""
    for forces, ways, turning in ((FORCES, DISPLACEMENTS, False), (MOMENTS, ANGLES, True)):
        if output in forces and input in ways:
            return forces[output], ways[input], True, turning
        if output in ways and input in forces:
            return ways[output], forces[input], False, turning
    return None


def _at(pair: tuple[float, float], share: float) -> float:
    """Return the value at a share of a range, evenly in its logarithm if that exists."""
    low, high = pair
    if low <= 0.0:
        return low + share * (high - low)
    return float(low ** (1 - share) * high**share)


def _between(pair: tuple[float, float], rng: np.random.Generator) -> float:
    return min(max(_at(pair, rng.random()), pair[0]), pair[1])
