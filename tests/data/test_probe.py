"""The short motion that shows a changed model moves, whatever the first draw of the mix is."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from slide_fmu.data.draws import PROBE, PROBE_ATTEMPTS, Stream, draw, probe, probe_draws
from slide_fmu.data.model_answers import identity, same_motion
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.reading import parse_open_recipe
from slide_fmu.recipe.recipe import Recipe
from tests.systems.function_models.specifications import HERE

TEXT = f"""
name = "lag"
description = "a system that begins at rest under its first input"

[system]
kind = "function"
model = "{HERE / "first_order_lag.py"}"
parameters = {{ time_constant = TIME }}

[window]
step = 0.05
n_in = 96
n_out = 32

[data]
seed = 7
"""


def lag(time_constant: float) -> Recipe:
    return parse_open_recipe(TEXT.replace("TIME", str(time_constant)), "recipe").guess


def test_a_first_draw_at_rest_is_not_the_probe() -> None:
    """The mix that a recipe without excitation has rests in the first draw of this seed."""
    recipe = lag(0.2)
    system = case_of(recipe).system
    first = draw(recipe, system, Stream(PROBE, recipe.data.seed, (1.0, 1.0), 2.5), 0).inputs[:50]
    assert np.ptp(first) == 0.0
    draws = list(probe_draws(recipe, system))
    assert len(draws) == PROBE_ATTEMPTS
    assert all(drawn.inputs.shape == (50, 1) and np.ptp(drawn.inputs) > 0.0 for drawn in draws)


@pytest.mark.extended
def test_model_that_changed_at_other_values_of_a_parameter_alone_is_another_one(
    tmp_path: Path,
) -> None:
    model, answers = tmp_path / "lag.py", []
    for exponent in (0, 0, 2):
        model.write_text(MODEL.replace("EXPONENT", str(exponent)), encoding="utf-8")
        text = TEXT.replace(str(HERE / "first_order_lag.py"), str(model))
        text = text.replace("parameters = { time_constant = TIME }", "")
        text += "\n[parameters.mass]\nrange = [1.0, 3.0]\nstart = 1.0\n"
        recipe = parse_open_recipe(text, "recipe").guess
        answers.append(identity(case_of(recipe).source, recipe))
    assert same_motion(answers[0], answers[1])
    assert not same_motion(answers[0], answers[2])


MODEL = """
inputs = {"u": {"unit": "1", "range": [-1.0, 1.0]}}
outputs = {"y": {"unit": "1", "range": [-1.0, 1.0]}}
parameters = {"mass": 1.0}
start = [0.0]


def f(x, u, p):
    return [(u[0] - x[0]) * p.mass**EXPONENT]


def g(x, u, p):
    return [x[0]]
"""


def test_another_time_constant_is_seen_in_the_probe() -> None:
    one, same, other = (probe(lag(time), case_of(lag(time)).system) for time in (0.2, 0.2, 0.22))
    assert same_motion(one, same)
    assert not same_motion(one, other)
