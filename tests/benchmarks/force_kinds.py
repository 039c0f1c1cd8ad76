"""Forces on an oscillator as users apply them: hammers, gusts, presses, tones near resonance.

Moderate forces reach 350 N where they are tones and 700 N elsewhere, as in the training of the
Duffing oscillator. Harsh ones use the declared range of 1 kN.
"""

from __future__ import annotations

import numpy as np
from kind_tables import HARSH, Machine
from motion_profiles import Segments, along, filled, to_speed
from numpy.random import Generator

from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.base import State, System

LIMIT = 1000.0
"""Largest force in N."""
MODERATE_FORCE, MODERATE_TONE = 700.0, 250.0
"""Largest moderate forces in N: of any kind, and of all tones together."""
HARSH_TONE = 900.0
RESONANCE = 40.0
"""Angular frequency of small motions in rad/s; strong ones are faster."""


def _column(force: FloatArray, harsh: bool) -> FloatArray:
    limit = LIMIT if harsh else MODERATE_FORCE
    return np.clip(force, -limit, limit)[:, None]


def _sum_of(rng: Generator, times: FloatArray, rates: FloatArray, peak: float) -> FloatArray:
    """Return tones of random shares whose amplitudes add up to a peak in N."""
    shares = rng.uniform(0.4, 1.0, len(rates))
    phases = rng.uniform(0.0, 2.0 * np.pi, len(rates))
    tones = np.sin(np.outer(times, rates) + phases)
    return np.asarray(peak * tones @ (shares / shares.sum()))


def _peak(rng: Generator, harsh: bool) -> float:
    return float(rng.uniform(450.0, HARSH_TONE) if harsh else rng.uniform(80.0, MODERATE_TONE))


def _pulse_times(rng: Generator, end: float, least: float, most: float) -> FloatArray:
    gaps = rng.uniform(least, most, int(end / least) + 2)
    found = np.cumsum(gaps) - gaps[0] * rng.uniform()
    return np.asarray(found[found < end])


def _size(rng: Generator, harsh: bool) -> float:
    """Draw the size of a force that is no tone, in N, with its sign."""
    size = rng.uniform(500.0, LIMIT) if harsh else rng.uniform(100.0, MODERATE_FORCE)
    return float(size * rng.choice([-1.0, 1.0]))


def few_tones(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return two to four tones that have no common period, one of them near resonance."""
    others = rng.uniform(8.0, 80.0, rng.integers(1, 4))
    rates = np.concatenate([rng.uniform(43.0, 55.0, 1), others])
    return _column(_sum_of(rng, times, rates, _peak(rng, harsh)), harsh)


def modulated_tone(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return a tone whose amplitude swells and sinks."""
    depth, slow = rng.uniform(0.3, 1.0), rng.uniform(0.3, 4.0)
    swell = (1.0 + depth * np.sin(slow * times + rng.uniform(0.0, 6.0))) / (1.0 + depth)
    tone = np.sin(rng.uniform(20.0, 65.0) * times)
    return _column(_peak(rng, harsh) * swell * tone, harsh)


def two_tones_about_resonance(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return two equal tones, one below and one above the resonance: a beat."""
    middle = rng.uniform(RESONANCE, 52.0)
    apart = rng.uniform(0.5, 8.0)
    beat = np.sin((middle - apart) * times) + np.sin((middle + apart) * times + 1.0)
    return _column(0.5 * _peak(rng, harsh) * beat, harsh)


def pink_noise(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return noise of the same power in each octave, clipped."""
    spectrum = np.fft.rfft(rng.standard_normal(len(times)))
    spectrum[1:] /= np.sqrt(np.arange(1, len(spectrum)))
    spectrum[0] = 0.0
    noise = np.fft.irfft(spectrum, len(times))
    size = rng.uniform(200.0, 450.0) if harsh else rng.uniform(60.0, 200.0)
    return _column(size * noise / np.std(noise), harsh)


def half_sine_hammers(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return blows of half a sine, of 0.06 to 0.3 s."""
    force = np.zeros(len(times))
    for begin in _pulse_times(rng, times[-1], 0.4, 3.0):
        part = (times - begin) / rng.uniform(0.06, 0.3)
        force += _size(rng, harsh) * np.where((part > 0) & (part < 1), np.sin(np.pi * part), 0.0)
    return _column(force, harsh)


def gusts(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return gusts, each 1 - cos of 0.3 to 4 s, on a weak steady wind."""
    force = np.full(len(times), rng.uniform(-80.0, 80.0))
    for begin in _pulse_times(rng, times[-1], 0.5, 4.0):
        part = (times - begin) / rng.uniform(0.3, 4.0)
        swell = 0.5 * (1.0 - np.cos(2.0 * np.pi * part))
        force += 0.9 * _size(rng, harsh) * np.where((part > 0) & (part < 1), swell, 0.0)
    return _column(force, harsh)


def hold_and_release(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return forces that rise slowly, are held for long, and let go at once."""
    force, begin = np.zeros(len(times)), rng.uniform(0.0, 1.0)
    while begin < times[-1]:
        rise, held, pause = rng.uniform(0.2, 2.0), rng.uniform(2.0, 7.0), rng.uniform(1.0, 4.0)
        level = np.clip((times - begin) / rise, 0.0, 1.0) * (times < begin + rise + held)
        force += _size(rng, harsh) * level
        begin += rise + held + pause
    return _column(force, harsh)


def step_trains(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return a regular train of steps between two levels, after a wait."""
    period = rng.uniform(0.3, 2.5) if harsh else rng.uniform(0.8, 4.0)
    share = rng.uniform(0.2, 0.8)
    on = np.mod(times / period, 1.0) < share
    levels = np.array([_size(rng, harsh), rng.uniform(-0.3, 0.3) * LIMIT])
    return _column(np.where(on, *levels) * (times > rng.uniform(0.0, 3.0)), harsh)


def offset_with_tones(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return one to three tones on a constant force."""
    offset = rng.uniform(300.0, 600.0) if harsh else rng.uniform(50.0, 400.0)
    rates = rng.uniform(10.0, 70.0, rng.integers(1, 4))
    peak = rng.uniform(150.0, 400.0) if harsh else rng.uniform(50.0, MODERATE_TONE)
    tones = _sum_of(rng, times, rates, float(peak))
    return _column(rng.choice([-1.0, 1.0]) * offset + tones, harsh)


def chirps_that_stop(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return chirps, up or down, that stop at once; then there is no force for a while."""
    force, begin = np.zeros(len(times)), 0.0
    while begin < times[-1]:
        lasts, pause = rng.uniform(4.0, 10.0), rng.uniform(1.0, 3.0)
        first, last = rng.permutation([rng.uniform(5.0, 20.0), rng.uniform(50.0, 85.0)])
        after = times - begin
        phase = first * after + 0.5 * (last - first) / lasts * after**2
        force += _peak(rng, harsh) * np.sin(phase) * ((after >= 0) & (after < lasts))
        begin += lasts + pause
    return _column(force, harsh)


def press_cycle(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return a cycle that repeats: rise, hold, fall, pause."""
    rise, held, fall, pause = rng.uniform([0.1, 0.2, 0.1, 0.3], [0.8, 1.5, 0.6, 1.5])
    part = np.mod(times, rise + held + fall + pause)
    ends = np.cumsum([0.0, rise, held, fall])
    return _column(_size(rng, harsh) * np.interp(part, ends, [0.0, 1.0, 1.0, 0.0]), harsh)


def pump(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return a rectified sine, as of a piston pump, whose speed drifts."""
    rate = rng.uniform(4.0, 25.0)
    phase = rate * times + 0.2 * rate * np.sin(0.4 * times)
    peak = rng.uniform(400.0, HARSH_TONE) if harsh else rng.uniform(60.0, 350.0)
    return _column(peak * np.abs(np.sin(phase)), harsh)


def tone_bursts(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return bursts of 3 to 20 periods of a tone, each swelling and sinking."""
    force = np.zeros(len(times))
    begin = rng.uniform(0.0, 1.0)
    while begin < times[-1]:
        rate = rng.uniform(15.0, 75.0)
        lasts = rng.uniform(3.0, 20.0) * 2.0 * np.pi / rate
        part = (times - begin) / lasts
        swell = np.where((part > 0) & (part < 1), np.sin(np.pi * part) ** 2, 0.0)
        force += _peak(rng, harsh) * swell * np.sin(rate * (times - begin))
        begin += lasts + rng.uniform(0.3, 2.0)
    return _column(force, harsh)


def stick_slip(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return a saw: the force rises steadily and slips back at irregular times."""
    slips = np.concatenate([[0.0], _pulse_times(rng, times[-1], 0.2, 1.5), [times[-1] + 1.0]])
    k = np.searchsorted(slips, times, side="right") - 1
    most = 1.5
    size = rng.uniform(600.0, LIMIT) if harsh else rng.uniform(150.0, MODERATE_FORCE)
    saw = (times - slips[k]) / most
    return _column(rng.choice([-1.0, 1.0]) * size * np.minimum(saw, 1.0), harsh)


def long_rest_then_tone(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return a tone near resonance that begins at once after a long rest, and ends later."""
    begin = 0.6 * times[-1] + rng.uniform(-3.0, 3.0)
    on = (times >= begin) & (times < begin + rng.uniform(4.0, 9.0))
    tone = _peak(rng, harsh) * np.sin(rng.uniform(35.0, 52.0) * (times - begin))
    return _column(tone * on, harsh)


def imbalance(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return the force of a rotor with an imbalance, which goes from one speed to the next."""
    top, now = 60.0, 0.0

    def change() -> Segments:
        nonlocal now
        before, now = now, float(rng.choice([0.0, 1.0, 1.0]) * rng.uniform(0.5, 1.0) * top)
        return [
            *to_speed(before, now, float(rng.uniform(4.0, 30.0))),
            (float(rng.uniform(2.0, 8.0)), 0.0),
        ]

    segments = filled(float(times[-1]), change)
    step = times[1] - times[0]
    phase = along(times, segments)
    # the force grows with the square of the speed, here that of the last sample
    speed = np.diff(phase, prepend=phase[0]) / step
    return _column(_peak(rng, harsh) * (speed / top) ** 2 * np.sin(phase), harsh)


def steady_tone(rng: Generator, times: FloatArray, harsh: bool) -> FloatArray:
    """Return one tone near resonance; a strong one may have two lasting responses."""
    tone = np.sin(rng.uniform(40.0, 58.0) * times)
    return _column(_peak(rng, harsh) * tone, harsh)


def _states(system: System, rng: Generator, first: FloatArray) -> list[State]:
    """Return rest, then two fast states, from which strong responses begin."""
    still = [(0.0, 0.0), (1.5, 60.0), (-1.5, -60.0)]
    return [State(np.array([x]), np.array([v]), np.zeros(1)) for x, v in still]


FORCES = Machine(
    lead=12.0,
    kinds={
        one.__name__: one
        for one in (
            few_tones,
            modulated_tone,
            two_tones_about_resonance,
            pink_noise,
            half_sine_hammers,
            gusts,
            hold_and_release,
            step_trains,
            offset_with_tones,
            chirps_that_stop,
            press_cycle,
            pump,
            tone_bursts,
            stick_slip,
            long_rest_then_tone,
            imbalance,
            steady_tone,
        )
    },
    only={"steady_tone": HARSH},
    states=_states,
)
