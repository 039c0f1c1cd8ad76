"""Every kind of excitation is what its name says."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from pydantic import TypeAdapter, ValidationError

from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.excitation.kinds import Excitation, choose_kind

STEP = 0.01
TIME = STEP * np.arange(4000)
FORCE = Signal("force", "N", -2.0, 2.0)
SHIFTED = Signal("temperature", "K", 280.0, 300.0)

TABLES = {
    "held_random": {},
    "moving_average_random": {"coefficients": [0.5, 0.3, 0.2]},
    "filtered_random": {"angular_frequency": [5.0, 60.0]},
    "harmonic": {"angular_frequency": [5.0, 20.0]},
    "sweep": {"angular_frequency": [5.0, 60.0]},
    "multisine": {"angular_frequency": [5.0, 60.0]},
    "steps": {"duration": [0.3, 0.5]},
    "ramps": {"duration": [0.3, 0.5]},
    "stops": {"duration": [0.3, 0.5], "angular_frequency": [1.0, 3.0]},
    "binary": {"duration": [0.3, 0.5]},
    "rest": {"duration": [0.3, 0.5]},
}
DRAWN = {
    "held_random": (1.28885499, 290.590784652, 0.775495966),
    "moving_average_random": (-0.20126041, 282.360778815, 0.007079944),
    "filtered_random": (0.500131118, 278.408978881, 0.007079944),
    "harmonic": (-0.928812107, 288.574654995, 0.670445743),
    "sweep": (1.496348912, 297.630994378, 0.670445743),
    "multisine": (-0.928874621, 287.36934394, 0.691773264),
    "steps": (-1.042990384, 279.203493922, 0.106851274),
    "ramps": (-1.042990384, 279.203493922, 0.106851274),
    "stops": (0.0, 290.611708565, 0.408098468),
    "binary": (-1.626071796, 298.774280064, 0.115079382),
    "rest": (-1.616877881, 290.0, 0.007079944),
}
"""Values that released data were drawn with: two of the signals, and the next random number."""
BOUNDED = sorted(TABLES.keys() - {"multisine", "filtered_random"})


def kind_of(name: str, **extra: object) -> Excitation:
    table = {"kind": name, "weight": 1.0, **TABLES[name], **extra}
    return TypeAdapter(Excitation).validate_python(table)


def signal(name: str, seed: int, **extra: object) -> FloatArray:
    return kind_of(name, **extra).signal(TIME, np.random.default_rng(seed))


def runs(values: FloatArray) -> list[int]:
    """Lengths of runs of equal values, without the first and the last."""
    edges = np.flatnonzero(np.diff(values)) + 1
    return [int(b - a) for a, b in pairwise(edges)]


@pytest.mark.parametrize("name", TABLES)
def test_drawn_inputs_are_reproducible_and_independent_by_channel(name: str) -> None:
    signals = (FORCE, SHIFTED, FORCE)

    def drawn(seed: int) -> FloatArray:
        rng = np.random.default_rng(seed)
        return kind_of(name).inputs(signals, TIME, 1.0, rng)

    inputs = drawn(1)
    assert inputs.shape == (len(TIME), 3)
    assert np.array_equal(inputs, drawn(1))
    assert not np.array_equal(inputs, drawn(2))
    # correlations of independent channels, mean over seeds: harmonics of one frequency correlate
    parts = [np.corrcoef(drawn(seed).T)[np.triu_indices(3, 1)] for seed in range(30)]
    assert np.max(np.abs(np.mean(parts, axis=0))) < 0.3


@pytest.mark.parametrize("name", TABLES)
def test_draws_stay_those_of_released_data(name: str) -> None:
    rng, kind = np.random.default_rng(12), kind_of(name, amplitude=[0.5, 1.0])
    inputs = kind.inputs((FORCE, SHIFTED), TIME[:50], 1.3, rng)
    assert (inputs[7, 0], inputs[49, 1], rng.random()) == pytest.approx(DRAWN[name], abs=1e-8)


@pytest.mark.parametrize("name", BOUNDED)
@pytest.mark.parametrize("factor", [1.0, 2.5])
def test_values_fill_the_range_times_amplitude_and_factor(name: str, factor: float) -> None:
    rng = np.random.default_rng(3)
    kind = kind_of(name, amplitude=[0.4, 0.6])
    largest = []
    for _ in range(20):
        inputs = kind.inputs((SHIFTED,), TIME, factor, rng)
        largest.append(float(np.max(np.abs(inputs - 290.0))) / (10.0 * factor))
    assert max(largest) <= 0.6
    assert min(largest) < 0.5 < max(largest)


@pytest.mark.parametrize("name", TABLES)
def test_cosine_and_sine_of_an_angle_are_drawn_as_one(name: str) -> None:
    """Drawn on their own they would be no angle; the signals around them stay as they are."""
    cosine = Signal("x", "1", -2.0, 2.0, angle="cosine")
    sine = Signal("y", "1", -2.0, 2.0, angle="sine")
    signals = (FORCE, cosine, sine, SHIFTED)
    found = kind_of(name).inputs(signals, TIME, 1.5, np.random.default_rng(1))
    assert found.shape == (len(TIME), 4)
    assert np.hypot(found[:, 1], found[:, 2]) == pytest.approx(2.0)
    assert np.ptp(found[:, 1]) > 0.5
    alone = kind_of(name).inputs((FORCE,), TIME, 1.5, np.random.default_rng(1))
    assert np.array_equal(found[:, 0], alone[:, 0])


def test_harmonic_is_one_sine_of_the_range() -> None:
    bin_width = 2 * np.pi / (STEP * len(TIME))
    found = []
    for seed in range(20):
        values = signal("harmonic", seed)
        spectrum = np.abs(np.fft.rfft(values * np.hanning(len(values))))
        frequency = bin_width * np.argmax(spectrum)
        assert 5.0 - bin_width <= frequency <= 20.0 + bin_width
        ahead, here = values[2:] + values[:-2], values[1:-1]
        twice_cosine = float(ahead @ here / (here @ here))
        assert np.max(np.abs(ahead - twice_cosine * here)) < 1e-9  # only one sine obeys this
        assert np.arccos(twice_cosine / 2) / STEP == pytest.approx(frequency, abs=bin_width)
        found.append(frequency)
    assert min(found) < 9.0
    assert max(found) > 16.0


def test_multisine_is_straight_or_held_between_common_points() -> None:
    kind = kind_of("multisine", points=[4 * STEP, 4 * STEP], amplitude=[0.1, 0.2])
    signals = (Signal("a", "m", -2.0, 6.0, hold="first_order"), Signal("b", "N", -2.0, 6.0))
    assert not kind.bends
    assert kind_of("multisine").bends
    for seed in range(8):
        moving, held = kind.inputs(signals, TIME, 1.0, np.random.default_rng(seed)).T
        kinks = np.flatnonzero(np.abs(np.diff(moving, 2)) > 1e-9) + 1
        jumps = np.flatnonzero(np.diff(held)) + 1
        assert set(np.diff(kinks)) <= {4, 8}
        assert set(np.diff(jumps)) <= {4, 8}  # one may be too small
        assert len({*(kinks % 4), *(jumps % 4)}) == 1
        assert len(kinks) > len(TIME) / 5


def test_points_have_all_distances_of_their_range_and_a_sample_at_least() -> None:
    kind = kind_of("multisine", points=[0.3 * STEP, 6 * STEP])
    signals = (Signal("b", "N", -2.0, 6.0),)
    found = []
    for seed in range(60):
        held = kind.inputs(signals, TIME, 1.0, np.random.default_rng(seed))[:, 0]
        found.append(min(np.diff(np.flatnonzero(np.diff(held)))))
    assert {1, 2, 3, 4, 5} <= set(found) <= {1, 2, 3, 4, 5, 6}


def test_angle_with_points_is_refused() -> None:
    signals = (
        Signal("x", "1", -1.0, 1.0, hold="first_order", angle="cosine"),
        Signal("y", "1", -1.0, 1.0, hold="first_order", angle="sine"),
    )
    kind_of("multisine").check(signals)
    with pytest.raises(ValueError, match=r"points = \[0.1, 0.2\] .* leaves the circle"):
        kind_of("multisine", points=[0.1, 0.2]).check(signals)


def test_multisine_has_its_frequencies_and_unit_rms() -> None:
    squares = []
    for seed in range(40):
        values = signal("multisine", seed)
        squares.append(np.mean(values**2))
        spectrum = np.abs(np.fft.rfft(values * np.hanning(len(values)))) ** 2
        frequency = 2 * np.pi / (STEP * len(TIME)) * np.arange(len(spectrum))
        inside = (frequency > 4.5) & (frequency < 60.5)
        assert spectrum[~inside].sum() < 1e-3 * spectrum.sum()
        assert np.sum(spectrum > 0.01 * spectrum.max()) > 8  # not one line
    assert np.sqrt(np.mean(squares)) == pytest.approx(1.0, abs=0.05)  # sines may beat


def test_filtered_random_has_unit_rms_and_falls_beyond_its_corner() -> None:
    many = np.stack([signal("filtered_random", seed) for seed in range(60)])
    assert np.sqrt(np.mean(many[:, 0] ** 2)) == pytest.approx(1.0, abs=0.25)  # from the start on
    assert np.sqrt(np.mean(many**2)) == pytest.approx(1.0, abs=0.05)
    power = np.mean(np.abs(np.fft.rfft(many * np.hanning(many.shape[1]))) ** 2, axis=0)
    frequency = 2 * np.pi / (STEP * len(TIME)) * np.arange(len(power))
    low, high = (power[(frequency > a) & (frequency < 1.5 * a)].mean() for a in (2.0, 100.0))
    # one pole, corners from 5 to 60 rad/s: about (corner / frequency) squared
    assert 20 < low / high < 400


def test_sines_by_decades_are_slow_as_often_as_fast() -> None:
    time = np.arange(4096) * 0.01
    found = []
    for seed in range(200):
        kind = kind_of("harmonic", angular_frequency=[1.0, 100.0], decades=True)
        values = kind.signal(time, np.random.default_rng(seed))
        found.append(frequency_of(values, 0.01))
    assert 0.4 < np.mean(np.array(found) < 10.0) < 0.6
    assert max(found) > 70.0


def frequency_of(values: FloatArray, step: float) -> float:
    """The angular frequency in rad/s of a sine, by its second differences."""
    bend = np.dot(values[1:-1], values[2:] + values[:-2]) / np.dot(values[1:-1], values[1:-1])
    return float(np.arccos(np.clip(0.5 * bend, -1, 1)) / step)


def test_sweep_by_decades_takes_as_long_through_each_octave() -> None:
    time = np.linspace(0.0, 40.0, 40001)
    kind = kind_of("sweep", angular_frequency=[1.0, 64.0], decades=True)
    middles = []
    for seed in range(6):
        values = kind.signal(time, np.random.default_rng(seed))
        middles.append(frequency_of(values[19950:20051], 0.001))
        ends = [frequency_of(values[:2001], 0.001), frequency_of(values[-2001:], 0.001)]
        assert sorted(ends) == pytest.approx([1.0, 64.0], rel=0.25)  # it moves by 23 % there
    assert middles == pytest.approx([8.0] * 6, rel=0.05)


def test_offset_of_any_kind_moves_its_middle() -> None:
    time = np.arange(4000) * 0.01
    kind = kind_of(
        "harmonic", angular_frequency=[5.0, 6.0], amplitude=[0.2, 0.3], offset=[0.4, 0.5]
    )
    middles = [np.mean(kind.scaled(time, np.random.default_rng(seed))) for seed in range(20)]
    assert all(0.38 < abs(middle) < 0.52 for middle in middles)
    assert min(middles) < 0 < max(middles)


def test_sweep_crosses_its_range_in_both_directions() -> None:
    rising, fine = 0, STEP / 10 * np.arange(10 * len(TIME))
    for seed in range(20):
        values = kind_of("sweep").signal(fine, np.random.default_rng(seed))
        crossings = fine[np.flatnonzero(np.diff(np.signbit(values)))]
        frequency = np.pi / np.diff(crossings)
        low, high = sorted([frequency[0], frequency[-1]])
        assert 5.0 < low < 6.3  # of one half wave, in which the frequency moves by up to 1 rad/s
        assert high == pytest.approx(60.0, rel=0.03)
        middle = np.interp(20.0, crossings[1:], frequency)
        assert middle == pytest.approx(32.5, rel=0.03)  # linear in time
        rising += frequency[0] < frequency[-1]
    assert 4 <= rising <= 16


def test_steps_hold_their_durations() -> None:
    lengths = [length for seed in range(5) for length in runs(signal("steps", seed))]
    assert len(lengths) > 5 * 70
    assert 29 <= min(lengths) <= 32
    assert 48 <= max(lengths) <= 51
    assert len(np.unique(signal("steps", 0))) > 70


def test_binary_signals_hold_their_durations_at_both_ends() -> None:
    lengths = [length for seed in range(5) for length in runs(signal("binary", seed))]
    assert len(lengths) > 5 * 70
    assert 29 <= min(lengths) <= 32
    assert 48 <= max(lengths) <= 51
    assert np.unique(signal("binary", 0)).tolist() == [-1, 1]
    assert {signal("binary", seed)[0] for seed in range(20)} == {-1, 1}


def test_rest_has_rests_between_random_values() -> None:
    values = signal("rest", 0)
    resting = values == 0.0
    lengths = runs(resting.astype(float))
    assert min(lengths) >= 29
    assert max(lengths) <= 51
    assert np.mean(resting) == pytest.approx(0.5, abs=0.1)
    assert len(np.unique(values[~resting])) == np.sum(~resting)
    assert not resting[0]


def test_held_random_holds_every_value_for_its_samples() -> None:
    assert len(np.unique(signal("held_random", 0))) == len(TIME)
    assert set(runs(signal("held_random", 0, samples=[3, 5]))) == {3, 4, 5}
    values = signal("held_random", 1)
    assert np.var(values) == pytest.approx(1 / 3, rel=0.05)
    assert abs(np.mean(values)) < 0.05


def test_moving_average_weighs_the_newest_value_by_its_first_coefficient() -> None:
    """Value k is 0.75 r[k] + 0.25 r[k-1], with r drawn in the order of time."""
    found = signal("moving_average_random", 4, coefficients=[0.75, 0.25])
    drawn = np.random.default_rng(4).uniform(-1, 1, len(TIME) + 1)
    assert found == pytest.approx(0.75 * drawn[1:] + 0.25 * drawn[:-1], abs=1e-15)


def test_kinds_are_chosen_by_their_weights() -> None:
    kinds = tuple(kind_of("held_random", weight=weight) for weight in (1.0, 2.0, 5.0))
    rng = np.random.default_rng(0)
    chosen = np.bincount([choose_kind(kinds, rng) for _ in range(4000)], minlength=3) / 4000
    assert chosen == pytest.approx([0.125, 0.25, 0.625], abs=0.03)  # 4 standard deviations


@pytest.mark.parametrize("name", TABLES)
def test_a_single_sample_can_be_drawn(name: str) -> None:
    assert kind_of(name).signal(TIME[:1], np.random.default_rng(0)).shape == (1,)


@pytest.mark.parametrize(
    ("name", "extra"),
    [
        ("harmonic", {"angular_frequency": [20.0, 5.0]}),
        ("harmonic", {"angular_frequency": [0.0, 5.0]}),
        ("harmonic", {"angular_frequency": [1.0, float("inf")]}),
        ("held_random", {"samples": [0, 1]}),
        ("held_random", {"samples": [2, 1]}),
        ("held_random", {"amplitude": [-0.1, 1.0]}),
        ("held_random", {"amplitude": [0.0, float("nan")]}),
        ("multisine", {"components": [5, 4]}),
        ("moving_average_random", {"coefficients": []}),
        ("steps", {"duration": [0.0, 1.0]}),
        ("rest", {"length": [0.3, 0.5]}),
    ],
)
def test_ranges_that_make_no_sense_are_refused(name: str, extra: dict[str, object]) -> None:
    with pytest.raises(ValidationError, match=next(iter(extra))):
        kind_of(name, **extra)


@pytest.mark.parametrize("components", [[1, 1], [2, 4]])
def test_band_sines_move_each_input_in_its_own_band(components: list[int]) -> None:
    angle = (
        Signal("x", "1", -1.0, 1.0, angle="cosine"),
        Signal("y", "1", -1.0, 1.0, angle="sine"),
    )
    table = {
        "kind": "band_sines",
        "weight": 1.0,
        "bands": [[60.0, 120.0], [2.0, 6.0], [1.0, 1.0], [1.0, 1.0]],
        "components": components,
        "amplitude": [0.5, 0.5],
    }
    kind = TypeAdapter(Excitation).validate_python(table)
    signals = (FORCE, SHIFTED, *angle)
    kind.check(signals)
    drawn = kind.inputs(signals, TIME, 1.0, np.random.default_rng(3))
    assert np.hypot(drawn[:, 2], drawn[:, 3]) == pytest.approx(1.0)
    for column, (low, high), size in ((0, (60.0, 120.0), 1.0), (1, (2.0, 6.0), 5.0)):
        values = drawn[:, column] - drawn[:, column].mean()
        assert np.std(values) == pytest.approx(size / np.sqrt(2), rel=0.05)
        power = np.abs(np.fft.rfft(values * np.hanning(len(values)))) ** 2
        rates = 2 * np.pi * np.fft.rfftfreq(len(values), STEP)
        assert power[(rates > 0.8 * low) & (rates < 1.2 * high)].sum() > 0.99 * power.sum()
    with pytest.raises(ValueError, match=r"bands has 4 values; expected 1"):
        kind.check((FORCE,))
