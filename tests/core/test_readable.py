"""Numbers and times as texts."""

from __future__ import annotations

import math

import pytest

from slide_fmu.core.readable import duration, number, quantity, ratio_text


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
    [(2.75e-4, "m", "275 µm"), (0.0, "m", "0 m"), (12e3, "N", "12 kN"), (0.5, "1", "0.5")],
)
def test_quantity_has_the_prefix_that_its_unit_may_have(
    value: float, unit: str, text: str
) -> None:
    assert quantity(value, unit) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.61, "0.61"), (999.7, "1000"), (1870.3, "1870"), (37_600.0, "37 600"), (math.inf, "inf")],
)
def test_ratio_has_three_digits_and_no_exponent(value: float, text: str) -> None:
    assert ratio_text(value) == text
