"""Features that a recipe names: of which set, normalised how, for which roles, or why not."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from slide_fmu.core.scaling import Affine
from slide_fmu.core.signals import FloatArray
from slide_fmu.features.chain_motion import ChainMotion
from slide_fmu.features.differences import Differences
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.features.serial_chain import SerialChain
from slide_fmu.fitting.feature_choice import choose_features, require_odd, roles_of
from slide_fmu.network.state_space.cell import Roles
from slide_fmu.recipe.learning import StateSpaceRecipe
from tests.fitting.plants import ARM, STEP, Still
from tests.refusals import refused

ONE_ANGLE = ("direction", "turn", "turn_change")
"""What there is of the cosine and sine of an angle, without other inputs."""
SINGLE = 1e-6
"""Roundings of float32 in values of a few units."""


def unit(n: int) -> Affine:
    return Affine(np.zeros(n), np.ones(n))


def noise(n: int, seed: int = 0, size: float = 1.0) -> FloatArray:
    """White inputs of some trajectories, shape (6, 160, n)."""
    return size * np.random.default_rng(seed).uniform(-1, 1, (6, 160, n))


def smooth(n: int) -> FloatArray:
    """Slow inputs, shape (6, 160, n)."""
    values = np.cumsum(np.cumsum(noise(n), axis=1), axis=1)
    return np.asarray(values / np.abs(values).max())


def directors(seed: int = 0) -> FloatArray:
    """Cosine and sine of angles that go round and round at various speeds, shape (6, 160, 2)."""
    angles = np.cumsum(0.4 * noise(1, seed)[:, :, 0] + 0.3, axis=1)
    return np.stack([np.cos(angles), np.sin(angles)], axis=2)


def chosen(
    names: tuple[str, ...], inputs: FloatArray, chain: SerialChain | None = None
) -> FeatureMap:
    n = inputs.shape[2]
    system = Still(n, chain, angle=n == 2 and set(names) <= set(ONE_ANGLE))
    return choose_features(names, system.offered(unit(n)), inputs)


@pytest.mark.parametrize("order", [0, 1, 2])
def test_differences_are_those_of_the_inputs(order: int) -> None:
    """By definition with the first input held before, divided by their standard deviation."""
    inputs = noise(3)
    features = chosen(Differences.NAMES[: order + 1], inputs)
    held = np.concatenate([inputs[:, :1], inputs[:, :1], inputs], 1)
    latest, before, earlier = held[:, 2:], held[:, 1:-1], held[:, :-2]
    expected = np.concatenate([latest, latest - before, latest - 2 * before + earlier], 2)
    expected = expected[:, :, : 3 * (order + 1)]
    spread = expected.reshape(-1, expected.shape[2]).std(0)
    spread[:3] = 1
    found = features.along(inputs)
    assert found.dtype == np.float32
    assert found == pytest.approx(expected / spread, abs=SINGLE)
    assert not found[:, 0, 3:].any()
    assert isinstance(features.features, Differences)
    assert features.features.order == order


def test_signals_come_in_the_order_of_the_names() -> None:
    features = chosen(("second_changes", "inputs"), noise(2))
    assert features.chosen == (4, 5, 0, 1)
    assert features.scaling.scale[2:].tolist() == [1.0, 1.0]
    assert np.all(features.scaling.scale[:2] > 1.0)


@pytest.mark.parametrize(
    ("names", "inputs", "chain"),
    [
        (Differences.NAMES, 0.2 * noise(2) + 0.7, None),
        (ONE_ANGLE, directors(), None),
        (tuple(ChainMotion.WIDTHS), smooth(2), ARM),
    ],
    ids=["differences", "director", "chain motion"],
)
def test_every_feature_is_normalised_as_its_set_says(
    names: tuple[str, ...], inputs: FloatArray, chain: SerialChain | None
) -> None:
    """Bounded ones stay, centred ones have mean 0, all but the first standard deviation 1."""
    features = chosen(names, inputs, chain)
    every = features.features
    raw, found = every.along(inputs), features.along(inputs).astype(np.float64)
    assert features.chosen == tuple(range(every.n_signals))
    for name in names:
        part = list(every.indices((name,)))
        if name in every.bounded:
            assert np.array_equal(found[:, :, part], raw[:, :, part].astype(np.float32))
            continue
        if name in every.centred:
            assert np.abs(found[:, :, part].mean((0, 1))).max() < 10 * SINGLE
        else:
            assert not features.scaling.offset[part].any()
        spread = found[:, :, part].std((0, 1))
        moving = raw[:, :, part].std((0, 1)) > SINGLE
        assert np.any(moving)
        assert spread[moving] == pytest.approx(np.ones(int(moving.sum())), rel=SINGLE)
        # a component that never changes is zero, not rounding
        assert np.abs(found[:, :, part][:, :, ~moving]).max(initial=0.0) < SINGLE


def test_chain_motion_has_the_step_and_the_ranges_of_the_system() -> None:
    scaling = Affine(np.array([0.3, -0.2]), np.array([2.0, 0.5]))
    features = choose_features(("wrench",), Still(2, ARM).offered(scaling), smooth(2))
    motion = features.features
    assert isinstance(motion, ChainMotion)
    assert (motion.chain, motion.step) == (ARM, STEP)
    assert motion.middle.tolist() == [0.3, -0.2]
    assert motion.half_range.tolist() == [2.0, 0.5]


STILL = (
    r"^feature '{}' never changes in the training data \(its component {}\); expected it to: "
    r"leave it out of the network's table, or check data\.excitation$"
)


@pytest.mark.parametrize("name", ["changes", "second_changes"])
@pytest.mark.parametrize(("still", "rounding"), [(0, 0.0), (1, 0.0), (1, 1e-12)])
def test_differences_of_an_input_that_never_changes_are_refused(
    name: str, still: int, rounding: float
) -> None:
    """Another value in every trajectory, or constant up to rounding."""
    inputs = noise(2)
    held = 0.1 * np.arange(6)[:, None]
    inputs[:, :, still] = held + rounding * inputs[:, :, still]
    with pytest.raises(ValueError, match=STILL.format(name, still)):
        chosen(("inputs", name), inputs)
    assert chosen(("inputs",), inputs).scaling.scale.tolist() == [1.0, 1.0]


@pytest.mark.parametrize("name", ["turn", "turn_change"])
def test_director_that_never_turns_is_refused(name: str) -> None:
    """Another direction in every trajectory."""
    angles = np.zeros((6, 160)) + 0.3 * np.arange(6)[:, None]
    inputs = np.stack([np.cos(angles), np.sin(angles)], axis=2)
    with pytest.raises(ValueError, match=STILL.format(name, 0)):
        chosen(("direction", name), inputs)


@pytest.mark.parametrize("name", ["wrench_change", "turned_wrench_change"])
@pytest.mark.parametrize("rounding", [0.0, 1e-14])
def test_chain_that_never_moves_has_no_wrench_changes(name: str, rounding: float) -> None:
    """Nor one that moves by roundings, beside wrenches that differ between trajectories."""
    held = np.zeros((6, 160, 2)) + 0.1 * np.arange(6)[:, None, None]
    with pytest.raises(ValueError, match=STILL.format(name, "[0-5]")):
        chosen(("wrench", name), held + rounding * noise(2), ARM)


def test_components_that_rest_in_a_planar_machine_are_zero() -> None:
    """An arm that lies moves its load in its plane alone."""
    lying = replace(ARM, alpha=np.zeros(2), inertias=np.array([0.02 * np.eye(3)] * 2))
    names = ("wrench_change", "turned_wrench_change", "turned_momentum")
    features = chosen(names, smooth(2), lying)
    values = features.along(smooth(2)).reshape(-1, 18)
    resting = [2, 8, 14]  # forces along the axes, and momentum
    assert np.abs(values[:, resting]).max() < SINGLE
    for place in (0, 1, 5, 6, 7, 11, 12, 13, 17):
        assert values[:, place].std() == pytest.approx(1, rel=1e-5)


@pytest.mark.parametrize("name", ["turned_inertia", "wrench", "position"])
def test_components_that_geometry_makes_zero_are_not_scaled_up(name: str) -> None:
    """The cosine of a right angle is rounded: some loads of a plane arm are 1e-17, not zero."""
    plane = replace(ARM, centres=np.array([[0.0, -0.1, 0.0], [0.3, 0.0, 0.0]]))
    inputs = smooth(2)
    inputs[:, :, 0] = 0
    features = chosen((name,), inputs, plane)
    values = features.along(inputs).reshape(-1, features.n_signals)
    small = features.scaling.scale < 1e-9
    assert not small.any()
    resting = values.std(axis=0) < SINGLE
    assert 0 < np.count_nonzero(resting) < features.n_signals
    assert np.abs(values[:, resting]).max() < SINGLE


EXPECTED = (
    r"; expected names of one set: inputs, changes, second_changes \(differences\); direction, "
    r"turn, turn_change, others, other_changes \(director\); wrench, .*turned_momentum "
    r"\(chain motion\)$"
)


@pytest.mark.parametrize(
    ("names", "n_inputs", "chain", "message"),
    [
        (("input",), 2, ARM, r"^features \['input'\]" + EXPECTED),
        (("inputs", "turn"), 2, ARM, r"^features \['inputs', 'turn'\]" + EXPECTED),
        (("inputs", "frame"), 2, ARM, r"^features \['inputs', 'frame'\]" + EXPECTED),
        (("turn", "third_changes"), 2, None, r"^features \['turn', 'third_changes'\]" + EXPECTED),
        (
            ("wrench", "rates"),
            2,
            None,
            r"^features \['wrench', 'rates'\] need a serial chain; this system has none: give it "
            r'one \(system\.chain = "robot\.urdf"\), or use other features$',
        ),
        (
            ("direction",),
            1,
            None,
            r"^features \['direction'\] of 1 inputs \['u0'\]; expected an angle among them: an "
            "input in rad or deg, or with a period, or two, the cosine and sine of an angle ",
        ),
        (("direction",), 3, None, r"^features \['direction'\] of 3 inputs .*; expected an angle"),
        (("others",), 2, None, r"^features \['others'\] of 2 inputs .*; expected an angle"),
        (("rates",), 3, ARM, "chain of 2 joints with 3 inputs; expected one input per joint"),
    ],
)
def test_features_that_cannot_be_chosen_are_refused(
    names: tuple[str, ...], n_inputs: int, chain: SerialChain | None, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        chosen(names, noise(n_inputs), chain)


def test_director_of_inputs_that_are_no_angle_is_refused() -> None:
    """Whatever their ranges and values are."""
    with refused(ValueError, "expected an angle", "2 inputs ['u0'"):
        choose_features(("direction",), Still(2).offered(unit(2)), directors())


ROLES: list[tuple[dict[str, Any], tuple[str, ...], Roles]] = [
    ({}, ("inputs",), Roles((0, 1), (0, 1))),
    ({"drive": ["inputs", "changes"]}, ("inputs", "changes"), Roles((0, 1, 2, 3), (0, 1, 2, 3))),
    (
        {"drive": ["changes"], "static": ["inputs"], "readout": ["inputs"]},
        ("changes", "inputs"),
        Roles((0, 1), (2, 3), readout=(2, 3)),
    ),
    (
        {"units": "gated", "schedule": ["inputs"]},
        ("inputs",),
        Roles((0, 1), (0, 1), (0, 1), (0, 1)),
    ),
    (
        {"units": "gated", "drive": ["second_changes"], "schedule": ["inputs"]},
        ("second_changes", "inputs"),
        Roles((0, 1), (0, 1), (0, 1), (2, 3)),
    ),
    (
        {
            "units": "gated", "drive": ["changes"], "static": ["inputs", "changes"],
            "gated": ["second_changes"], "schedule": ["inputs"],
        },
        ("changes", "inputs", "second_changes"),
        Roles((0, 1), (2, 3, 0, 1), (4, 5), (2, 3)),
    ),
]  # fmt: skip


@pytest.mark.parametrize(("table", "names", "roles"), ROLES)
def test_roles_are_places_among_the_chosen_features(
    table: dict[str, Any], names: tuple[str, ...], roles: Roles
) -> None:
    recipe = StateSpaceRecipe.model_validate(table)
    assert recipe.feature_names() == names
    features = choose_features(recipe.feature_names(), Still(2).offered(unit(2)), noise(2))
    assert features.chosen == chosen(names, noise(2)).chosen
    assert roles_of(recipe, features) == roles


def test_turned_pairs_see_the_frame() -> None:
    recipe = StateSpaceRecipe(
        units="gated",
        drive=("turned_wrench_change",),
        schedule=("turned_inertia",),
        turned_pairs=1,
    )
    assert recipe.feature_names() == ("turned_wrench_change", "turned_inertia", "frame")
    features = choose_features(recipe.feature_names(), Still(2, ARM).offered(unit(2)), smooth(2))
    roles = roles_of(recipe, features)
    assert roles.turn == (15, 16)
    turn = features.along(smooth(2))[:, :, list(roles.turn)]
    assert np.square(turn).sum(2) == pytest.approx(np.ones((6, 160)), abs=SINGLE)
    assert (roles.drive, roles.schedule) == (tuple(range(6)), tuple(range(6, 15)))
    assert roles.gated == roles.static == roles.drive


def test_signs_of_angles_and_loads_are_not_flipped() -> None:
    inputs = noise(2)
    features = chosen(Differences.NAMES, inputs)
    assert np.array_equal(features.along(-inputs), -features.along(inputs))
    require_odd(features)
    for other in (chosen(("turn",), directors()), chosen(("wrench",), smooth(2), ARM)):
        with refused(ValueError, "flip_signs = true", "set flip_signs = false, or"):
            require_odd(other)
