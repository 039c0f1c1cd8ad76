"""The released robot sees the same when its machine is read from its own URDF."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from slide_fmu.core.measures import rms
from slide_fmu.features.chain_motion import ChainMotion
from slide_fmu.fmu.export import read_fmu
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.offers import offered_features
from slide_fmu.recipe.reading import load_recipe
from tests.recipes import whole_recipe

REPOSITORY = Path(__file__).parents[2]
ROBOT = REPOSITORY / "fmus" / "robot_6r" / "robot_6r.fmu"
SINGLE = 1e-5
"""Features are rounded to float32, and the network runs in it for some hundred steps."""


@pytest.mark.extended
def test_released_robot_gives_the_same_with_the_chain_of_its_urdf() -> None:
    """So its measured error is that of the URDF too."""
    values = load_recipe(REPOSITORY / "training" / "robot_6r.toml").model_dump()
    values["system"]["chain"] = "mbs_models/robot_6r/puma_560.urdf"
    recipe = whole_recipe(values)
    surrogate, other = read_fmu(ROBOT)[0], read_fmu(ROBOT)[0]
    offered = offered_features(recipe, case_of(recipe).system, surrogate.input_scaling)
    names = recipe.network.feature_names()
    networks = [other.network, other.estimator.network] if other.estimator else [other.network]
    assert len(networks) == 2
    for network in networks:
        network.features.features = ChainMotion.of_system(names, offered)
    phases = np.linspace(0, 20, 500)[:, None] * np.array([1.0, 1.3, 0.7, 2.1, 1.7, 2.9])
    high = np.array([signal.high for signal in surrogate.inputs])
    inputs = 0.8 * high * np.sin(phases)
    one, same = surrogate.predict(inputs), other.predict(inputs)
    assert one.shape == (500, 3)
    assert np.all(rms(one[200:]) > 1e-3)
    assert np.all(rms(one - same) < SINGLE * rms(one))
    np.testing.assert_allclose(
        other.estimate_error(inputs), surrogate.estimate_error(inputs), rtol=1e-3
    )
