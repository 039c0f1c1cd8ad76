"""Small cells and segments for the tests of the state-space fit."""

from __future__ import annotations

import math
from dataclasses import fields, replace

import numpy as np
import torch

from slide_fmu.core.signals import FloatArray
from slide_fmu.features.differences import Differences
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.fitting.state_space.cell import CellShape, simulate
from slide_fmu.fitting.state_space.segments import Segments
from slide_fmu.network.state_space.cell import Cell, Roles
from slide_fmu.network.state_space.network import StateSpace
from tests.plain_cell import PlainCell


def random(*shape: int, seed: int = 0) -> torch.Tensor:
    """Normal random numbers, float64."""
    generator = torch.Generator().manual_seed(seed)
    return torch.randn(*shape, generator=generator, dtype=torch.float64)


def plain(
    n_states: int,
    n_features: int,
    n_units: int,
    n_outputs: int,
    units: str = "tanh",
    bias: bool = True,
) -> CellShape:
    """A cell that every feature drives and whose outputs follow every feature."""
    every = tuple(range(n_features))
    return CellShape(n_states, n_units, n_outputs, Roles(every, every), units, bias)


SUBSTEPS = CellShape(3, 2, 2, Roles((0, 1), (1,)), "cubic", substeps=3)
FACTORS = CellShape(5, 3, 2, Roles((0, 1), (2,), readout=(2, 0)), "cubic")
"""A plain cell with features of its own for every role."""
GATED = CellShape(4, 3, 1, Roles((0, 1), (0, 1), gated=(0, 1), schedule=(2,)), "gated")
READ = CellShape(5, 3, 2, Roles((0, 1), (2,), (1, 3), (4, 5), (0,)), "gated")
TURNED = CellShape(
    6, 3, 2, Roles((0, 1), (2,), (1, 3), (4, 5), (0, 3), turn=(6, 7)), "gated", turned=2
)
ALL_TURNED = replace(TURNED, n_states=4)
"""All states are turned."""
NO_UNITS = replace(TURNED, n_units=0)
GATED_SHAPES = [GATED, READ, TURNED, ALL_TURNED, NO_UNITS]


def count_features(shape: CellShape) -> int:
    """Number of features that a cell needs."""
    return shape.roles.highest() + 1


def random_theta(shape: CellShape, seed: int = 0) -> torch.Tensor:
    """Parameters of a cell that stays small: rows of norm 0.5 or so."""
    cell = shape.split(random(shape.n_parameters, seed=seed))
    parts = {
        **{name: 0.5 * getattr(cell, name) / math.sqrt(shape.n_next) for name in "abe"},
        "w": 0.7 * cell.w / math.sqrt(cell.w.shape[1]),
        "v": None if cell.v is None else 0.7 * cell.v / math.sqrt(cell.v.shape[1]),
    }
    return shape.join(replace(cell, **parts))


def random_features(samples: int, batch: int, shape: CellShape, seed: int = 0) -> torch.Tensor:
    """Features of a few parts of one, (samples, batch, q); those of a turn at random angles."""
    features = 0.6 * random(samples, batch, count_features(shape), seed=seed)
    if shape.roles.turn:
        cosine, sine = shape.roles.turn
        angles = 2 * math.pi * features[..., cosine]
        features[..., cosine], features[..., sine] = angles.cos(), angles.sin()
    return features


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


def plain_cell(shape: CellShape, theta: torch.Tensor) -> PlainCell:
    """The cell of a parameter vector, cut by hand, for the plain loops."""
    roles, p, at = shape.roles, shape.n_outputs, 0
    values, n, q = theta.numpy().astype(np.float64), shape.n_states, len(roles.drive)
    rows = p * (1 + len(roles.readout))
    seen = len(roles.schedule) if shape.gated else n + q

    def take(rows: int, columns: int) -> FloatArray:
        nonlocal at
        part = values[at : at + rows * columns].reshape(rows, columns)
        at += rows * columns
        return part

    f = take(n, n + q + shape.n_units)
    w = take(shape.n_units, seen + shape.bias)
    v = take(shape.n_units, n + len(roles.gated)) if shape.gated else None
    c, d = take(rows, n), take(rows, len(roles.static))
    d0 = take(1, rows)[0] if shape.bias else np.zeros(rows)
    if not shape.bias:
        w = np.concatenate([w, np.zeros((shape.n_units, 1))], 1)
    assert at == len(values)
    matrices = (f[:, :n], f[:, n : n + q], f[:, n + q :], w, c, d, d0)
    return PlainCell(*matrices, shape.units, v, roles, shape.turned, shape.substeps)


def numpy_network(shape: CellShape, theta: torch.Tensor) -> StateSpace:
    """The network of the same weights that slide_fmu.network.state_space evaluates."""
    plain = plain_cell(shape, theta)
    parts = {field.name: getattr(plain, field.name) for field in fields(Cell)}
    parts = {
        name: part.astype(np.float32) if isinstance(part, np.ndarray) else part
        for name, part in parts.items()
    }
    features = FeatureMap(Differences(count_features(shape)))
    return StateSpace(Cell(**parts), 1, 1, features, shape.roles, shape.turned)
