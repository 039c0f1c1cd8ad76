"""A lag of first order, and the surrogate that is exact for it where inputs are as in training."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np

from slide_fmu.bounds.input_forecast import fit_forecast
from slide_fmu.core.scaling import Affine
from slide_fmu.core.signals import Hold
from slide_fmu.core.window import Window
from slide_fmu.features.differences import Differences
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.network.feed_forward.network import FeedForward, Layer
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.samples import sum_surrogate
from tests.recipes import TINY, merged, whole_recipe

STEP, LAG, WINDOW = 0.0625, 0.25, 80
MODEL = f"""
inputs = {{"drive": {{"unit": "N", "range": [-3.0, 5.0]}}}}
outputs = {{"level": {{"unit": "m", "range": [-5.0, 5.0]}}}}
start = [0.0]

def f(x, u, p):
    return [(u[0] - x[0]) / {LAG}]

def g(x, u, p):
    return [x[0]]
"""


def lag_recipe(folder: Path, hold: Hold) -> Recipe:
    """A lag of first order, as a function."""
    (folder / "lag.py").write_text(MODEL, encoding="utf-8")
    tables = tomllib.loads(TINY)
    tables["system"] = {
        "model": str(folder / "lag.py"),
        "kind": "function",
        "inputs": {"drive": {"hold": hold}},
    }
    window = {"step": STEP, "n_in": WINDOW, "n_out": 1}
    data = {"duration": 20.0, "burn_in": 5.0}
    return whole_recipe(merged(tables, {"window": window, "data": data}))


def lag_surrogate(recipe: Recipe, hold: Hold) -> Surrogate:
    """The exact answer to inputs that are held, or move along lines, over a window of 20 lags."""
    system, ratio = case_of(recipe).reference, STEP / LAG
    pole = np.exp(-ratio)
    now, before = 1 - (1 - pole) / ratio, (1 - pole) / ratio - pole
    weights = pole ** np.arange(WINDOW)
    weights = (1 - pole) * weights
    if hold == "first_order":
        weights = now * pole ** np.arange(WINDOW)
        weights[1:] += before * pole ** np.arange(WINDOW - 1)
    layer = Layer(weights[None, ::-1].astype(np.float32), np.zeros(1, np.float32), "identity")
    unit = Affine.of_channels([0.0], [1.0])
    rng = np.random.default_rng(0)
    frequencies, phases = rng.uniform(0.02, 0.4, (2, 12, 4, 1))
    drawn = np.sin(frequencies * np.arange(600) + 10 * phases).sum(axis=1)[:, :, None]
    return replace(
        sum_surrogate(WINDOW, hold),
        name="tiny",
        window=Window(STEP, WINDOW, 1),
        inputs=system.inputs,
        outputs=system.outputs,
        input_scaling=Affine.of_channels([1.0], [4.0]),
        output_scaling=unit,
        network=FeedForward((scaled(layer),), WINDOW, FeatureMap(Differences(1))),
        forecast=fit_forecast(system.inputs, drawn, planned=False),
    )


def scaled(layer: Layer) -> Layer:
    """The same of inputs that are scaled by the middle 1 N and the half range 4 N."""
    total = np.array([layer.weights.sum()], np.float32)
    return Layer(4 * layer.weights, total, "identity")
