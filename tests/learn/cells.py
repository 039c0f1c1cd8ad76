"""Small cells and segments for the tests of the state-space fit."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import torch
from hypothesis import strategies as st

from slide_fmu.learn.cell import CellShape, simulate
from slide_fmu.learn.segments import Segments
from slide_fmu.state_space import Cell, StateSpace


def random(*shape: int, seed: int = 0) -> torch.Tensor:
    """Normal random numbers, float64."""
    generator = torch.Generator().manual_seed(seed)
    return torch.randn(*shape, generator=generator, dtype=torch.float64)


def random_theta(shape: CellShape, seed: int = 0) -> torch.Tensor:
    """Parameters of a cell that stays small: rows of norm 0.5 or so."""
    m = shape.split(random(shape.n_parameters, seed=seed))
    parts = replace(
        m,
        f=0.5 * m.f / math.sqrt(shape.n_next),
        w=0.7 * m.w / math.sqrt(shape.n_arguments),
    )
    return shape.join(parts)


def random_features(samples: int, batch: int, shape: CellShape, seed: int = 0) -> torch.Tensor:
    """Features of a few parts of one, (samples, batch, q)."""
    return 0.6 * random(samples, batch, shape.n_features, seed=seed)


def random_segments(
    shape: CellShape, burn_in: int, scored: int, batch: int, seed: int = 0
) -> Segments:
    """Segments whose targets have nothing to do with the features."""
    features = random_features(burn_in + scored, batch, shape, seed)
    targets = random(scored, batch, shape.n_outputs, seed=seed + 1)
    return Segments(features, targets, torch.ones(batch, dtype=torch.float64))


def random_weights(segments: Segments, seed: int = 0) -> Segments:
    """The segments with factors of their own on the residuals, from 0.05 to 2."""
    factors = np.random.default_rng(seed).uniform(0.05, 2.0, segments.count)
    return replace(segments, weights=torch.from_numpy(factors))


def taught_segments(shape: CellShape, seed: int, batch: int = 24, noise: float = 0.0) -> Segments:
    """Segments whose targets are what a cell of the shape answers."""
    features = random_features(24, batch, shape, seed)
    outputs, _ = simulate(shape, random_theta(shape, 99), features)
    targets = outputs[8:]
    targets = targets + noise * random(*targets.shape, seed=seed + 1)
    return Segments(features, targets, torch.ones(batch, dtype=torch.float64))


@st.composite
def cell_shapes(draw: st.DrawFn) -> CellShape:
    """Shapes of small cells, with and without units and constant terms."""
    return CellShape(
        draw(st.integers(1, 4)),
        draw(st.integers(1, 3)),
        draw(st.integers(0, 4)),
        draw(st.integers(1, 3)),
        draw(st.sampled_from(["tanh", "cubic"])),
        draw(st.booleans()),
    )


def numpy_network(shape: CellShape, theta: torch.Tensor) -> StateSpace:
    """The network of the same weights that slide_fmu.state_space evaluates."""
    values, n, q, at = theta.numpy().astype(np.float32), shape.n_states, shape.n_features, 0

    def take(rows: int, columns: int) -> np.ndarray:
        nonlocal at
        part = values[at : at + rows * columns].reshape(rows, columns)
        at += rows * columns
        return part

    f = take(n, n + q + shape.n_units)
    w = take(shape.n_units, n + q + shape.bias)
    c, d = take(shape.n_outputs, n), take(shape.n_outputs, q)
    d0 = take(1, shape.n_outputs)[0] if shape.bias else np.zeros(shape.n_outputs, np.float32)
    if not shape.bias:
        w = np.concatenate([w, np.zeros((shape.n_units, 1), np.float32)], 1)
    assert at == len(values)
    cell = Cell(f[:, :n], f[:, n : n + q], f[:, n + q :], w, c, d, d0, shape.units)
    return StateSpace(cell, 1, 1, q)
