"""The poles of a linear fit tell how fast the system behind a record forgets."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from slide_fmu.core.signals import Trajectory
from slide_fmu.record_files.reading import read_records
from slide_fmu.records.decay import RecordDecay, decay_of_records
from slide_fmu.records.preparation import Preparation, prepared
from tests.own_records import BEND, FREQUENCY, RATE, STEP, force_and_travel
from tests.refusals import refused


def pieces(
    samples: int, noise: float = 0.0, seed: int = 0, bend: float = BEND
) -> list[Trajectory]:
    force, travel = force_and_travel(samples, seed, bend)
    travel = travel + noise * travel.std() * np.random.default_rng(5 + seed).normal(size=samples)
    return [Trajectory(STEP, force[1:, None], travel[:, None])]


def integrated(samples: int) -> list[Trajectory]:
    [piece] = pieces(samples)
    return [Trajectory(STEP, piece.inputs, np.cumsum(piece.outputs, axis=0))]


@pytest.mark.parametrize("noise", [0.0, 0.003, 0.05])
def test_rate_and_frequency_of_an_oscillator_are_found_beside_noise(noise: float) -> None:
    found = decay_of_records(pieces(20_000, noise), 0.01)
    assert found.rate == pytest.approx(-RATE, rel=0.08)
    assert found.frequency == pytest.approx(FREQUENCY, rel=0.05)
    assert not found.lasts
    assert found.time == pytest.approx(np.log(100) / RATE, rel=0.08)


@pytest.mark.parametrize(("step", "noise"), [(0.02, 0.0), (0.05, 0.0), (0.03, 1e-3), (0.05, 0.01)])
def test_resampled_lag_under_a_smoothed_input_decays_as_it_does(
    tmp_path: Path, step: float, noise: float
) -> None:
    """A fit to it also has a pole that grows, at a frequency that the input never had."""
    rng, count = np.random.default_rng(1), 6000
    force = np.convolve(rng.normal(size=count), np.ones(20) / 20, "same")
    lag = lfilter([0.05, 0.05], [1.0, -0.9], force)
    lag += noise * lag.std() * rng.normal(size=count)
    table = np.stack([0.01 * np.arange(count), force, lag], axis=1)
    np.savetxt(tmp_path / "lag.csv", table, "%.18e", ",", header="time,force,lag", comments="")
    records = read_records((str(tmp_path / "lag.csv"),), ("force", "lag"))
    made = prepared(records, Preparation(("force",), ("lag",), step, "first_order", "same"))
    found = decay_of_records([piece.trajectory for piece in made.pieces], 0.01)
    assert not found.lasts
    assert found.rate == pytest.approx(np.log(0.9) / 0.01, rel=0.06)


def test_interval_of_a_linear_system_mostly_holds_the_true_time_and_shrinks_with_length() -> None:
    true = np.log(100) / RATE
    found = [decay_of_records(pieces(3000, 0.02, seed, 0.0), 0.01) for seed in range(20)]
    intervals = [one.interval for one in found]
    assert sum(low < true < high for low, high in intervals) >= 16
    widths = [decay_of_records(pieces(count, 0.02), 0.01).deviation for count in (2000, 40_000)]
    assert widths[1] < widths[0]


def test_several_pieces_tell_what_one_tells() -> None:
    [whole] = pieces(12_000, 0.01)
    cut = [
        Trajectory(STEP, whole.inputs[a : a + 3000], whole.outputs[a : a + 3001])
        for a in range(0, 11_000, 3000)
        if a + 3001 <= len(whole.outputs)
    ]
    assert len(cut) == 3
    one, several = (decay_of_records(parts, 0.01) for parts in ([whole], cut))
    assert several.rate == pytest.approx(one.rate, rel=0.1)


def test_integral_of_an_output_lasts() -> None:
    found = decay_of_records(integrated(10_000), 0.01)
    assert found.lasts
    assert found.frequency == 0.0


def test_pole_beyond_the_excited_band_does_not_count() -> None:
    """Noise of a narrow band lies in the outputs alone, far above what the inputs excite."""
    force, travel = force_and_travel(20_000)
    t = np.arange(20_000)
    hum = (
        0.3
        * travel.std()
        * np.cos(2.6 * t + np.cumsum(np.random.default_rng(0).normal(0, 0.01, len(t))))
    )
    found = decay_of_records([Trajectory(STEP, force[1:, None], (travel + hum)[:, None])], 0.01)
    assert found.rate == pytest.approx(-RATE, rel=0.15)


def test_too_few_samples_are_refused_with_their_number() -> None:
    with refused(ValueError, "20 samples with", "records of"):
        decay_of_records(pieces(21), 0.01)


@pytest.mark.parametrize("length", [60, 20])
def test_pieces_shorter_than_the_highest_order_tell_what_a_whole_one_tells(length: int) -> None:
    [whole] = pieces(12_000, 0.003)
    cut = [
        Trajectory(STEP, whole.inputs[a : a + length - 1], whole.outputs[a : a + length])
        for a in range(0, 11_900, length)
    ]
    assert decay_of_records(cut, 0.01).rate == pytest.approx(-RATE, rel=0.2)


def test_pieces_that_are_all_too_short_are_refused_with_the_figures() -> None:
    [whole] = pieces(1000)
    cut = [
        Trajectory(STEP, whole.inputs[a : a + 1], whole.outputs[a : a + 2])
        for a in range(0, 900, 2)
    ]
    with refused(ValueError, "450 pieces", "others without"):
        decay_of_records(cut, 0.01)


def test_missing_outputs_are_left_out_with_what_follows_from_them() -> None:
    [whole] = pieces(12_000, 0.003)
    outputs = whole.outputs.copy()
    outputs[9::10] = np.nan
    found = decay_of_records([Trajectory(STEP, whole.inputs, outputs)], 0.01)
    assert found.order <= 8
    assert found.rate == pytest.approx(-RATE, rel=0.2)


def test_decay_that_does_not_end_has_no_time() -> None:
    found = RecordDecay(0.1, 0.01, 0.0, 0.01, 4, 2, 10.0)
    assert found.time == np.inf
    assert found.lasts


def test_samples_that_touch_outliers_do_not_move_the_poles() -> None:
    [clean] = pieces(6000, 0.003)
    spoilt = Trajectory(STEP, clean.inputs.copy(), clean.outputs.copy())
    spoilt.outputs[[700, 1900, 3333, 4800]] += 400.0
    spoilt.inputs[[1200, 5100]] -= 600.0
    found, expected = (decay_of_records([one], 0.01) for one in (spoilt, clean))
    assert found.rate == pytest.approx(expected.rate, rel=0.05)
    assert found.deviation < 3 * expected.deviation
