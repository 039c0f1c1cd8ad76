"""Other coordinates, more states, more units: the outputs stay."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch

from slide_fmu.fitting.state_space.cell import CellShape, simulate
from slide_fmu.fitting.state_space.coordinates import (
    PAD_GAIN,
    PAD_POLE,
    balanced,
    in_substeps,
    rescale,
    widen,
)
from slide_fmu.fitting.state_space.normal_equations import normal_equations
from tests.fitting.state_space.cells import (
    FACTORS,
    GATED_SHAPES,
    TURNED,
    plain,
    random,
    random_features,
    random_segments,
    random_theta,
)
from tests.refusals import refused

SAME = 1e-10
"""Roundings of float64 in outputs of order 1."""
SINGLE = 1e-4
"""Those of float32, along a record and in states that depend on each other."""


def generator(seed: int = 0) -> torch.Generator:
    return torch.Generator().manual_seed(seed)


@pytest.mark.parametrize("whiten", [False, True])
@pytest.mark.parametrize("units", ["tanh", "cubic", "mixed"])
@pytest.mark.parametrize("bias", [False, True])
@pytest.mark.parametrize("n_units", [0, 4])
def test_rescaled_states_answer_alike(whiten: bool, units: str, bias: bool, n_units: int) -> None:
    check_rescaled(plain(3, 2, n_units, 2, units, bias), whiten)


@pytest.mark.parametrize("whiten", [False, True])
@pytest.mark.parametrize(
    "shape", [FACTORS, *(shape for shape in GATED_SHAPES if not shape.turned)]
)
def test_rescaled_states_of_gated_cells_and_cells_with_factors_answer_alike(
    whiten: bool, shape: CellShape
) -> None:
    check_rescaled(shape, whiten)


@pytest.mark.parametrize("whiten", [False, True])
def test_linear_cells_that_will_have_turned_pairs_are_rescaled(whiten: bool) -> None:
    """A start is rescaled before it has units; later the pairs would not turn as before."""
    check_rescaled(replace(TURNED, n_states=4, n_units=0), whiten)


def test_cells_whose_units_see_turned_pairs_are_not_rescaled() -> None:
    states = random(30, TURNED.n_states)
    message = (
        rf"^cell with {TURNED.n_units} units and {TURNED.turned} turned pairs; .* before units"
    )
    with pytest.raises(ValueError, match=message):
        rescale(TURNED, TURNED.split(random_theta(TURNED)), states, False)


def check_rescaled(shape: CellShape, whiten: bool) -> None:
    """Outputs stay; states have unit standard deviation, and are uncorrelated if whitened."""
    theta, features = random_theta(shape), random_features(40, 5, shape)
    outputs, states = simulate(shape, theta, features)
    m = rescale(shape, shape.split(theta), states, whiten)
    found, rescaled = simulate(shape, shape.join(m), features)
    torch.testing.assert_close(found, outputs, rtol=0, atol=SAME)
    flat = rescaled.reshape(-1, shape.n_states)
    covariance = flat.T @ flat / len(flat)
    ones = torch.ones(shape.n_states).double()
    torch.testing.assert_close(covariance.diagonal(), ones, rtol=0, atol=1e-8)
    apart = covariance - torch.diag(covariance.diagonal())
    assert (float(apart.abs().max()) < 1e-8) == whiten


@pytest.mark.parametrize("whiten", [False, True])
def test_a_state_that_never_moves_makes_no_trouble(whiten: bool) -> None:
    shape = plain(3, 1, 0, 1)
    m = shape.split(random_theta(shape))
    for part in (m.a, m.b, m.e):
        part[1] = 0
    theta, features = shape.join(m), random_features(40, 5, shape)
    outputs, states = simulate(shape, theta, features)
    assert not states[:, :, 1].any()
    found, _ = simulate(
        shape, shape.join(rescale(shape, shape.split(theta), states, whiten)), features
    )
    torch.testing.assert_close(found, outputs, rtol=0, atol=SAME)


DECADES = torch.tensor([1.0, 3e-3, 1e-5])
"""Units of states that lie five decades apart."""


@pytest.mark.parametrize("whiten", [False, True])
def test_single_precision_states_of_very_different_size_are_rescaled(whiten: bool) -> None:
    shape = plain(3, 2, 4, 2)
    m, n = shape.split(random_theta(shape, 2)), 3
    w, sizes = m.w.clone(), DECADES[:, None]
    w[:, :n] = w[:, :n] / DECADES
    apart = replace(m, a=sizes * m.a / DECADES, b=sizes * m.b, e=sizes * m.e, w=w, c=m.c / DECADES)
    theta, features = shape.join(apart).float(), random_features(60, 5, shape).float()
    outputs, states = simulate(shape, theta, features)
    spread = states.flatten(0, 1).std(0)
    assert float(spread.max() / spread.min()) > 1e4
    found, moved = simulate(
        shape, shape.join(rescale(shape, shape.split(theta), states, whiten)), features
    )
    assert found.dtype == torch.float32
    torch.testing.assert_close(found, outputs, rtol=0, atol=SINGLE)
    flat = moved.flatten(0, 1).double()
    covariance = flat.T @ flat / len(flat)
    torch.testing.assert_close(covariance.diagonal(), torch.ones(3).double(), rtol=0, atol=SINGLE)
    if whiten:
        torch.testing.assert_close(covariance, torch.eye(3).double(), rtol=0, atol=SINGLE)


@pytest.mark.parametrize("bias", [False, True])
def test_balanced_states_answer_alike_and_move_as_much_as_they_show(bias: bool) -> None:
    shape = plain(4, 2, 0, 2, bias=bias)
    theta, segments = random_theta(shape), random_segments(shape, 40, 60, 5)
    found = balanced(shape, theta, segments)
    outputs, _ = simulate(shape, theta, segments.features)
    again, states = simulate(shape, found, segments.features)
    torch.testing.assert_close(again, outputs, rtol=0, atol=SAME)
    flat, cell = states.flatten(0, 1), shape.split(found)
    powers = [cell.c @ torch.linalg.matrix_power(cell.a, k) for k in range(200)]
    moved, shown = flat.T @ flat / len(flat), sum(part.T @ part for part in powers)
    torch.testing.assert_close(moved, torch.diag(moved.diagonal()), rtol=0, atol=1e-9)
    torch.testing.assert_close(moved, shown, rtol=0, atol=1e-9)


def test_balanced_states_do_not_magnify_rounding() -> None:
    """Two states that are nearly the same, and nearly cancel, lose digits of float32."""
    shape = plain(2, 1, 0, 1)
    cell = shape.split(random_theta(shape))
    a = torch.diag(torch.tensor([0.9, 0.9 - 1e-5]).double())
    ones, apart = torch.ones(2, 1).double(), torch.tensor([[1e5, -1e5]]).double()
    theta = shape.join(replace(cell, a=a, b=ones, c=apart, d=0 * cell.d))
    segments, errors = random_segments(shape, 40, 60, 5), []
    outputs, _ = simulate(shape, theta, segments.features)
    for each in (theta, balanced(shape, theta, segments)):
        single, _ = simulate(shape, each.float(), segments.features.float())
        errors.append(float((single.double() - outputs).abs().max() / outputs.abs().max()))
    assert errors[0] > 1e-3
    assert errors[1] < 1e-5


@pytest.mark.parametrize(("pole", "input_matrix"), [(40.0, 1.0), (0.5, 0.0)])
def test_states_that_have_no_size_keep_their_coordinates(pole: float, input_matrix: float) -> None:
    shape = plain(2, 1, 0, 1)
    cell = shape.split(random_theta(shape))
    a = pole * torch.eye(2, dtype=torch.float64)
    theta = shape.join(replace(cell, a=a, b=input_matrix + 0 * cell.b))
    assert torch.equal(balanced(shape, theta, random_segments(shape, 100, 200, 3)), theta)


CELLS = [
    (plain(2, 1, 0, 1), plain(4, 1, 6, 1)),
    (plain(3, 2, 4, 2), plain(3, 2, 9, 2)),
    (plain(3, 2, 4, 2, "cubic", False), plain(7, 2, 5, 2, "cubic", False)),
    (plain(2, 2, 3, 1), plain(2, 2, 3, 1)),
    (FACTORS, replace(FACTORS, n_states=8, n_units=7)),
    *((shape, replace(shape, n_states=shape.n_states + 3, n_units=8)) for shape in GATED_SHAPES),
    *((replace(shape, n_units=0), shape) for shape in GATED_SHAPES),
]


@pytest.mark.parametrize(("old", "new"), CELLS)
def test_widened_cell_answers_alike(old: CellShape, new: CellShape) -> None:
    theta, features = random_theta(old), random_features(40, 5, old)
    wide = widen(old.split(theta), new, generator())
    assert wide.shape == (new.n_parameters,)
    outputs, states = simulate(old, theta, features)
    found, more = simulate(new, wide, features)
    torch.testing.assert_close(found, outputs, rtol=0, atol=SAME)
    torch.testing.assert_close(more[:, :, : old.n_states], states, rtol=0, atol=SAME)


@pytest.mark.parametrize(("old", "new"), CELLS)
def test_added_states_are_short_memories_of_the_features(old: CellShape, new: CellShape) -> None:
    """x[k+1] = PAD_POLE x[k] + PAD_GAIN f[k], each state of another feature in turn."""
    features = random_features(40, 5, old)
    wide = widen(old.split(random_theta(old)), new, generator())
    _, states = simulate(new, wide, features)
    held = torch.zeros(5, dtype=torch.float64)
    for added in range(new.n_states - old.n_states):
        held = torch.zeros(5, dtype=torch.float64)
        for k in range(40):
            held = (
                PAD_POLE * held
                + PAD_GAIN * features[k, :, old.roles.drive[added % len(old.roles.drive)]]
            )
        torch.testing.assert_close(states[-1, :, old.n_states + added], held, rtol=0, atol=SAME)
    assert 0 < PAD_POLE < 1


@pytest.mark.parametrize("new", [plain(4, 1, 5, 1), *GATED_SHAPES[:3]])
def test_added_units_can_be_learnt_and_differ_by_seed(new: CellShape) -> None:
    """They act on nothing yet, but their arguments are random: the cost depends on E."""
    new = replace(new, n_units=12 if new.gated else 5)
    old = replace(new, n_states=new.n_states - 2, n_units=0)
    m = old.split(random_theta(old))
    wide = widen(m, new, generator())
    gradient = normal_equations(new, wide, random_segments(new, 4, 30, 5)).gradient
    of_e = new.split(gradient).e[: old.n_states]
    assert torch.all(of_e != 0)
    assert torch.equal(wide, widen(m, new, generator()))
    other = widen(m, new, generator(1))
    assert not torch.equal(wide, other)
    parts = new.split(other)
    for arguments in (parts.w, *([parts.v] if new.gated else [])):
        assert float(arguments.square().sum(1).mean()) == pytest.approx(1.0, rel=0.8)


def test_widening_keeps_the_precision() -> None:
    old, new = plain(2, 1, 0, 1), plain(4, 1, 5, 1)
    single = old.split(random_theta(old).float())
    assert widen(single, new, generator()).dtype == torch.float32
    assert rescale(old, single, random(30, 2).float(), True).a.dtype == torch.float32


@pytest.mark.parametrize("substeps", [1, 2, 5])
def test_linear_cell_in_several_steps_answers_as_in_one(substeps: int) -> None:
    shape, features = plain(4, 2, 0, 2), random_features(40, 3, plain(4, 2, 0, 2))
    turn = torch.linalg.matrix_exp(random(4, 4, seed=2) / 4)  # has roots of every order
    cell = replace(shape.split(random_theta(shape)), a=0.9 * turn / torch.linalg.norm(turn, 2))
    (found,) = in_substeps([cell], substeps)
    expected, _ = simulate(shape, shape.join(cell), features)
    several = replace(shape, substeps=substeps)
    values, _ = simulate(several, several.join(found), features)
    torch.testing.assert_close(values, expected, rtol=0, atol=SAME)


def test_terms_of_parameters_do_not_move_a_cell_with_substeps() -> None:
    shape = plain(1, 1, 0, 1)
    cells = [shape.split(random_theta(shape, seed).abs()) for seed in range(2)]
    _, other = in_substeps(cells, 2)
    assert not torch.cat([other.a, other.b], 1).any()
    torch.testing.assert_close(other.c, cells[1].c)


def test_pole_that_changes_its_sign_has_no_substeps() -> None:
    shape = plain(1, 1, 0, 1)
    cell = replace(shape.split(random_theta(shape)), a=torch.tensor([[-0.3]]).double())
    with refused(ValueError, "substeps = 2", "2 with the", "choose 1"):
        in_substeps([cell], 2)
