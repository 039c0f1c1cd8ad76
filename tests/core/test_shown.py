"""Messages show numbers of numpy as plain ones."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from slide_fmu.core.parameters import Parameter, checked_values
from slide_fmu.core.shown import shown
from slide_fmu.core.signals import Signal
from slide_fmu.systems.errors import LoadError
from slide_fmu.systems.function.system import FunctionSystem
from slide_fmu.validation.task import Task
from tests.refusals import refused


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (np.float64(0.5), "0.5"),
        ([np.float64(0.5), (np.int64(3), "a")], "[0.5, (3, 'a')]"),
        ({"gain": np.bool_(True)}, "{'gain': True}"),
        (None, "None"),
    ],
)
def test_numbers_of_numpy_are_shown_as_plain_ones(value: object, text: str) -> None:
    assert shown(value) == text


def test_long_value_is_cut() -> None:
    assert shown("a" * 200, 20) == "'" + "a" * 16 + "..."


@pytest.mark.parametrize("given", [lambda u: [u, u], lambda u: (u, "a")])
def test_what_a_function_of_the_user_gave_is_shown_without_types(given: Any) -> None:
    with refused(LoadError, "f gave", "0.0, "):
        FunctionSystem(
            lambda x, u, p: given(u[0]),
            lambda x, u, p: [x[0]],
            inputs=[Signal("drive", "m", 0.0, 1.0)],
            outputs=[Signal("place", "m", 0.0, 1.0)],
            start=[0.0],
            step=0.1,
        )


MASS = (Parameter("mass", "kg", 1.0, 4.0),)


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        (lambda five: checked_values(MASS, {"mass": five}), "'mass' = 5.0 kg"),
        (lambda five: Task(1, amplitude=(five, five / 2)), "amplitude = (5.0, 2.5)"),
    ],
)
def test_numbers_that_users_gave_are_shown_without_types(
    ask: Callable[[Any], object], words: str
) -> None:
    with refused(ValueError, words):
        ask(np.float64(5.0))
