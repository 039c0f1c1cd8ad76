"""Residuals weighted by the spectrum of noise: filter, normal equations, and their use."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg
import scipy.signal
import torch

from slide_fmu.core.autoregression import Autoregression
from slide_fmu.core.signals import FloatArray
from slide_fmu.fitting.state_space import normal_equations as module
from slide_fmu.fitting.state_space.cell import CellShape, simulate
from slide_fmu.fitting.state_space.fit_data import fit_data
from slide_fmu.fitting.state_space.levenberg_marquardt import Iterate
from slide_fmu.fitting.state_space.multi_start import Candidate
from slide_fmu.fitting.state_space.normal_equations import (
    BLOCK,
    normal_equations,
    sum_of_squares,
)
from slide_fmu.fitting.state_space.preconditioned_descent import _gradient
from slide_fmu.fitting.state_space.residual import learnable_share, noise_in
from slide_fmu.fitting.state_space.segments import Segments
from slide_fmu.fitting.state_space.whitening import OWN_ERROR, Filter, Whitening, _taps
from slide_fmu.recipe.learning import StateSpaceRecipe
from tests.fitting.state_space.cells import (
    FACTORS,
    READ,
    SUBSTEPS,
    TURNED,
    plain,
    random,
    random_segments,
    random_theta,
    random_weights,
    taught_segments,
)
from tests.fitting.state_space.springs import QUICK, Pair, fit, problem_of, spring
from tests.fitting.state_space.test_normal_equations import thinned_weights
from tests.fitting.state_space.test_physical_parameters import (
    BOTH,
    random_thetas,
    with_phi,
    with_terms,
)
from tests.marks import first

EXACT = 1e-10
"""Roundings of float64 in sums of some thousand products of order 1, relative to the largest."""
DEVIATIONS = 1.16, 0.87
"""About those of the spring's position, and of its change in a sample."""
SLOW, FAST = 0.98, -0.7
"""Poles of noise: a drift of some fifty samples, and one that changes its sign at each."""


def drift(samples: int, pole: float = SLOW, seed: int = 0) -> FloatArray:
    """Noise of one pole and deviation 1, (samples,)."""
    white = np.random.default_rng(seed).normal(size=samples + 1000)
    noise = scipy.signal.lfilter([math.sqrt(1 - pole**2)], [1.0, -pole], white)
    return np.asarray(noise[1000:])


def noise_of_two(samples: int = 20_000, seed: int = 0) -> FloatArray:
    """A strong drift in one output, a weak and fast noise in the other."""
    parts = 0.3 * drift(samples, SLOW, seed), 0.01 * drift(samples, FAST, 100 + seed)
    return np.stack(parts, 1)


def whitening_of(n_outputs: int) -> Whitening:
    """A whitening of outputs whose noise differs in size and colour."""
    sizes, poles = (0.3, 0.05, 0.1), (0.9, -0.6, 0.3)
    parts = [s * drift(4000, pole, 3) for s, pole in zip(sizes, poles, strict=True)]
    return Whitening.of_noise((np.stack(parts[:n_outputs], 1),))


def whitened(segments: Segments) -> Segments:
    return replace(segments, whitening=whitening_of(segments.targets.shape[2]))


def test_filtered_noise_is_white_and_of_one_size() -> None:
    whitening = Whitening.of_noise((noise_of_two(),))
    fresh = torch.from_numpy(noise_of_two(seed=5))
    found = whitening.along(fresh[:, None])[:, 0].numpy()
    assert found.std(axis=0) == pytest.approx([1.0, 1.0], abs=0.03)
    for output in found.T:
        neighbours = np.corrcoef(output[1:], output[:-1])[0, 1]
        assert abs(neighbours) < 0.03  # four deviations of chance


def test_squares_are_those_of_the_greatest_likelihood_from_the_first_sample_on() -> None:
    """r' R^-1 r with the covariance R of a segment's noise: no sample is left out."""
    model = Autoregression(np.array([[0.0], [SLOW]]), np.array([1.0, 1 - SLOW**2]))
    residuals = random(12, 1, 1, seed=4)
    found = Whitening(_taps(model, 1)[:, :, None]).along(residuals).square().sum()
    exact = residuals[:, 0, 0].numpy()
    wanted = exact @ np.linalg.solve(scipy.linalg.toeplitz(SLOW ** np.arange(12)), exact)
    assert float(found) == pytest.approx(wanted, rel=1e-9)


@pytest.mark.parametrize("sizes", [(30,), (16, 14), (1,) * 30, (3, 20, 7)])
def test_blocks_are_filtered_as_the_whole(sizes: tuple[int, ...]) -> None:
    whitening, values = whitening_of(2), random(30, 3, 2, 5)
    running = Filter(whitening)
    found = torch.cat([running.advance(part) for part in values.split(list(sizes))])
    torch.testing.assert_close(found, whitening.along(values))
    for column in range(5):
        one = whitening.along(values[..., column])
        torch.testing.assert_close(one, found[..., column])


def test_output_alone_is_filtered_as_among_others() -> None:
    whitening, values = whitening_of(2), random(30, 3, 2)
    whole = whitening.along(values)
    for k in range(2):
        alone = whitening.of_output(k).along(values[:, :, k : k + 1])
        torch.testing.assert_close(alone, whole[:, :, k : k + 1])


def test_normalised_whitening_keeps_the_mean_square_of_targets() -> None:
    targets = 0.4 * random(40, 6, 2) + 3.0
    centred = targets - targets.mean((0, 1))
    found = whitening_of(2).normalised(targets).along(centred)
    assert float(found.square().mean()) == pytest.approx(float(centred.square().mean()))


def test_equal_white_noise_changes_nothing() -> None:
    noise = 0.1 * np.random.default_rng(0).normal(size=(4000, 1))
    targets = random(40, 6, 1)
    found = Whitening.of_noise((noise,)).normalised(targets)
    assert found.taps.numel() == 1
    size = (targets - targets.mean()).std(correction=0)
    assert float(found.taps) == pytest.approx(1.0, rel=1e-12)
    assert float(size) > 0


def test_output_without_noise_is_held_to_the_error_of_a_network() -> None:
    """Its weight stays finite beside one with noise."""
    noise = np.stack([0.1 * drift(4000, 0.0), np.zeros(4000)], 1)
    taps = Whitening.of_noise((noise,)).taps
    assert float(taps[0, 0, 1]) == pytest.approx(1 / OWN_ERROR)
    assert float(taps[0, 0, 0]) == pytest.approx(10.0, rel=0.05)


def residuals_of(shape: CellShape, theta: torch.Tensor, segments: Segments) -> torch.Tensor:
    """Weighted residuals (scored, B, p), filtered by plain loops."""
    outputs, _ = simulate(shape, theta, segments.features, segments.phi)
    left = segments.weights[:, None] * (outputs[segments.burn_in :] - segments.targets)
    assert segments.whitening is not None
    taps, rows = segments.whitening.taps, []
    for k in range(len(left)):
        known = min(k, len(taps) - 1)
        rows.append(sum(taps[known, age] * left[k - age] for age in range(known + 1)))
    return torch.stack(rows)  # type: ignore[arg-type]


@pytest.mark.parametrize("shape", [plain(3, 2, 4, 2), FACTORS, SUBSTEPS, READ, TURNED])
@pytest.mark.parametrize("terms", [False, True])
@pytest.mark.parametrize("thin", first([4, 1]))
def test_normal_equations_are_those_of_filtered_residuals(
    monkeypatch: pytest.MonkeyPatch, shape: CellShape, terms: bool, thin: int
) -> None:
    """Over several blocks and chunks, with weights, and cells that physical parameters set."""
    segments = whitened(random_weights(random_segments(shape, 5, 2 * BLOCK + 3, 10)))
    theta = random_theta(shape, 2)
    if terms:
        shape, segments = with_terms(shape, BOTH), with_phi(segments, BOTH, 1)
        theta = random_thetas(shape, 2)
    monkeypatch.setattr(module, "thinning", lambda shape, segments: thin)
    monkeypatch.setitem(module.SENSITIVITIES, "cpu", 1)  # chunks of eight segments
    found = normal_equations(shape, theta, segments)

    variable = theta.clone().requires_grad_()
    residuals = residuals_of(shape, variable, segments)
    half = 0.5 * residuals.square().sum()
    (gradient,) = torch.autograd.grad(half, variable, retain_graph=True)
    assert float((found.gradient - gradient).abs().max() / gradient.abs().max()) < EXACT
    assert found.cost == pytest.approx(2 * float(half.detach()), rel=EXACT)
    assert sum_of_squares(shape, theta, segments) == pytest.approx(found.cost, rel=EXACT)

    # columns of J as derivatives of J'w by w: there are fewer of them than rows
    w = torch.zeros_like(residuals, requires_grad=True)
    (product,) = torch.autograd.grad(residuals, variable, w, create_graph=True)
    unit = torch.eye(len(theta), dtype=theta.dtype)
    (columns,) = torch.autograd.grad(product, w, unit, is_grads_batched=True)
    counts = thinned_weights(len(residuals), thin).sqrt()[:, None, None]
    j = (counts * columns).flatten(1)
    assert float((found.matrix - j @ j.T).abs().max() / found.matrix.abs().max()) < EXACT


def test_gradient_of_large_cells_is_that_of_filtered_residuals() -> None:
    shape = plain(3, 1, 4, 2)
    segments, theta = whitened(random_segments(shape, 5, 30, 6)), random_theta(shape)
    cost, gradient = _gradient(shape, theta, segments, 1.0)
    found = normal_equations(shape, theta, segments)
    count = segments.targets.numel()
    assert cost == pytest.approx(found.cost / count, rel=EXACT)
    torch.testing.assert_close(gradient, found.gradient / count)


def test_parts_of_segments_keep_the_whitening() -> None:
    shape = plain(2, 1, 2, 1)
    segments = whitened(random_segments(shape, 3, 20, 6))
    others = random_segments(shape, 3, 20, 2)
    parts = [
        segments.every(2),
        *segments.chunks(4),
        segments.evened_out(),
        segments.and_others(others, 0.5),
    ]
    assert all(part.whitening is segments.whitening for part in parts)


def test_noise_in_an_error_is_found_though_it_is_coloured() -> None:
    """What the flat bottom of a drift's spectrum hides, the filter brings back."""
    shape = plain(2, 1, 2, 1)
    segments, theta = taught_segments(shape, 1, 64), random_theta(shape, 99)
    noise = 0.3 * drift(len(segments.targets) * segments.count, 0.9)
    targets = segments.targets + torch.from_numpy(noise.reshape(-1, 64, 1, order="F").copy())
    noisy = replace(segments, targets=targets)
    errors = []
    for whitening in (None, Whitening.of_noise((0.3 * drift(8000, 0.9, 7)[:, None],))):
        data = replace(noisy, whitening=whitening)
        squares = sum_of_squares(shape, theta, data) / data.counted
        candidate = Candidate(shape, Iterate(theta, theta, math.sqrt(squares)))
        errors.append(noise_in(candidate, data) / math.sqrt(squares))
    assert errors[0] == 0.0  # it seems to be the network's own error
    assert errors[1] == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("hidden", [False, True])
def test_what_could_still_be_learnt_is_found_beside_a_loud_output(hidden: bool) -> None:
    """The second output lacks a part of the network's answer; the first one is all noise."""
    shape = plain(2, 1, 3, 2)
    theta, segments = random_theta(shape, 99), taught_segments(shape, 1, 64)
    loud = 3.0 * random(*segments.targets.shape[:2], seed=8)
    targets = torch.stack([segments.targets[:, :, 0] + loud, 1.2 * segments.targets[:, :, 1]], 2)
    data = replace(segments, targets=targets)
    noise = np.stack([3.0 * drift(4000, 0.0), 1e-3 * drift(4000, 0.0, 1)], 1)
    if not hidden:
        data = replace(data, whitening=Whitening.of_noise((noise,)).normalised(targets))
    share = learnable_share(shape, theta, [data])
    assert (share < 0.05) if hidden else (share > 0.9)


def position_and_speed(seed: int, samples: int) -> Pair:
    """Four records of the spring, whose outputs have deviations of about 1."""
    inputs, outputs = spring(seed, 4, samples)
    outputs = torch.cat([outputs, torch.diff(outputs, dim=1, prepend=outputs[:, :1])], 2)
    return inputs, outputs / torch.tensor(DEVIATIONS)


def measured(seed: int, samples: int) -> Pair:
    """The position with a drift, the speed with hardly any noise."""
    inputs, outputs = position_and_speed(seed, samples)
    noise = noise_of_two(4 * (samples + 1), seed).reshape(4, samples + 1, 2)
    return inputs, outputs + torch.from_numpy(noise)


@pytest.mark.extended
def test_known_spectrum_of_noise_makes_a_fit_more_accurate(tmp_path: Path) -> None:
    """Beside the truth, about the mean, which a drift hides; the noise is of another time."""
    records = {"training": measured(1, 400), "validation": measured(2, 200)}
    inputs, truth = (part.numpy() for part in position_and_speed(3, 400))
    errors = []
    for noise in (None, (noise_of_two(2000, 9),)):
        problem = problem_of(tmp_path / str(noise is None), 0.0, noise=noise, **records)
        network = fit(problem, {"order": 2, "hidden": 0}).network
        left = (network.stream(inputs) - truth[:, 1:])[:, network.n_samples :]
        errors.append(left.std(axis=(0, 1)))
    assert (errors[1] < np.array([0.6, 0.3]) * errors[0]).all()


def test_segments_of_a_problem_with_noise_have_its_whitening(tmp_path: Path) -> None:
    recipes = StateSpaceRecipe(order=2, hidden=2), QUICK
    data = fit_data(problem_of(tmp_path), *recipes)
    parts = ("whole", "part", "validation")
    assert all(getattr(data, part).whitening is None for part in parts)
    data = fit_data(problem_of(tmp_path, noise=(0.1 * drift(2000)[:, None],)), *recipes)
    assert all(getattr(data, part).whitening is data.whole.whitening for part in parts)
    centred = data.whole.targets - data.whole.targets.mean((0, 1))
    kept = data.whole.whitened(centred).square().mean()
    assert float(kept) == pytest.approx(float(centred.square().mean()))
