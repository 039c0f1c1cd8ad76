"""Numbers and times as texts."""

from __future__ import annotations

import math

import pytest

from slide_fmu.core.measures import percent
from slide_fmu.core.readable import decimal, duration, number, quantity, ratio_text


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(1.0722e-6, "1.07 µs"), (4.4e-8, "0.0440 µs"), (99.96e-6, "100 µs"), (0.99996e-3, "1.00 ms")],
)
def test_times_have_three_digits_and_a_unit(seconds: float, words: str) -> None:
    assert duration(seconds) == words


@pytest.mark.parametrize(
    ("value", "words"),
    [(219000.76, "219 000"), (15.61, "15.6"), (506, "506"), (14025.8, "14 000")],
)
def test_numbers_have_three_digits_and_no_exponent(value: float, words: str) -> None:
    assert number(value) == words


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        *((2.75e-4, "m", "275 µm"), (0.0, "m", "0 m"), (12e3, "N", "12 kN"), (0.5, "1", "0.5")),
        *((1.641e-5, "m", "16.4 µm"), (-9.9996e-4, "m", "-1 mm"), (4e-13, "m", "0.0004 nm")),
        *((7200.0, "s", "7200 s"), (1.6e-5, "rad", "16 µrad"), (5e9, "Pa", "5000 MPa")),
        *((1.641e-5, "N.m", "0.0000164 N.m"), (2.5e6, "m/s2", "2 500 000 m/s2")),
        *((2e-4, "mm", "0.0002 mm"), (1.9e-9, "1", "1.9·10⁻⁹"), (math.inf, "m", "inf m")),
    ],
)
def test_quantity_has_the_prefix_that_its_unit_may_have(
    value: float, unit: str, text: str
) -> None:
    assert quantity(value, unit) == text


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        *(
            (1e-5, 6, "0.00001"),
            (-1e6, 6, "-1 000 000"),
            (123456.78, 8, "123456.78"),
            (-0.0, 3, "0"),
        ),
        *((9.9996e-7, 3, "0.000001"), (-1.23e-11, 3, "-1.23·10⁻¹¹"), (1e15, 3, "1·10¹⁵")),
    ],
)
def test_decimal_has_no_exponent(value: float, digits: int, text: str) -> None:
    assert decimal(value, digits) == text


def test_small_parts_are_plain_decimals_in_per_cent() -> None:
    assert percent(2.79e-7) == "0.0000279 %"


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.61, "0.61"), (999.7, "1000"), (1870.3, "1870"), (37_600.0, "37 600"), (math.inf, "inf")],
)
def test_ratio_has_three_digits_and_no_exponent(value: float, text: str) -> None:
    assert ratio_text(value) == text
