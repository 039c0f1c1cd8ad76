"""Other coordinates, more states, more units: the outputs stay."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch
from cells import random, random_features, random_segments, random_theta

from slide_fmu.learn.cell import CellShape, simulate
from slide_fmu.learn.coordinates import PAD_GAIN, PAD_POLE, rescale, widen
from slide_fmu.learn.normal_equations import normal_equations

SAME = 1e-10
"""Roundings of float64 in outputs of order 1."""
SINGLE = 1e-4
"""Those of float32, along a record and in states that depend on each other."""


def generator(seed: int = 0) -> torch.Generator:
    return torch.Generator().manual_seed(seed)


@pytest.mark.parametrize("whiten", [False, True])
@pytest.mark.parametrize("units", ["tanh", "cubic"])
@pytest.mark.parametrize("bias", [False, True])
@pytest.mark.parametrize("n_units", [0, 4])
def test_rescaled_states_answer_alike(whiten: bool, units: str, bias: bool, n_units: int) -> None:
    shape = CellShape(3, 2, n_units, 2, units, bias)
    theta, features = random_theta(shape), random_features(40, 5, shape)
    outputs, states = simulate(shape, theta, features)
    m = rescale(shape.split(theta), states, whiten)
    found, rescaled = simulate(shape, shape.join(m), features)
    torch.testing.assert_close(found, outputs, rtol=0, atol=SAME)
    flat = rescaled.reshape(-1, 3)
    covariance = flat.T @ flat / len(flat)
    torch.testing.assert_close(covariance.diagonal(), torch.ones(3).double(), rtol=0, atol=1e-8)
    apart = covariance - torch.diag(covariance.diagonal())
    assert (float(apart.abs().max()) < 1e-8) == whiten


@pytest.mark.parametrize("whiten", [False, True])
def test_a_state_that_never_moves_makes_no_trouble(whiten: bool) -> None:
    shape = CellShape(3, 1, 0, 1)
    m = shape.split(random_theta(shape))
    still = m.f.clone()
    still[1] = 0
    theta, features = shape.join(replace(m, f=still)), random_features(40, 5, shape)
    outputs, states = simulate(shape, theta, features)
    assert not states[:, :, 1].any()
    found, _ = simulate(shape, shape.join(rescale(shape.split(theta), states, whiten)), features)
    torch.testing.assert_close(found, outputs, rtol=0, atol=SAME)


DECADES = torch.tensor([1.0, 3e-3, 1e-5])
"""Units of states that lie five decades apart."""


@pytest.mark.parametrize("whiten", [False, True])
def test_single_precision_states_of_very_different_size_are_rescaled(whiten: bool) -> None:
    shape = CellShape(3, 2, 4, 2)
    m, n = shape.split(random_theta(shape, 2)), 3
    f, w = m.f.clone(), m.w.clone()
    f[:, :n] = f[:, :n] / DECADES
    w[:, :n] = w[:, :n] / DECADES
    apart = replace(m, f=DECADES[:, None] * f, w=w, c=m.c / DECADES)
    theta, features = shape.join(apart).float(), random_features(60, 5, shape).float()
    outputs, states = simulate(shape, theta, features)
    spread = states.flatten(0, 1).std(0)
    assert float(spread.max() / spread.min()) > 1e4
    found, moved = simulate(
        shape, shape.join(rescale(shape.split(theta), states, whiten)), features
    )
    assert found.dtype == torch.float32
    torch.testing.assert_close(found, outputs, rtol=0, atol=SINGLE)
    flat = moved.flatten(0, 1).double()
    covariance = flat.T @ flat / len(flat)
    torch.testing.assert_close(covariance.diagonal(), torch.ones(3).double(), rtol=0, atol=SINGLE)
    if whiten:
        torch.testing.assert_close(covariance, torch.eye(3).double(), rtol=0, atol=SINGLE)


CELLS = [
    (CellShape(2, 1, 0, 1), CellShape(4, 1, 6, 1)),
    (CellShape(3, 2, 4, 2), CellShape(3, 2, 9, 2)),
    (CellShape(3, 2, 4, 2, "cubic", False), CellShape(7, 2, 5, 2, "cubic", False)),
    (CellShape(2, 2, 3, 1), CellShape(2, 2, 3, 1)),
]


@pytest.mark.parametrize(("old", "new"), CELLS)
def test_widened_cell_answers_alike(old: CellShape, new: CellShape) -> None:
    theta, features = random_theta(old), random_features(40, 5, old)
    wide = widen(old.split(theta), old, new, generator())
    assert wide.shape == (new.n_parameters,)
    outputs, states = simulate(old, theta, features)
    found, more = simulate(new, wide, features)
    torch.testing.assert_close(found, outputs, rtol=0, atol=SAME)
    torch.testing.assert_close(more[:, :, : old.n_states], states, rtol=0, atol=SAME)


@pytest.mark.parametrize(("old", "new"), CELLS)
def test_added_states_are_short_memories_of_the_features(old: CellShape, new: CellShape) -> None:
    """x[k+1] = PAD_POLE x[k] + PAD_GAIN f[k], each state of another feature in turn."""
    features = random_features(40, 5, old)
    wide = widen(old.split(random_theta(old)), old, new, generator())
    _, states = simulate(new, wide, features)
    held = torch.zeros(5, dtype=torch.float64)
    for added in range(new.n_states - old.n_states):
        held = torch.zeros(5, dtype=torch.float64)
        for k in range(40):
            held = PAD_POLE * held + PAD_GAIN * features[k, :, added % old.n_features]
        torch.testing.assert_close(states[-1, :, old.n_states + added], held, rtol=0, atol=SAME)
    assert 0 < PAD_POLE < 1


def test_added_units_can_be_learnt_and_differ_by_seed() -> None:
    """They act on nothing yet, but their arguments are random: the cost depends on E."""
    old, new = CellShape(2, 1, 0, 1), CellShape(4, 1, 5, 1)
    m = old.split(random_theta(old))
    wide = widen(m, old, new, generator())
    gradient = normal_equations(new, wide, random_segments(new, 4, 30, 5)).gradient
    of_e = new.split(gradient).f[: old.n_states, new.n_states + 1 :]
    assert torch.all(of_e != 0)
    assert torch.equal(wide, widen(m, old, new, generator()))
    assert not torch.equal(wide, widen(m, old, new, generator(1)))
    arguments = new.split(widen(m, old, new, generator(1))).w
    assert float(arguments.square().sum(1).mean()) == pytest.approx(1.0, rel=0.8)


def test_widening_keeps_the_precision() -> None:
    old, new = CellShape(2, 1, 0, 1), CellShape(4, 1, 5, 1)
    single = old.split(random_theta(old).float())
    assert widen(single, old, new, generator()).dtype == torch.float32
    assert rescale(single, random(30, 2).float(), True).f.dtype == torch.float32
