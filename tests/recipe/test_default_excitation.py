"""A recipe that says nothing about its excitation gets one that follows from its step."""

from __future__ import annotations

import numpy as np
import pytest
from pydantic import TypeAdapter

from slide_fmu.core.signals import Hold, Signal
from slide_fmu.excitation.kinds import Excitation
from slide_fmu.excitation.spectra import Harmonic, Multisine
from slide_fmu.recipe.default_excitation import (
    InputKind,
    KindTable,
    default_excitation,
    further_excitation,
)
from slide_fmu.recipe.recipe import Recipe
from tests.recipes import tiny_recipe, whole_recipe

SIGNALS = (Signal("a", "N", -2.0, 2.0), Signal("b", "N", -2.0, 2.0))


def without_excitation(step: float) -> Recipe:
    values = tiny_recipe().model_dump(mode="json")
    del values["data"]["excitation"]
    values["window"]["step"], values["data"]["duration"] = step, 200 * step
    return whole_recipe(values)


@pytest.mark.parametrize("step", [1e-3, 0.02, 60.0])
def test_default_mix_drives_every_input_within_the_band_of_the_step(step: float) -> None:
    recipe = without_excitation(step)
    kinds = recipe.data.excitation
    assert sum(kind.weight for kind in kinds) == pytest.approx(1.0, abs=0.02)
    signals = (Signal("a", "N", -2.0, 6.0), Signal("b", "m", 0.0, 1.0, hold="first_order"))
    time = step * np.arange(4000)
    for kind in kinds:
        kind.check(signals)
        inputs = kind.inputs(signals, time, 1.0, np.random.default_rng(3))
        assert (inputs.min(axis=0) > [-2.001, -0.001]).all()
        assert (inputs.max(axis=0) < [6.001, 1.001]).all()
        assert (inputs.std(axis=0) > [0.01, 0.001]).all()
    for table in default_excitation(step):
        for frequency in table.get("angular_frequency", []):
            assert 0 < frequency * step < 0.35 * np.pi


def test_excitation_of_a_recipe_is_kept() -> None:
    assert [kind.kind for kind in tiny_recipe().data.excitation] != [
        table["kind"] for table in default_excitation(tiny_recipe().window.step)
    ]


def test_recipe_with_a_chain_goes_from_point_to_point() -> None:
    values = without_excitation(0.01).model_dump(mode="json")
    del values["data"]["excitation"]
    values["system"]["chain"] = "robot.urdf"
    assert {kind.kind for kind in whole_recipe(values).data.excitation} == {"point_to_point"}


@pytest.mark.parametrize("widths", [(), (6.0, 0.5)])
def test_set_points_move_at_any_step_within_their_limits(widths: tuple[float, ...]) -> None:
    signals = (Signal("turn", "rad", -3.0, 3.0), Signal("slide", "m", 0.0, 0.5))
    for step in (1e-3, 0.02):
        tables = default_excitation(step, "set_points", widths)
        assert sum(table["weight"] for table in tables) == pytest.approx(1.0)
        for kind in TypeAdapter(list[Excitation]).validate_python(tables):
            kind.check(signals)
            time = step * np.arange(4000)
            inputs = kind.inputs(signals, time, 1.0, np.random.default_rng(3))
            assert (np.ptp(inputs, axis=0) > [2.0, 0.15]).all()
            if widths:
                speed = np.max(np.abs(np.diff(inputs, axis=0)), axis=0) / step
                assert (speed <= 1.001 * np.array(tables[0]["speed"])).all()
                assert tables[0]["speed"] == [
                    pytest.approx(w / 200 / step, rel=0.05) for w in widths
                ]


def test_cosine_and_sine_of_an_angle_stay_on_the_circle_at_any_step() -> None:
    signals = (
        Signal("x", "1", -1.0, 1.0, angle="cosine"),
        Signal("y", "1", -1.0, 1.0, angle="sine"),
    )
    for step in (1e-3, 0.03125):
        tables = default_excitation(step, "angle")
        assert sum(table["weight"] for table in tables) == pytest.approx(1.0)
        for kind in TypeAdapter(list[Excitation]).validate_python(tables):
            kind.check(signals)
            inputs = kind.inputs(signals, step * np.arange(4000), 1.0, np.random.default_rng(3))
            angle = np.unwrap(np.arctan2(inputs[:, 1], inputs[:, 0]))
            assert np.hypot(*inputs.T) == pytest.approx(1.0)
            assert np.abs(np.diff(angle)).max() * 25 == pytest.approx(2 * np.pi, rel=0.05)


def test_recipe_whose_inputs_are_cosine_and_sine_turns_their_angle() -> None:
    values = without_excitation(0.01).model_dump(mode="json")
    del values["data"]["excitation"]
    values["system"]["inputs"] = {
        name: {"range": [-1.0, 1.0], "angle": name} for name in ("cosine", "sine")
    }
    found = [kind.kind for kind in whole_recipe(values).data.excitation]
    assert found == ["speed_ramps", "speed_ramps", "axis_moves"]


def test_inputs_whose_rates_act_move_at_a_sensible_speed() -> None:
    """Other motions cross a part of their range within a sample; these take many samples."""
    speeds = {}
    signals, step = (Signal("base", "m", -1.0, 1.0, hold="first_order"),), 0.005
    for inputs in ("moving", "rates"):
        tables = default_excitation(step, inputs)  # type: ignore[arg-type]
        fastest = []
        for kind in TypeAdapter(list[Excitation]).validate_python(tables):
            time = step * np.arange(2000)
            drawn = kind.inputs(signals, time, 1.0, np.random.default_rng(3))
            fastest.append(np.abs(np.diff(drawn, axis=0)).max())
        speeds[inputs] = max(fastest)
    assert 3 * speeds["rates"] < speeds["moving"]


@pytest.mark.parametrize("inputs", ["held", "moving", "rates"])
def test_each_of_several_inputs_also_moves_alone(inputs: InputKind) -> None:
    of_one = default_excitation(0.01, inputs, [2.0])
    assert "one_at_a_time" not in {table["kind"] for table in of_one}
    *others, tones, alone = default_excitation(0.01, inputs, [2.0, 5.0])
    assert alone == {"kind": "one_at_a_time", "weight": 0.1}
    assert tones == {**alone, "moves_as": "harmonic"}
    assert [table["kind"] for table in others] == [table["kind"] for table in of_one]
    weights = [table["weight"] for table in (*others, tones, alone)]
    assert sum(weights) == pytest.approx(1.0, abs=0.02)


def tones(tables: list[KindTable]) -> list[Harmonic]:
    return [TypeAdapter(Harmonic).validate_python(t) for t in tables if t["kind"] == "harmonic"]


@pytest.mark.parametrize(("inputs", "slower"), [("held", 1), ("moving", 1), ("rates", 8)])
def test_lasting_tones_reach_the_whole_range_at_all_frequencies(
    inputs: InputKind, slower: int
) -> None:
    """They are slow as often as fast, about the middle and elsewhere, and are not clipped."""
    step = 0.01
    whole, beside = tones(default_excitation(step, inputs))[:2]
    low, high = whole.angular_frequency
    assert high == pytest.approx(0.3 * np.pi / step / slower, rel=0.05)
    assert low < high / 30
    assert whole.amplitude[1] == 1.0
    assert whole.decades
    assert beside.offset[1] + beside.amplitude[1] == 1.0
    assert whole.weight + beside.weight > 0.1


@pytest.mark.parametrize("inputs", ["held", "moving", "rates"])
def test_working_frequencies_get_a_quarter_of_the_motions_up_to_the_whole_range(
    inputs: InputKind,
) -> None:
    without = default_excitation(0.01, inputs, [2.0, 5.0])
    tables = default_excitation(0.01, inputs, [2.0, 5.0], bands=[(12.0, 25.0)] * 2)
    there = [table for table in tables if table.get("angular_frequency") == [12.0, 25.0]]
    assert sum(float(str(t["weight"])) for t in there) == pytest.approx(0.25, abs=0.01)
    assert sum(float(str(t["weight"])) for t in tables) == pytest.approx(1.0, abs=0.02)
    assert len(tables) == len(without) + len(there)
    for kind in TypeAdapter(list[Excitation]).validate_python(there):
        drawn = [
            kind.inputs(SIGNALS, 0.01 * np.arange(400), 1.0, np.random.default_rng(seed))
            for seed in range(20)
        ]
        assert np.max(np.abs(drawn)) > 1.9


def test_inputs_of_different_working_frequencies_move_in_their_own_bands() -> None:
    bands: list[tuple[float, float] | None] = [(12.0, 25.0), None]
    tables = default_excitation(0.01, "moving", [2.0, 5.0], bands=bands)
    there = [table for table in tables if table["kind"] == "band_sines"]
    assert [table["bands"] for table in there] == 3 * [[[12.0, 25.0], [0.3, 94.0]]]
    assert sum(float(str(t["weight"])) for t in there) == pytest.approx(0.25, abs=0.01)
    kinds = TypeAdapter(list[Excitation]).validate_python(there)
    assert [getattr(kind, "angular_frequency", None) for kind in kinds] == 3 * [(0.3, 94.0)]


def test_few_sines_are_near_known_resonances() -> None:
    tables = default_excitation(0.01, "moving", resonances=(7.0, 28.0))
    (near,) = [table for table in tables if table.get("angular_frequency") == [7.0, 28.0]]
    assert near["components"] == [1, 3]


@pytest.mark.parametrize("inputs", ["held", "moving", "rates"])
def test_an_angle_and_another_input_get_kinds_that_can_drive_both(inputs: InputKind) -> None:
    hold: Hold = "zero_order" if inputs == "held" else "first_order"
    signals = (
        Signal("x", "1", -1.0, 1.0, angle="cosine", hold=hold),
        Signal("y", "1", -1.0, 1.0, angle="sine", hold=hold),
        Signal("load", "N.m", -5.0, 5.0, hold=hold),
    )
    tables = default_excitation(0.01, inputs, [2.0, 2.0, 10.0], turning=True)
    tables += further_excitation(0.01, inputs, turning=True)
    kinds = TypeAdapter(list[Excitation]).validate_python(tables)
    for kind in kinds:
        kind.check(signals)
    assert "one_at_a_time" in [kind.kind for kind in kinds]


def test_recipe_with_an_angle_and_another_input_can_be_driven() -> None:
    values = without_excitation(0.01).model_dump(mode="json")
    del values["data"]["excitation"]
    values["system"]["inputs"] = {
        **{name: {"range": [-1.0, 1.0], "angle": name} for name in ("cosine", "sine")},
        "load": {"range": [-1.0, 1.0]},
    }
    assert "box" not in {kind.kind for kind in whole_recipe(values).data.excitation}


def test_moving_inputs_jump_only_where_they_are_said_to() -> None:
    """Without jumps, a new level is reached within one step, and is not called a step."""
    without = {str(table["kind"]) for table in default_excitation(0.01, "moving")}
    tables = default_excitation(0.01, "moving", jumps=True)
    jumping = {str(table["kind"]) for table in tables}
    assert without >= {"ramps"}
    assert not without & {"steps", "binary", "stops"}
    assert jumping >= {"steps", "binary", "stops"}
    assert "ramps" not in jumping
    assert sum(float(str(table["weight"])) for table in tables) == pytest.approx(1.0, abs=0.02)
    for inputs in ("held", "rates"):
        kind: InputKind = inputs  # type: ignore[assignment]
        assert default_excitation(0.01, kind, jumps=True) == default_excitation(0.01, kind)


def between_points(tables: list[KindTable]) -> list[Multisine]:
    """The kinds that are straight between communication points."""
    return [TypeAdapter(Multisine).validate_python(t) for t in tables if "points" in t]


@pytest.mark.parametrize("inputs", ["moving", "rates"])
def test_no_network_learns_from_motions_with_kinks(inputs: InputKind) -> None:
    assert not between_points(default_excitation(0.01, inputs))
    recipe = TypeAdapter(list[Excitation]).validate_python(default_excitation(0.01, inputs))
    assert sum(kind.weight for kind in recipe) == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("inputs", ["moving", "rates"])
def test_bound_alone_learns_from_motions_with_kinks(inputs: InputKind) -> None:
    slow, fast = between_points(further_excitation(0.01, inputs))
    assert slow.points == (0.01, 0.08)
    assert slow.angular_frequency[1] <= fast.angular_frequency[0]
    assert fast.points is not None
    assert fast.points[0] > 0.01  # samples do not show whether an input bends in one of them
    assert not further_excitation(0.01, "held")
