"""Linear starts: known systems are found again from their impulse responses and eigenvalues."""

from __future__ import annotations

import math

import numpy as np
import pytest
import scipy.signal
import torch

from slide_fmu.fitting.state_space.cell import simulate
from slide_fmu.fitting.state_space.linear_start import (
    LARGEST_POLE,
    LinearModel,
    Responses,
    band_edge,
    excited_eigenvalues,
    from_eigenvalues,
    impulse_responses,
    lowest_eigenvalues,
    realize,
    states_of,
    states_shown,
)
from tests.fitting.state_space.cells import plain, random

EXACT = 1e-7
"""Poles from a decomposition in float64, of systems whose last states show little."""
RIDGE_AND_TAIL = 2e-3
"""The regression's ridge, and what comes after its taps, relative to responses of order 1."""
STEP = 0.1


def known_system(n: int, p: int, q: int, seed: int, radius: float = 0.8) -> LinearModel:
    """A random linear system whose slowest pole has the radius."""
    a = random(n, n, seed=seed)
    a = radius * a / torch.linalg.eigvals(a).abs().max()
    return LinearModel(a, random(n, q, seed=seed + 1), random(p, n, seed=seed + 2))


def white(values: torch.Tensor) -> Responses:
    """Responses of shape (taps, p, q) to white inputs."""
    taps, _, q = values.shape
    return Responses(values, torch.eye(taps // 2 * q, dtype=values.dtype))


def responses_of(m: LinearModel, taps: int) -> torch.Tensor:
    """C A^k B, shape (taps, p, q)."""
    return torch.stack([m.c @ torch.linalg.matrix_power(m.a, k) @ m.b for k in range(taps)])


def poles(m: LinearModel) -> np.ndarray:
    return np.sort_complex(np.linalg.eigvals(m.a.numpy()).round(12))


def records(m: LinearModel, count: int, samples: int) -> tuple[torch.Tensor, torch.Tensor]:
    """White features and what the system answers from rest."""
    (n, q), p = m.b.shape, len(m.c)
    shape, features = plain(n, q, 0, p), random(count, samples, q, seed=7)
    outputs, _ = simulate(shape, shape.linear(*m), features.transpose(0, 1))
    rest = outputs.new_zeros(1, count, p)
    return features, torch.cat([rest, outputs]).transpose(0, 1)


@pytest.mark.parametrize(("n", "p", "q"), [(1, 1, 1), (2, 1, 1), (3, 2, 1), (4, 1, 3), (5, 3, 2)])
@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize("taps", [16, 25])
def test_realization_has_the_poles_and_the_responses(
    n: int, p: int, q: int, seed: int, taps: int
) -> None:
    known = known_system(n, p, q, seed)
    found = realize(white(responses_of(known, taps)), n)
    assert poles(found) == pytest.approx(poles(known), abs=EXACT)
    long = responses_of(known, 60)
    torch.testing.assert_close(responses_of(found, 60), long, rtol=0, atol=EXACT)
    assert (found.a.shape, found.b.shape, found.c.shape) == ((n, n), (n, q), (p, n))


@pytest.mark.parametrize(("p", "q"), [(1, 1), (2, 3)])
def test_impulse_responses_are_found_in_white_noise(p: int, q: int) -> None:
    known = known_system(3, p, q, 4, radius=0.7)
    features, targets = records(known, 4, 400)
    taps = 40
    constant = targets + 5.0  # is no response
    found = impulse_responses(features, features[:, :, :0], constant, taps)
    assert found.values.shape == (taps, p, q)
    expected = responses_of(known, taps)
    assert float((found.values - expected).abs().max()) < RIDGE_AND_TAIL * float(
        expected.abs().max()
    )


@pytest.mark.parametrize("statics", [1, 3])
def test_what_outputs_follow_at_once_is_no_impulse_response(statics: int) -> None:
    """Even where it moves with the drive, at another sample."""
    known = known_system(3, 2, 1, 4, radius=0.7)
    drive, targets = records(known, 4, 400)
    static = random(4, 400, statics, seed=8) + 0.5 * drive.roll(-3, 1)
    targets = targets + 0.0
    targets[:, 1:] += static @ random(statics, 2, seed=9)
    expected = responses_of(known, 40)
    bound = RIDGE_AND_TAIL * float(expected.abs().max())
    found = impulse_responses(drive, static, targets, 40).values
    assert float((found - expected).abs().max()) < bound
    without = impulse_responses(drive, static[:, :, :0], targets, 40).values
    assert float((without - expected).abs().max()) > 5 * bound


def test_states_that_show_are_counted() -> None:
    """Decoupled systems side by side: the states of all of them."""
    shown = torch.zeros(40, 3, 3, dtype=torch.float64)
    for channel, radius in enumerate((0.8, 0.7, 0.6)):
        shown[:, channel, channel] = radius ** torch.arange(40)
        assert states_shown(white(shown)) == channel + 1
    angle = torch.arange(40) * 0.9
    oscillation = 0.8 ** torch.arange(40) * torch.sin(angle + 0.5)
    assert states_shown(white(oscillation.double()[:, None, None])) == 2
    # a hundredth of the largest is noise
    assert states_shown(white(shown + 1e-2 * random(40, 3, 3) / 40)) == 3


def narrow_band(count: int, samples: int, edge: float) -> torch.Tensor:
    """Noise below a part of the Nyquist frequency, shape (count, samples, 1)."""
    passes = scipy.signal.butter(6, edge, output="sos")
    noise = np.random.default_rng(5).normal(size=(count, samples))
    filtered = scipy.signal.sosfilt(passes, noise, axis=1)
    return torch.from_numpy(filtered / filtered.std())[:, :, None]


@pytest.mark.parametrize("edge", [0.1, 0.2, 0.4])
def test_inputs_of_a_narrow_band_show_few_states_of_a_noisy_oscillation(edge: float) -> None:
    """Beyond the band, noise looks like states where it is not weighed by the inputs."""
    known = from_eigenvalues(np.array([-2 + 5j]), STEP, (1, 1), torch.Generator().manual_seed(3))
    shape, drive = plain(2, 1, 0, 1), narrow_band(4, 800, edge)
    outputs, _ = simulate(shape, shape.linear(*known), drive.transpose(0, 1))
    targets = torch.cat([outputs.new_zeros(1, 4, 1), outputs]).transpose(0, 1)
    noisy = targets / targets.std() + 0.1 * random(*targets.shape, seed=6)
    found = impulse_responses(drive, drive[:, :, :0], noisy, 40)
    assert states_shown(white(found.values)) >= 4
    assert states_shown(found) == 2
    assert poles(realize(found, 2)) == pytest.approx(poles(known), abs=0.05)


@pytest.mark.parametrize(("taps", "p", "q", "most"), [(8, 1, 1, 4), (9, 2, 3, 8), (2, 3, 1, 1)])
def test_order_that_no_response_shows_is_refused(taps: int, p: int, q: int, most: int) -> None:
    responses = white(random(taps, p, q))
    assert len(realize(responses, most).a) == most
    message = rf"network.order = {most + 1}; expected at most {most} .*{taps} samples: lower it"
    with pytest.raises(ValueError, match=message):
        realize(responses, most + 1)


EIGENVALUES = np.array([-0.5 + 4j, -3.0, -1.0 + 9j])


def test_eigenvalues_give_the_poles() -> None:
    found = from_eigenvalues(EIGENVALUES, STEP, (2, 3), torch.Generator().manual_seed(1))
    pairs = np.concatenate([EIGENVALUES, EIGENVALUES[[0, 2]].conj()])
    assert poles(found) == pytest.approx(np.sort_complex(np.exp(pairs * STEP)), abs=EXACT)
    assert (found.a.shape, found.b.shape, found.c.shape) == ((5, 5), (5, 2), (3, 5))
    again = from_eigenvalues(EIGENVALUES, STEP, (2, 3), torch.Generator().manual_seed(1))
    other = from_eigenvalues(EIGENVALUES, STEP, (2, 3), torch.Generator().manual_seed(2))
    assert torch.equal(found.b, again.b)
    assert torch.equal(found.c, again.c)
    assert torch.equal(found.a, again.a)
    assert torch.equal(found.a, other.a)
    assert not torch.equal(found.b, other.b)
    assert not torch.equal(found.c, other.c)


def test_states_of_pairs_and_single_eigenvalues() -> None:
    assert states_of(EIGENVALUES) == 5
    assert states_of(EIGENVALUES[1:2]) == 1


@pytest.mark.parametrize(
    ("order", "chosen"),
    [
        (1, [-3.0]),
        (3, [-3.0, -0.5 + 4j]),
        (5, [-3.0, -0.5 + 4j, -1.0 + 9j]),
        (2, None),
        (4, None),
        (6, None),
    ],
)
def test_lowest_eigenvalues_have_as_many_states_as_asked_for(
    order: int, chosen: list[complex] | None
) -> None:
    """Slow ones first, whatever their order; half a pair is none."""
    for shuffled in (EIGENVALUES, EIGENVALUES[::-1], np.roll(EIGENVALUES, 1)):
        found = lowest_eigenvalues(shuffled, order)
        assert (None if found is None else found.tolist()) == chosen
    assert lowest_eigenvalues(EIGENVALUES[:0], order) is None


BIN = 2 * math.pi / (400 * STEP)
"""Angular frequency in rad/s of one oscillation in a record."""


def sines(oscillations: float) -> torch.Tensor:
    """Two sines of so many oscillations in the record, shape (2, 400, 1)."""
    time = STEP * torch.arange(400, dtype=torch.float64)
    phases = torch.tensor([[0.0], [1.0]], dtype=torch.float64)
    return torch.sin(oscillations * BIN * time + phases)[..., None]


@pytest.mark.parametrize("oscillations", [1.0, 1.37, 6.5, 32.0, 40 / (2 * math.pi), 150.25])
@pytest.mark.parametrize("offset", [0.0, 0.2])
def test_band_ends_at_the_frequency_of_a_sine(oscillations: float, offset: float) -> None:
    """Whether it closes within the record or not: the fading widens it by two bins at most."""
    edge = band_edge(0.3 * sines(oscillations) + offset, STEP)
    assert oscillations - 0.5 < edge / BIN < oscillations + 2.5


def test_band_of_white_noise_is_all_there_is() -> None:
    assert band_edge(random(5, 400, 2), STEP) == pytest.approx(math.pi / STEP, rel=0.01)


@pytest.mark.parametrize(
    ("inputs", "chosen"),
    [
        (random(3, 400, 2), [-3.0, -0.5 + 4j, -1.0 + 9j]),
        (sines(38), [-3.0, -0.5 + 4j]),
        (sines(3), [-3.0]),
        (sines(1 / BIN), [-3.0]),
        (torch.ones(1, 400, 1, dtype=torch.float64), [-3.0]),
        (torch.zeros(1, 400, 1, dtype=torch.float64), [-3.0]),
    ],
    ids=["white", "medium", "slow", "not closed", "held", "nothing"],
)
def test_excited_eigenvalues_lie_in_the_band(inputs: torch.Tensor, chosen: list[complex]) -> None:
    """The lowest first, and at least one."""
    assert excited_eigenvalues(EIGENVALUES, inputs, STEP).tolist() == chosen


def test_poles_outside_the_circle_are_pulled_in() -> None:
    growing = np.array([0.3 + 4j, -3.0, 0.5])
    found = from_eigenvalues(growing, STEP, (1, 1), torch.Generator())
    pulled = LARGEST_POLE * np.exp(1j * 0.4)
    expected = [pulled, pulled.conjugate(), np.exp(-0.3), LARGEST_POLE]
    assert poles(found) == pytest.approx(np.sort_complex(expected), abs=EXACT)
    known = known_system(3, 1, 1, 3, radius=1.1)
    radii = np.abs(poles(realize(white(responses_of(known, 20)), 3)))
    assert np.max(radii) == pytest.approx(LARGEST_POLE, abs=EXACT)


def test_outputs_without_noise_need_less_of_a_ridge() -> None:
    known = from_eigenvalues(np.array([-2 + 5j]), STEP, (1, 1), torch.Generator().manual_seed(3))
    shape, drive = plain(2, 1, 0, 1), narrow_band(4, 800, 0.6)
    outputs, _ = simulate(shape, shape.linear(*known), drive.transpose(0, 1))
    targets = torch.cat([outputs.new_zeros(1, 4, 1), outputs]).transpose(0, 1)
    errors = []
    for noisy in (True, False):
        responses = impulse_responses(drive, drive[:, :, :0], targets, 60, noisy)
        assert (responses.inputs is None) == (not noisy)
        errors.append(float(np.abs(poles(realize(responses, 2)) - poles(known)).max()))
    assert errors[1] < 1e-6
    assert errors[1] < 0.1 * errors[0]
