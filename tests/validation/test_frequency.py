"""Spectra and frequency responses beside what is known of simple systems."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import StateSpace, dlsim

from slide_fmu.core.signals import FloatArray
from slide_fmu.validation.comparison import Comparison
from slide_fmu.validation.frequency import Spectra, spectra_of
from tests.validation.handmade import comparison

STEP, COUNT = 0.01, 4000


def _answered(inputs: FloatArray, truth: FloatArray, own: FloatArray) -> Comparison:
    """A trajectory whose inputs, reference and surrogate are given, (N, channels)."""
    plain = comparison([[0.0] * truth.shape[1]])
    time = STEP * np.arange(len(inputs))
    return replace(plain, time=time, inputs=inputs, reference=truth, surrogate=own)


def _noise(columns: int, seed: int = 0) -> FloatArray:
    return np.random.default_rng(seed).normal(size=(COUNT, columns))


def _spectra(*comparisons: Comparison) -> Spectra:
    found = spectra_of(comparisons, STEP)
    assert found is not None
    return found


def test_response_of_a_delay_has_its_size_and_its_phase() -> None:
    u = _noise(1)
    u -= u.mean(axis=0)
    late = 3.0 * np.roll(u, 1, axis=0)
    found = _spectra(_answered(u, late, 1.1 * late))
    true, own = (response[:, 0, 0] for response in found.responses())
    np.testing.assert_allclose(np.abs(true), 3.0, rtol=0.05)
    expected = np.exp(-2j * np.pi * found.frequency * STEP)
    np.testing.assert_allclose(true / 3.0, expected, atol=0.05)
    np.testing.assert_allclose(own / true, 1.1, rtol=1e-9)


def test_inputs_at_rest_have_no_response() -> None:
    rest = np.zeros((COUNT, 2))
    for response in _spectra(_answered(rest, rest[:, :1], rest[:, :1])).responses():
        np.testing.assert_array_equal(response, 0.0)


def test_response_of_an_oscillator_to_held_inputs_is_the_analytic_one() -> None:
    """Size and phase of 1 / (m s^2 + d s + k), under a force that is held over each step."""
    mass, damping, stiffness = 1.0, 8.0, 1600.0
    continuous = StateSpace([[0, 1], [-stiffness / mass, -damping / mass]], [[0], [1 / mass]],
                            [[1, 0]], [[0]])  # fmt: skip
    held = continuous.to_discrete(STEP)
    force = _noise(1)
    # force[k] is held up to the time of sample k
    _, travel, _ = dlsim(held, np.append(force[1:], force[:1], axis=0))
    found = spectra_of([_answered(force, travel, travel)], STEP, "zero_order")
    assert found is not None
    for response in found.responses():
        omega = 2 * np.pi * found.frequency
        exact = 1 / (stiffness - mass * omega**2 + 1j * omega * damping)
        band = (found.frequency > 1) & (found.frequency < 20)
        ratio = response[band, 0, 0] / exact[band]
        assert np.median(np.abs(np.angle(ratio, deg=True))) < 3
        assert np.abs(np.median(np.angle(ratio[found.frequency[band] > 10], deg=True))) < 3
        assert np.median(np.abs(np.abs(ratio) - 1)) < 0.06


def test_responses_to_several_inputs_are_told_apart() -> None:
    u = _noise(2)
    u[:, 1] += 0.8 * u[:, 0]  # they come together, as joints of a robot do
    truth = np.stack([2.0 * u[:, 0] - u[:, 1], 5.0 * u[:, 1]], axis=1)
    true, own = _spectra(_answered(u, truth, truth)).responses()
    expected = np.broadcast_to([[2.0, 0.0], [-1.0, 5.0]], true.shape)
    np.testing.assert_allclose(true, expected, atol=1e-6)
    assert np.array_equal(true, own)


def test_density_integrates_to_the_mean_square() -> None:
    u, error = _noise(1), 0.1 * _noise(1, seed=1)
    found = _spectra(_answered(u, u, u + error))
    width = found.frequency[1] - found.frequency[0]
    assert np.sum(found.reference) * width == pytest.approx(np.mean(u**2), rel=0.05)
    assert np.sum(found.error) * width == pytest.approx(np.mean(error**2), rel=0.05)


def test_line_of_one_frequency_stands_where_it_is() -> None:
    time = STEP * np.arange(COUNT)[:, None]
    wave = np.sin(2 * np.pi * 7.0 * time)
    found = _spectra(_answered(wave, wave, wave))
    width = found.frequency[1] - found.frequency[0]
    assert found.frequency[np.argmax(found.reference)] == pytest.approx(7.0, abs=width)


def test_frequencies_that_no_input_has_are_not_driven() -> None:
    time = STEP * np.arange(COUNT)[:, None]
    wave = np.sin(2 * np.pi * 7.0 * time)
    found = _spectra(_answered(wave, wave, wave))
    driven = found.frequency[found.driven(0)]
    assert driven.min() > 1.0
    assert driven.max() < 25.0


def test_trajectories_that_are_too_short_have_no_spectra() -> None:
    u = _noise(1)[:90]
    assert spectra_of([_answered(u, u, u)], STEP) is None
    longer = _noise(1)[:96]
    assert spectra_of([_answered(longer, longer, longer)], STEP) is not None
