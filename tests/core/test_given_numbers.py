"""Arrays of users that are no numbers, wherever they come in."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import slide_fmu as slide
from slide_fmu.core.given_numbers import given_numbers
from tests.refusals import refused

DUFFING = Path(__file__).parents[2] / "fmus" / "duffing" / "duffing.fmu"
TIMES = 0.03 * np.arange(4)
DATES = np.datetime64("2024-01-01") + (TIMES * 1e9).astype("timedelta64[ns]")


@pytest.mark.parametrize(
    ("values", "said"),
    [
        (DATES, "datetime64[ns]"),
        (DATES - DATES[0], "timedelta64[ns]"),
        ([1.0, 2.0 + 1.0j], "complex128"),
        (["1", "2"], "<U1"),
        ([[1.0, 2.0], [3.0]], "inhomogeneous"),
        ([1.0, {}], "dict"),
    ],
)
def test_what_is_no_array_of_numbers_is_refused_by_its_type(values: Any, said: str) -> None:
    with refused(TypeError, "t", said, "expected", "real numbers"):
        given_numbers("t", values)


@pytest.mark.parametrize("values", [[1, 2], [True, False], [1.5, None], np.float32([1.5])])
def test_numbers_of_any_type_are_taken(values: Any) -> None:
    numbers = given_numbers("t", values)
    assert numbers.dtype == np.float64
    np.testing.assert_array_equal(numbers, np.array(values, dtype=np.float64))


DOORS: dict[str, Callable[[], Any]] = {
    "simulate": lambda: slide.simulate(DUFFING, DATES, np.zeros(4)),
    "simulate's inputs": lambda: slide.simulate(DUFFING, TIMES, DATES),
    "couple": lambda: slide.couple(
        {"a": DUFFING}, [], step=0.03, stop=0.3, inputs={"a.force": (DATES, np.zeros(4))}
    ),
    "predict": lambda: slide.load(DUFFING).predict(DATES[:, None]),
}


@pytest.mark.parametrize("name", DOORS)
def test_dates_are_refused_with_what_makes_times_of_them(name: str) -> None:
    with refused(TypeError, "datetime64[ns]", "subtract the first one", "timedelta64(1, 's')"):
        DOORS[name]()
