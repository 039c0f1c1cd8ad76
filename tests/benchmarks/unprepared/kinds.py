"""Sixteen kinds of input that an engineer would try first on a finished surrogate.

``KINDS[name].motion(duration, ranges, rng, band)`` draws a motion: the inputs as a function of any
time, with the times at which they jump or bend, for solvers. Natures of kinds are "smooth"
(continuous with their derivatives, within the band), "kinks" (continuous, the rate jumps) and
"jumps" (right-continuous).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from slide_fmu.core.signals import FloatArray

Parts = Callable[[FloatArray], FloatArray]
"""Inputs at times in s, (N,) to (N, n_inputs), in parts of half their range about its middle."""
Nature = Literal["smooth", "kinks", "jumps"]
NATURES: tuple[Nature, ...] = ("smooth", "kinks", "jumps")
SMOOTH_SAMPLES = 16
"""Inputs are smooth for an FMU that has at least this number of samples in a period."""
TONES, LEVELS = 8, (0.3, 1.0)
"""Number of frequencies of lasting tones, and their amplitudes."""


@dataclass(frozen=True)
class Band:
    """A Band says how a motion may move.

    Attributes:
        low, high: working frequencies of the machine in Hz.
        step: the FMU's step h in s.
        duration: of the motion in s.
        resonances: of the machine in Hz.
        index: number of the motion within its kind, over which grids of tones run.
        on_grid: whether levels change at multiples of h alone, as where an importer sets them.
    """

    low: float
    high: float
    step: float
    duration: float
    resonances: tuple[float, ...] = ()
    index: int = 0
    on_grid: bool = False

    @property
    def top(self) -> float:
        """Highest frequency that is used, in Hz."""
        return min(self.high, 1 / (SMOOTH_SAMPLES * self.step))

    @property
    def bottom(self) -> float:
        """Lowest frequency that is used, in Hz."""
        return min(max(self.low, 1.5 / self.duration), 0.7 * self.top)

    @property
    def middle(self) -> float:
        """Geometric mean of both, in Hz."""
        return float(np.sqrt(self.bottom * self.top))

    def settled(self, times: FloatArray) -> FloatArray:
        """Return times in s at which levels may change."""
        return np.round(times / self.step) * self.step if self.on_grid else times

    def draw(self, rng: np.random.Generator, shape: tuple[int, ...] | None = None) -> Any:
        """Draw frequencies in Hz, evenly over their logarithms."""
        return np.exp(rng.uniform(np.log(self.bottom), np.log(self.top), shape))

    def spans(self) -> tuple[float, float]:
        """Return the usual shortest and longest time between changes, in s."""
        return 0.5 / self.top, max(2 / self.middle, 2 / self.top)


@dataclass(frozen=True, eq=False)
class Drawn:
    """A Drawn is what a kind draws, before the inputs' ranges are known.

    Attributes:
        parts: the inputs.
        breaks: times in s at which they jump or bend.
        about: what tells motions of a kind apart.
        on_grid: whether all jumps are at multiples of the FMU's step.
    """

    parts: Parts
    breaks: FloatArray = field(default_factory=lambda: np.zeros(0))
    about: dict[str, Any] = field(default_factory=dict)
    on_grid: bool = False


@dataclass(frozen=True, eq=False)
class Motion:
    """A Motion is the inputs over time, in their units.

    Attributes:
        drawn: what was drawn; its breaks are within the motion and rise.
        ranges: low and high end of each input, (n_inputs, 2).
    """

    drawn: Drawn
    ranges: FloatArray

    def __call__(self, times: ArrayLike) -> FloatArray:
        """Return the inputs at times in s, (N,) or one alone, as (N, n_inputs)."""
        parts = self.drawn.parts(np.atleast_1d(np.asarray(times, np.float64)))
        low, high = self.ranges.T
        return np.asarray(0.5 * (low + high) + 0.5 * (high - low) * np.clip(parts, -1, 1))


Draw = Callable[[float, int, np.random.Generator, Band], Drawn]
"""Draws from a duration in s, the number of inputs, a generator and a band."""


@dataclass(frozen=True)
class Kind:
    """A Kind is a way in which inputs move.

    Attributes:
        draw: draws a motion.
        nature: how smooth it is.
        count: number of motions that are judged.
    """

    draw: Draw
    nature: Nature
    count: int

    def motion(self, ranges: ArrayLike, rng: np.random.Generator, band: Band) -> Motion:
        """Draw a motion of inputs with these ranges, (n_inputs, 2)."""
        limits = np.asarray(ranges, np.float64)
        drawn = self.draw(band.duration, len(limits), rng, band)
        inside = (drawn.breaks > 0) & (drawn.breaks < band.duration)
        breaks = np.unique(drawn.breaks[inside])
        return Motion(Drawn(drawn.parts, breaks, drawn.about, drawn.on_grid), limits)


def after_a_past(motion: Motion, lead: float, rng: np.random.Generator, band: Band) -> Motion:
    """Return a motion that comes later by a lead in s, after tones near a resonance in all inputs.

    A machine with several responses to the same inputs may have another one then: the tones reach
    the whole range, so that they leave it in full motion.
    """
    n = len(motion.ranges)
    f = near_a_resonance(rng, band)
    past = sines(np.ones((n, 1)), f, rng.uniform(0, 2 * np.pi, (n, 1)))

    def parts(t: FloatArray) -> FloatArray:
        own = motion.drawn.parts(np.maximum(t - lead, 0.0))
        return np.asarray(np.where(t[:, None] < lead, past(t), own))

    breaks = np.concatenate([[lead], lead + motion.drawn.breaks])
    return Motion(replace(motion.drawn, parts=parts, breaks=breaks), motion.ranges)


def near_a_resonance(rng: np.random.Generator, band: Band) -> float:
    """Draw a frequency in Hz within 10 % of the resonance whose turn it is."""
    at = [f for f in band.resonances if f <= band.top] or [band.middle]
    return float(min(at[band.index % len(at)] * rng.uniform(0.9, 1.1), band.top))


KINDS: dict[str, Kind] = {}
"""All kinds by name; the number of a kind in this order is part of its seed."""


def kind(nature: Nature, count: int = 6) -> Callable[[Draw], Draw]:
    """Add a function to the kinds under its name."""

    def add(draw: Draw) -> Draw:
        KINDS[draw.__name__] = Kind(draw, nature, count)
        return draw

    return add


def sines(
    amplitude: ArrayLike, frequency: ArrayLike, phase: ArrayLike, offset: ArrayLike = 0.0
) -> Parts:
    """Return sums of sines; the first three have the shape (n_inputs, components)."""
    a, p = np.atleast_2d(amplitude), np.atleast_2d(phase)
    w = 2 * np.pi * np.atleast_2d(frequency)
    return lambda t: (a * np.sin(w * t[:, None, None] + p)).sum(axis=2) + offset


def held(times: Sequence[FloatArray], values: Sequence[NDArray[Any]]) -> Parts:
    """Return values of each input that are held from their times on."""
    tables = list(zip(times, values, strict=True))
    return lambda t: np.stack([b[np.searchsorted(a, t, "right") - 1] for a, b in tables], 1)


def intervals(
    rng: np.random.Generator, duration: float, shortest: float, longest: float
) -> FloatArray:
    """Draw rising times from 0 to beyond the duration, distances evenly over their logarithms."""
    times = [0.0]
    while times[-1] < duration:
        times.append(times[-1] + np.exp(rng.uniform(np.log(shortest), np.log(longest))))
    return np.array(times)


@kind("smooth", 16)
def lasting_tones(duration: float, n: int, rng: np.random.Generator, band: Band) -> Drawn:
    """One sine for the whole motion: 8 frequencies over the band at 30 % and 100 % of the range;
    by turns in one input alone (the others at the middle) and in all at once, with random phases.
    """
    k, row = band.index % TONES, band.index // TONES
    level = LEVELS[row % 2]
    f = band.bottom * (band.top / band.bottom) ** (k / (TONES - 1))
    a = np.full((n, 1), level)
    which: int | str = "all"
    if n > 1 and (k + row) % 2 == 0:
        which = int(rng.integers(n))
        a[np.arange(n) != which] = 0
    parts = sines(a, f, rng.uniform(0, 2 * np.pi, (n, 1)))
    return Drawn(parts, about={"hertz": f, "amplitude": level, "input": which})


@kind("smooth")
def tones_with_offset(duration: float, n: int, rng: np.random.Generator, band: Band) -> Drawn:
    """A sine in each input about an offset, up to the end of the range."""
    offset = rng.uniform(-0.6, 0.6, n)
    a = ((1 - abs(offset)) * rng.uniform(0.4, 1.0, n))[:, None]
    return Drawn(sines(a, band.draw(rng), rng.uniform(0, 2 * np.pi, (n, 1)), offset))


@kind("smooth")
def two_tones(duration: float, n: int, rng: np.random.Generator, band: Band) -> Drawn:
    """Two sines at once in every input, together up to the whole range."""
    share = rng.uniform(0.25, 0.75)
    a = rng.uniform(0.5, 1.0) * np.array([share, 1 - share]) * np.ones((n, 1))
    return Drawn(sines(a, band.draw(rng, (n, 2)), rng.uniform(0, 2 * np.pi, (n, 2))))


@kind("smooth")
def near_resonance(duration: float, n: int, rng: np.random.Generator, band: Band) -> Drawn:
    """A sine within 10 % of a resonance, at 20, 60 or 100 % of the range, in one input."""
    f = near_a_resonance(rng, band)
    a = np.zeros((n, 1))
    a[band.index % n] = (0.2, 0.6, 1.0)[band.index % 3]
    return Drawn(sines(a, f, rng.uniform(0, 2 * np.pi, (n, 1))))


@kind("jumps")
def steps(duration: float, n: int, rng: np.random.Generator, band: Band) -> Drawn:
    """Levels anywhere in the range, each input at its own times; jumps in no time."""
    low, high = band.spans()
    times = [band.settled(intervals(rng, duration, 2 * low, 2 * high)) for _ in range(n)]
    parts = held(times, [rng.uniform(-1, 1, len(t)) for t in times])
    return Drawn(parts, np.concatenate(times), on_grid=band.on_grid)


@kind("kinks")
def slow_ramps(duration: float, n: int, rng: np.random.Generator, band: Band) -> Drawn:
    """Straight lines between points far apart; some pieces are level."""
    times = [intervals(rng, duration, duration / 12, duration / 5) for _ in range(n)]
    values = []
    for t in times:
        v = rng.uniform(-1, 1, len(t))
        for k in np.flatnonzero(rng.random(len(t) - 1) < 0.3):
            v[k + 1] = v[k]
        values.append(v)
    tables = list(zip(times, values, strict=True))

    def parts(t: FloatArray) -> FloatArray:
        return np.stack([np.interp(t, a, b) for a, b in tables], 1)

    return Drawn(parts, np.concatenate(times))


@kind("smooth")
def chirps(duration: float, n: int, rng: np.random.Generator, band: Band) -> Drawn:
    """Even motions: linear chirps, odd ones: logarithmic chirps, over the band, up or down, in all
    inputs."""
    a, b = band.bottom, band.top
    if rng.random() < 0.5:
        a, b = b, a
    phases, level = rng.uniform(0, 2 * np.pi, n), rng.uniform(0.4, 1.0)

    def parts(t: FloatArray) -> FloatArray:
        if band.index % 2 == 0:
            turn = a * t + 0.5 * (b - a) * t**2 / duration
        else:
            ratio = np.log(b / a)
            turn = a * duration / ratio * np.expm1(ratio * t / duration)
        return np.asarray(level * np.sin(2 * np.pi * turn[:, None] + phases))

    return Drawn(parts)


@kind("smooth")
def pink_noise(duration: float, n: int, rng: np.random.Generator, band: Band) -> Drawn:
    """Sixty sines in each input, of equal power per octave over the band; the peak is 50 to 100 %
    of the range."""
    edges = np.linspace(np.log(band.bottom), np.log(band.top), 61)
    f = np.exp(edges[:-1] + np.diff(edges) * rng.random((n, 60)))
    p = rng.uniform(0, 2 * np.pi, (n, 60))
    peak = abs(sines(np.ones((n, 60)), f, p)(np.linspace(0, duration, 20000))).max(axis=0)
    return Drawn(sines(rng.uniform(0.5, 1.0) / peak[:, None] * np.ones((n, 60)), f, p))


def moves(
    rng: np.random.Generator,
    duration: float,
    n: int,
    spans: tuple[float, float],
    rest: tuple[float, float],
    curve: Parts,
) -> Drawn:
    """Draw moves from point to point with rests.

    Args:
        rng, duration, n: as for ``Draw``.
        spans: shortest and longest time of a move in s.
        rest: the same of a rest.
        curve: the part of the way at parts of the time.
    """
    shortest, longest = spans
    plans = []
    for _ in range(n):
        t, x = rng.uniform(0, longest), rng.uniform(-0.8, 0.8)
        plan: list[tuple[float, float, float, float]] = []
        while t < duration:
            goal = rng.uniform(-1, 1)
            span = np.exp(rng.uniform(np.log(shortest), np.log(longest)))
            plan.append((t, span, x, goal))
            t, x = t + span + rng.uniform(*rest), goal
        plans.append(np.array(plan or [(duration, 1.0, x, x)]))

    def parts(t: FloatArray) -> FloatArray:
        columns = []
        for plan in plans:
            k = np.searchsorted(plan[:, 0], t, "right") - 1
            begin, span, x, goal = plan[np.maximum(k, 0)].T
            s = np.where(k < 0, 0.0, np.clip((t - begin) / span, 0, 1))
            columns.append(x + (goal - x) * curve(s))
        return np.stack(columns, 1)

    ends = np.concatenate([np.concatenate([p[:, 0], p[:, 0] + p[:, 1]]) for p in plans])
    return Drawn(parts, ends)


def quintic(s: FloatArray) -> FloatArray:
    """Return the way of a move without jerk at its ends."""
    return np.asarray(s**3 * (10 - 15 * s + 6 * s**2))


def trapezoid(s: FloatArray, share: float = 0.3) -> FloatArray:
    """Return the way of a trapezoidal speed with the shares of acceleration and braking."""
    v = 1 / (1 - share)
    return np.where(
        s < share,
        0.5 * v / share * s**2,
        np.where(s > 1 - share, 1 - 0.5 * v / share * (1 - s) ** 2, v * (s - share / 2)),
    )


@kind("smooth")
def s_curves_and_rests(duration: float, n: int, rng: np.random.Generator, band: Band) -> Drawn:
    """Moves point to point with rests between them: even motions jerk-limited (quintic) with long
    rests, odd ones trapezoids of speed, one after the other (continuous with their rates)."""
    low = 1 / band.top
    high = max(3 * low, min(1 / band.bottom, duration / 8))
    if band.index % 2 == 0:
        return moves(rng, duration, n, (low, high), (high, duration / 5), quintic)
    return moves(rng, duration, n, (low, high), (0, high), trapezoid)


@kind("smooth")
def one_input_at_a_time(duration: float, n: int, rng: np.random.Generator, band: Band) -> Drawn:
    """One input moves as a slow sum of three sines, the others stay at some level; they take turns
    by motion."""
    j = band.index % n
    f = band.draw(rng, (n, 3))
    a = np.zeros((n, 3))
    a[j] = rng.dirichlet(np.ones(3)) * rng.uniform(0.5, 1.0)
    offset = rng.uniform(-0.5, 0.5, n)
    offset[j] = 0
    return Drawn(sines(a, f, rng.uniform(0, 2 * np.pi, (n, 3)), offset))


@kind("jumps")
def duty_cycle(duration: float, n: int, rng: np.random.Generator, band: Band) -> Drawn:
    """A duty cycle of a drive, repeated: full - partial - zero - brake - zero, on the grid of the
    FMU's own steps (a PLC sets it there), each input with its own levels."""
    low, high = band.spans()
    h = band.step
    drawn = np.exp(rng.uniform(np.log(2 * low), np.log(2 * high), 5))
    lengths = np.maximum(1, np.round(drawn / h)) * h
    profile = np.array([1.0, 0.4, 0.0, -0.7, 0.0])[:, None]
    levels = profile * rng.uniform(0.5, 1.0, n) * rng.choice([-1, 1], n)
    edge = np.concatenate([[0], np.cumsum(lengths)])
    rounds = int(duration / edge[-1]) + 1
    times = np.concatenate([edge[:-1] + k * edge[-1] for k in range(rounds + 1)])
    times = np.round(times / h) * h
    values = [np.tile(row, rounds + 1) for row in levels.T]
    return Drawn(held([times] * n, values), times, on_grid=True)


@kind("jumps")
def random_telegraph(duration: float, n: int, rng: np.random.Generator, band: Band) -> Drawn:
    """Each input switches between two levels at random times."""
    low, high = band.spans()
    times = [band.settled(intervals(rng, duration, low, 2 * high)) for _ in range(n)]
    values = []
    for t in times:
        a = rng.uniform(0.3, 1.0)
        values.append(a * (-1.0) ** (np.arange(len(t)) + rng.integers(2)))
    return Drawn(held(times, values), np.concatenate(times), on_grid=band.on_grid)


@kind("jumps")
def sawtooth(duration: float, n: int, rng: np.random.Generator, band: Band) -> Drawn:
    """Slow rise and sudden fall, two to four octaves below the top of the band."""
    f = np.maximum(band.top / 2 ** rng.uniform(2, 4, n), 3 / duration)
    a, phase = rng.uniform(0.3, 1.0, n) * rng.choice([-1, 1], n), rng.random(n)

    def parts(t: FloatArray) -> FloatArray:
        return np.asarray(a * (2 * ((f * t[:, None] + phase + 1e-12) % 1) - 1))

    falls = [(np.arange(1, f[i] * duration + 2) - phase[i]) / f[i] for i in range(n)]
    return Drawn(parts, np.concatenate(falls))


@kind("smooth")
def bursts(duration: float, n: int, rng: np.random.Generator, band: Band) -> Drawn:
    """Tone bursts of 4 to 12 periods under a sine-squared envelope, rest between them, in all
    inputs."""
    plan, t = [], rng.uniform(0, 0.05 * duration)
    while t < duration:
        f = np.exp(rng.uniform(np.log(band.middle), np.log(band.top)))
        span = min(rng.uniform(4, 12) / f, 0.25 * duration)
        plan.append((t, span, f, rng.uniform(0.2, 1.0)))
        t += span + rng.uniform(0.02, 0.15) * duration
    lags = rng.uniform(0, 2 * np.pi, n)

    def parts(t: FloatArray) -> FloatArray:
        z = np.zeros((len(t), n))
        for begin, span, f, a in plan:
            s = np.clip((t - begin) / span, 0, 1)
            envelope = np.sin(np.pi * s) ** 2
            z += a * envelope[:, None] * np.sin(2 * np.pi * f * (t - begin)[:, None] + lags)
        return z

    return Drawn(parts)


@kind("smooth")
def small_moves_about_offset(
    duration: float, n: int, rng: np.random.Generator, band: Band
) -> Drawn:
    """A working point anywhere in the middle 80 % of the range, and 2 to 10 % of the range in
    three sines about it."""
    offset = rng.uniform(-0.8, 0.8, n)
    a = rng.uniform(0.02, 0.1) * rng.dirichlet(np.ones(3), n)
    return Drawn(sines(a, band.draw(rng, (n, 3)), rng.uniform(0, 2 * np.pi, (n, 3)), offset))


@kind("smooth")
def cam_periodic(duration: float, n: int, rng: np.random.Generator, band: Band) -> Drawn:
    """A cam: the same rise - dwell - return - dwell in every turn, by quintics; each input with
    its own cam."""
    turn = 4 / band.top * 2 ** rng.uniform(0, 2)  # s for a turn; a rise takes a quarter and more
    a, low, phase = rng.uniform(0.4, 1.6, n), rng.uniform(-1, -0.6, n), rng.random(n)
    rise, back = rng.uniform(0.25, 0.35, n), rng.uniform(0.25, 0.35, n)
    dwell = rng.uniform(0.1, 0.25, n)

    def parts(t: FloatArray) -> FloatArray:
        s = (t[:, None] / turn + phase) % 1
        up = quintic(np.clip(s / rise, 0, 1))
        down = quintic(np.clip((s - rise - dwell) / back, 0, 1))
        return np.asarray(low + a * (up - down))

    return Drawn(parts)
