"""Physical parameters: their ranges, transforms and values."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slide_fmu.core.parameters import Parameter, Transform, checked_values, starts_of
from tests.refusals import refused

MASS = Parameter("mass", "kg", 1.0, 4.0, transform="log")
STIFFNESS = Parameter("stiffness", "N/m", 100.0, 300.0, start=150.0, description="of the spring")
TRANSFORMS: list[Transform] = ["linear", "log", "reciprocal"]


@pytest.mark.parametrize("transform", TRANSFORMS)
def test_scaled_range_goes_from_minus_one_to_one(transform: Transform) -> None:
    parameter = Parameter("mass", "kg", 1.0, 4.0, transform=transform)
    found = parameter.scaled(np.array([1.0, parameter.start_value, 4.0]))
    assert found == pytest.approx([-1.0, 0.0, 1.0], abs=1e-14)


def test_transforms_are_those_of_their_names() -> None:
    middles = [Parameter("m", "kg", 1, 4, transform=t).start_value for t in TRANSFORMS]
    assert middles == pytest.approx([2.5, 2.0, 1.6])


@given(st.sampled_from(TRANSFORMS), st.floats(0.1, 10), st.floats(1.01, 50), st.floats(0, 1))
def test_unscaled_inverts_scaled(
    transform: Transform, low: float, ratio: float, share: float
) -> None:
    parameter = Parameter("mass", "kg", low, ratio * low, transform=transform)
    value = low + share * (parameter.high - low)
    assert parameter.unscaled(parameter.scaled(value)) == pytest.approx(value, rel=1e-9)


@given(st.sampled_from(TRANSFORMS), st.floats(0.01, 10), st.floats(1.01, 1e4))
def test_wider_interval_of_a_positive_range_is_positive(
    transform: Transform, low: float, ratio: float
) -> None:
    parameter = Parameter("mass", "kg", low, ratio * low, transform=transform)
    first, last = parameter.beyond(0.05)
    assert 0 < first < low < parameter.high < last


def test_wider_interval_of_a_linear_range_is_wider_by_the_share() -> None:
    assert Parameter("angle", "rad", -1.0, 3.0).beyond(0.1) == pytest.approx((-1.4, 3.4))
    assert Parameter("load", "N", 0.0, 10.0).beyond(0.1) == pytest.approx((0.0, 11.0))
    assert Parameter("load", "N", -10.0, -0.1).beyond(0.1) == pytest.approx((-10.99, -0.05))


def test_parameters_not_given_have_their_starts() -> None:
    both = MASS, STIFFNESS
    assert starts_of(both).tolist() == pytest.approx([2.0, 150.0])
    assert checked_values(both, {}).tolist() == pytest.approx([2.0, 150.0])
    assert checked_values(both, {"mass": 3}).tolist() == pytest.approx([3.0, 150.0])


def test_value_outside_by_rounding_is_the_end_of_the_range() -> None:
    assert checked_values((MASS,), {"mass": 4.0 + 1e-7}).tolist() == [4.0]
    assert checked_values((MASS,), {"mass": 1.0 - 1e-7}).tolist() == [1.0]


@pytest.mark.parametrize("value", [0.99, 4.01, math.nan, math.inf, "heavy"])
def test_values_outside_the_range_are_refused(value: float) -> None:
    with refused(ValueError, "'mass' =", "kg; expected", "1 .. 4 kg"):
        checked_values((MASS,), {"mass": value})


def test_unknown_names_are_refused() -> None:
    with refused(ValueError, "expected one of ['mass']", "parameter 'm'"):
        checked_values((MASS,), {"m": 1.0})
    with refused(ValueError, "the surrogate has no parameters"):
        checked_values((), {"m": 1.0})


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"name": "two words"}, "parameter name 'two words'"),
        ({"low": 4.0}, r"parameter 'mass': range \[4.0, 4.0\] kg"),
        ({"start": 5.0}, "start 5.0; expected a value within its range"),
        ({"transform": "root"}, "transform 'root'; expected one of"),
        ({"low": 0.0, "transform": "log"}, "expected positive values"),
        ({"low": -1.0, "transform": "reciprocal"}, "expected positive values"),
    ],
)
def test_parameters_that_make_no_sense_are_refused(given: dict[str, object], message: str) -> None:
    arguments: dict[str, object] = {"name": "mass", "unit": "kg", "low": 1.0, "high": 4.0}
    with pytest.raises(ValueError, match=message):
        Parameter(**{**arguments, **given})  # type: ignore[arg-type]


def test_signal_of_a_parameter_has_its_range_and_start() -> None:
    found = STIFFNESS.signal
    assert (found.name, found.unit, found.low, found.high) == ("stiffness", "N/m", 100.0, 300.0)
    assert (found.start_value, found.description) == (150.0, "of the spring")
