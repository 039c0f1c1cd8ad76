"""Sections of two states give the same sums as the cell that they make up."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import Window
from slide_fmu.fitting.state_space import modal_fit
from slide_fmu.fitting.state_space.cell import CellShape, simulate
from slide_fmu.fitting.state_space.levenberg_marquardt import Iterate, LeastSquares, advance
from slide_fmu.fitting.state_space.modal_fit import ModalFit, Sections, has_sections, with_best
from slide_fmu.fitting.state_space.normal_equations import (
    NormalEquations,
    normal_equations,
    sum_of_squares,
)
from slide_fmu.fitting.state_space.penalties import PolePenalty
from slide_fmu.fitting.state_space.segments import Segments
from slide_fmu.fitting.state_space.whitening import Whitening
from slide_fmu.network.state_space.cell import Roles
from tests.fitting.state_space.cells import random

ROUNDING = 1e-9
"""Of sums, relative to the largest of them."""
POLES = {
    "pairs": (0.9 * np.exp(0.5j), 0.8 * np.exp(1.5j)),
    "odd": (0.9 * np.exp(0.5j), 0.6),
    "real": (0.9, 0.6, -0.5, 0.3),
    "one": (0.7,),
    "mixed": (0.9 * np.exp(0.5j), 0.8, 0.3, -0.4),
}
"""Poles of cells, one of each conjugate pair."""


def matrix_of(poles: tuple[complex, ...]) -> FloatArray:
    """A full matrix with these poles."""
    blocks = [
        np.array([[p.real, p.imag], [-p.imag, p.real]])
        if np.iscomplex(p)
        else np.array([[p.real]])
        for p in map(complex, poles)
    ]
    n = sum(map(len, blocks))
    a, first = np.zeros((n, n)), 0
    for block in blocks:
        a[first : first + len(block), first : first + len(block)] = block
        first += len(block)
    change = random(n, n, seed=1).numpy() + 2 * np.eye(n)
    return np.asarray(np.linalg.solve(change, a @ change))


def shape_of(n: int, bias: bool = True) -> CellShape:
    return CellShape(n, 0, 2, Roles((0, 1, 2), (1,)), bias=bias)


def theta_of(shape: CellShape, a: FloatArray) -> torch.Tensor:
    theta = random(shape.n_parameters, seed=2)
    shape.split(theta).a[:] = torch.from_numpy(a)
    return theta


def segments_of(whitening: bool = False) -> Segments:
    noise = np.cumsum(np.random.default_rng(4).normal(size=(500, 2)), axis=0)
    return Segments(
        random(40, 5, 3, seed=5),
        random(30, 5, 2, seed=6),
        torch.linspace(0.5, 1.5, 5, dtype=torch.float64),
        whitening=Whitening.of_noise([noise]) if whitening else None,
    )


def fit_of(
    shape: CellShape, theta: torch.Tensor, segments: Segments, penalty: PolePenalty
) -> ModalFit:
    def cost(values: torch.Tensor) -> float:
        return sum_of_squares(shape, values, segments) + penalty.cost(shape, values)

    of_cell = LeastSquares(
        lambda values: normal_equations(shape, values, segments), cost, segments.counted, cost
    )
    return ModalFit(shape, segments, Sections.of_cell(shape, theta), penalty, of_cell)


@pytest.mark.parametrize("poles", POLES.values(), ids=POLES.keys())
@pytest.mark.parametrize("bias", [True, False])
def test_sections_have_the_outputs_of_their_cell(poles: tuple[complex, ...], bias: bool) -> None:
    a = matrix_of(poles)
    shape = shape_of(len(a), bias)
    theta, features = theta_of(shape, a), segments_of().features
    again = Sections.of_cell(shape, theta).theta(shape)
    outputs, _ = simulate(shape, theta, features)
    torch.testing.assert_close(simulate(shape, again, features)[0], outputs, rtol=0, atol=1e-8)


@pytest.mark.parametrize("poles", POLES.values(), ids=POLES.keys())
@pytest.mark.parametrize("whitening", [False, True])
@pytest.mark.parametrize("radius", [1.0, 0.75])
def test_sums_are_those_of_the_cell(
    poles: tuple[complex, ...],
    whitening: bool,
    radius: float,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """With the slopes of the cell's parameters, whatever the chunks; the penalty counts, too."""
    monkeypatch.setattr(modal_fit, "CHUNK", 2000)
    a, segments = matrix_of(poles), segments_of(whitening)
    shape = shape_of(len(a))
    penalty = PolePenalty(radius, 100)
    fit = fit_of(shape, theta_of(shape, a), segments, penalty)
    values = fit.first
    found = fit.least_squares().normal(values)
    theta = fit.theta(values)
    expected = penalty.join(normal_equations(shape, theta, segments), shape, theta)
    step, slopes = 1e-6, []
    for unit in torch.eye(len(values), dtype=torch.float64):
        both = fit.theta(values + step * unit), fit.theta(values - step * unit)
        slopes.append((both[0] - both[1]) / (2 * step))
    slope = torch.stack(slopes, 1)
    assert found.cost == pytest.approx(expected.cost, rel=ROUNDING)
    gradient, matrix = slope.T @ expected.gradient, slope.T @ expected.matrix @ slope
    scale = float(gradient.abs().max())
    torch.testing.assert_close(found.gradient, gradient, rtol=0, atol=ROUNDING * scale)
    scale = float(matrix.abs().max())
    torch.testing.assert_close(found.matrix, matrix, rtol=0, atol=ROUNDING * scale)


@pytest.mark.parametrize("to_pair", [True, False])
def test_real_poles_may_become_a_pair_and_back(to_pair: bool) -> None:
    real, pair = matrix_of((0.8, 0.7)), matrix_of((0.75 * np.exp(0.3j),))
    truth, start = (pair, real) if to_pair else (real, pair)
    shape, segments = shape_of(2), segments_of()
    wanted, _ = simulate(shape, theta_of(shape, truth), segments.features)
    segments = replace(segments, targets=wanted[segments.burn_in :])
    fit = fit_of(shape, theta_of(shape, start), segments, PolePenalty.of(Window(0.1, 40, 1), 1, 1))
    problem = fit.least_squares()
    values = fit.with_best_inputs()
    assert problem.cost(values) <= problem.cost(fit.first)
    state = Iterate.begin(values, problem)
    for _ in range(60):
        state = advance(state, problem)
    poles = np.linalg.eigvals(shape.split(fit.theta(state.best)).a.numpy())
    assert np.sort_complex(poles) == pytest.approx(np.sort_complex(np.linalg.eigvals(truth)))


def test_delays_have_no_sections() -> None:
    """Their poles are all zero, and their eigenvectors parallel."""
    assert has_sections(matrix_of(POLES["mixed"]))
    assert not has_sections(np.diag([1.0, 1.0], 1) + 0.5 * np.eye(3))
    assert not has_sections(np.diag([0.9, 0.01]))


def test_poles_outside_the_circle_are_pulled_in() -> None:
    a = matrix_of((1.2 * np.exp(0.4j), 0.5))
    sections = Sections.of(a, np.zeros((3, 3)), np.ones((2, 3)), np.zeros((2, 2)), 0.95)
    radii = np.abs(np.linalg.eigvals(shape_of(3).split(sections.theta(shape_of(3))).a.numpy()))
    assert np.sort(radii) == pytest.approx([0.5, 0.95, 0.95])


def test_effects_that_are_hardly_told_apart_do_not_cancel() -> None:
    """The smallest error, of two nearly equal columns, would have the effects 1000 and -999."""
    slow = np.sin(0.01 * np.arange(400))
    columns = np.stack([slow, slow + 1e-3 * np.cos(np.arange(400))], axis=1)
    outputs = columns @ np.array([1000.0, -999.0])
    matrix, gradient = (torch.from_numpy(columns.T @ part) for part in (columns, -outputs))
    normal = NormalEquations(0.0, matrix, gradient)
    best = with_best(torch.zeros(2).double(), torch.ones(2, dtype=torch.bool), normal)
    assert float(best.abs().max()) < 3.0
    assert float(best.sum()) == pytest.approx(1.0, abs=0.01)
