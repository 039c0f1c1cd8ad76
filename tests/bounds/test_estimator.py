"""The error estimator: what it is trained on, and that it is the same in torch and numpy."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
import torch

from slide_fmu.bounds.estimator import (
    EstimatorModule,
    NothingToEstimateError,
    _ranges,
    block_errors,
    fit_estimator,
    streamed_errors,
)
from slide_fmu.core.scaling import Affine, LogError
from slide_fmu.core.signals import Angle, FloatArray
from slide_fmu.data.trajectories import Split
from slide_fmu.features.differences import Differences
from slide_fmu.features.director import COSINE, SINE, Director
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.fitting.feed_forward import FeedForwardModule
from slide_fmu.network.feed_forward.network import FeedForward
from slide_fmu.recipe.estimator import EstimatorRecipe
from slide_fmu.recipe.learning import FeedForwardRecipe
from slide_fmu.surrogate.error_estimator import ErrorEstimator
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fitting.plants import Still
from tests.fmu.samples import Shape, random_surrogate
from tests.progress import no_stages
from tests.refusals import refused

RESOLUTION = 1e-3


def deviation_of(estimate: np.ndarray, true: np.ndarray) -> float:
    """Mean of |estimate - true| / true; errors below the resolution count as it."""
    floor = np.maximum(true, RESOLUTION)
    return float(np.mean(np.abs(np.maximum(estimate, RESOLUTION) - floor) / floor))


CRANK = Director((COSINE, SINE), Affine(np.zeros(2), np.ones(2)))
SHAPE = Shape(n_in=12, n_out=4, n_inputs=2, n_outputs=2, block=False)

ROUNDING = 5e-5
"""float32 roundings of eps, in the exponent of ten."""

SHORT = {"steps": 400, "batch": 256, "learning_rate": 0.01, "expert": {"validate_every": 200}}

LEARNT = 0.1
"""Mean relative deviation after a second of training on a smooth pattern."""


FEATURES = [
    FeatureMap(Differences(2)),
    FeatureMap(Differences(2, 1), (3, 0, 1), scaling=Affine.of_channels([0, 0, 0], [4, 1, 1])),
    FeatureMap(CRANK, scaling=Affine.of_channels([0, 0, 0, 0], [1, 1, 4, 8])),
]


@pytest.mark.parametrize("features", FEATURES, ids=["inputs", "differences", "director"])
@pytest.mark.parametrize(("positions", "n_values"), [(1, 2), (4, 2), (4, 4)])
def test_module_is_what_the_surrogate_estimates(
    positions: int, n_values: int, features: FeatureMap
) -> None:
    """Along a record, in which the inputs before a window are known; below the largest error."""
    seen_of_angle = "director" if features.features.cosines else "differences"
    surrogate = random_surrogate(dataclasses.replace(SHAPE, features=seen_of_angle))
    n_in = surrogate.window.n_in
    table = FeedForwardRecipe(family="feed_forward", hidden=(16,), activation="tanh")
    network = FeedForwardModule(table, n_in - positions + 1, features, n_values)
    network.initialise(torch.Generator().manual_seed(0))
    with torch.no_grad():
        network.linear[-1].weight *= 0.1
    log_error = LogError(-3.0, 0.5)
    module = EstimatorModule(network, positions, log_error, 2)
    estimating = dataclasses.replace(
        surrogate,
        estimator=ErrorEstimator(
            network.freeze(),
            log_error,
            positions,
            np.repeat(np.float32([[-99], [99]]), features.n_signals, axis=1),
        ),
    )
    inputs = np.random.default_rng(0).uniform(-2, 3, (60, 2))
    seen = features.along(surrogate.input_scaling.apply(inputs)[None])[0]
    windows = seen[surrogate.window.input_indices(surrogate.window.starts(60))]
    with torch.no_grad():
        eps = module(torch.from_numpy(windows)).numpy().astype(np.float64)
    expected = log_error.invert(eps) * surrogate.output_scaling.scale
    found = estimating.estimate_error(inputs)[n_in - 1 :]
    assert found == pytest.approx(expected, rel=ROUNDING)
    assert np.all(expected < 10**0.5 * surrogate.output_scaling.scale)


def split_of(
    surrogate: Surrogate, noise: Any, trajectories: int, samples: int, seed: int
) -> Split:
    """Trajectories on which the surrogate makes the errors ``noise(inputs, rng)``."""
    rng = np.random.default_rng(seed)
    inputs = rng.uniform(-2, 3, (trajectories, samples, len(surrogate.inputs)))
    outputs = np.zeros((trajectories, samples + 1, len(surrogate.outputs)))
    for row, given in zip(outputs, inputs, strict=True):
        row[1:] = surrogate.predict_newest(given) - noise(given, rng)
    return Split(inputs, outputs, np.zeros(trajectories, np.int64))


@pytest.mark.parametrize("block", [True, False])
def test_block_errors_are_the_explicit_loop(block: bool) -> None:
    surrogate = random_surrogate(dataclasses.replace(SHAPE, block=block))
    split = split_of(surrogate, lambda given, rng: rng.normal(size=given.shape), 2, 20, 0)
    found = block_errors(surrogate.window, streamed_errors(surrogate, split), 4)
    assert found.shape == split.outputs.shape
    assert not found[:, : surrogate.window.n_in].any()
    for trajectory in range(2):
        newest = surrogate.predict_newest(split.inputs[trajectory])
        for sample in range(12, 21):
            squares = np.zeros(2)
            for k in range(sample - 3, sample + 1):  # the 4 samples that end here
                squares += (newest[k - 1] - split.outputs[trajectory, k]) ** 2
            expected = np.sqrt(squares / 4) / surrogate.output_scaling.scale
            assert found[trajectory, sample] == pytest.approx(expected)


def estimator_recipe(time_invariant: bool, **changes: Any) -> EstimatorRecipe:
    network = {"family": "feed_forward", "hidden": (24,), "activation": "tanh"}
    training = {
        "steps": 800,
        "batch": 128,
        "learning_rate": 0.01,
        "expert": {"validate_every": 200},
    }
    return EstimatorRecipe.model_validate(
        {
            "network": {**network, "time_invariant": time_invariant},
            "training": training,
            **changes,
        }
    )


@pytest.mark.extended
@pytest.mark.parametrize(
    ("time_invariant", "changes"),
    [
        (True, {"expert": {"pretraining": SHORT}}),
        (True, {}),
        (False, {}),
        (True, {"expert": {"pretraining": SHORT, "lags": [0, 1, 3]}}),
        (True, {"span": 3}),
        (
            True,
            {"expert": {"pretraining": SHORT, "pretrained_beyond": False, "in_range": 0.6}},
        ),
    ],
)
def test_estimator_learns_where_the_errors_are_large(
    time_invariant: bool, changes: dict[str, Any], tmp_path: Path
) -> None:
    """Errors of random sign, ten times as large at one end of the input's range."""
    shape = Shape(n_in=6, n_out=2, n_inputs=1, n_outputs=1, block=False)
    surrogate = random_surrogate(shape)

    def noise(given: FloatArray, rng: np.random.Generator) -> FloatArray:
        return rng.choice([-1.0, 1.0], given.shape) * 0.01 * 10 ** ((given + 2) / 5)

    splits = split_of(surrogate, noise, 8, 200, 1), split_of(surrogate, noise, 2, 200, 2)
    estimator, histories = fit_estimator(
        surrogate,
        Still(1).offered(surrogate.input_scaling),
        splits,
        estimator_recipe(time_invariant, **changes),
        tmp_path / "c.pt",
        torch.device("cpu"),
        no_stages,
    )
    assert estimator.positions == (changes.get("span", 2) if time_invariant else 1)
    expert = changes.get("expert", {})
    seen = expert.get("lags", [4])[-1] + 1
    assert estimator.network.n_samples == (seen if time_invariant else 6)
    assert histories["error estimator"].step == (200, 400, 600, 800)
    assert len(histories) == (2 if "pretraining" in expert else 1)
    estimating = dataclasses.replace(surrogate, estimator=estimator)
    span = estimating.estimated_samples
    unseen = split_of(surrogate, noise, 2, 200, 3)
    first = surrogate.window.memory_length + span - 1
    true = (
        block_errors(surrogate.window, streamed_errors(surrogate, unseen), span)[:, first:]
        * surrogate.output_scaling.scale
    )
    estimate = np.stack([estimating.estimate_error(given)[first - 1 :] for given in unseen.inputs])
    deviation = deviation_of(estimate, true)
    middle = deviation_of(np.full_like(true, np.median(true)), true)
    assert deviation < LEARNT < middle / 3


def test_range_of_the_map_is_resolution_to_largest_error(tmp_path: Path) -> None:
    surrogate = random_surrogate(Shape(n_in=6, n_out=2, block=False))
    splits = tuple(
        split_of(surrogate, lambda given, rng: np.full(given.shape, 0.5), 2, 30, seed)
        for seed in (0, 1)
    )
    short = {"steps": 1, "batch": 4, "learning_rate": 0.01}
    recipe = estimator_recipe(False, expert={"resolution": 1e-2}, training=short)
    arguments = (recipe, tmp_path / "c.pt", torch.device("cpu"), no_stages)
    estimator, _ = fit_estimator(
        surrogate, Still(1).offered(surrogate.input_scaling), splits, *arguments
    )
    relative = 0.5 / float(surrogate.output_scaling.scale[0])
    assert estimator.log_error.low == pytest.approx(-2.0)
    assert estimator.log_error.high == pytest.approx(np.log10(relative) + 0.1)


def test_surrogate_without_errors_has_nothing_to_estimate(tmp_path: Path) -> None:
    surrogate = random_surrogate(Shape(block=False))
    split = split_of(surrogate, lambda given, rng: 1e-9 * given, 2, 30, 0)
    with refused(NothingToEstimateError, "below estimator.expert.resolution = 0.001: lower"):
        fit_estimator(
            surrogate,
            Still(1).offered(surrogate.input_scaling),
            (split, split),
            estimator_recipe(True),
            tmp_path / "c.pt",
            torch.device("cpu"),
            no_stages,
        )


def centred_surrogate() -> Surrogate:
    """Of two inputs, cosine and sine of an angle."""
    surrogate = random_surrogate(Shape(n_in=6, n_out=2, n_inputs=2, n_outputs=2, block=False))
    inputs = tuple(
        dataclasses.replace(signal, low=-3.0, start=None, angle=angle)
        for signal, angle in zip(surrogate.inputs, get_args(Angle), strict=True)
    )
    scaling = Affine(np.zeros(2), np.ones(2))
    return dataclasses.replace(surrogate, inputs=inputs, input_scaling=scaling)


def short_fit(folder: Path, network: dict[str, Any], **changes: Any) -> ErrorEstimator:
    """A few steps on the errors of a surrogate of two inputs."""
    surrogate = centred_surrogate()
    splits = [split_of(surrogate, lambda given, rng: 0.3 * given, 2, 30, seed) for seed in (0, 1)]
    training = {"steps": 2, "batch": 4, "learning_rate": 0.01}
    recipe = estimator_recipe(True, training=training)
    recipe = EstimatorRecipe.model_validate(
        {**recipe.model_dump(), "network": {**recipe.network.model_dump(), **network}, **changes}
    )
    estimator, _ = fit_estimator(
        surrogate,
        Still(2, angle=True).offered(surrogate.input_scaling),
        (splits[0], splits[1]),
        recipe,
        folder / "c.pt",
        torch.device("cpu"),
        no_stages,
    )
    return estimator


def test_estimator_sees_features_of_its_own(tmp_path: Path) -> None:
    """Normalised by its own training data."""
    estimator = short_fit(tmp_path, {"features": ["changes", "inputs"]})
    network = estimator.network
    assert isinstance(network, FeedForward)
    assert network.features.chosen == (2, 3, 0, 1)
    assert network.n_channels == 2
    surrogate = centred_surrogate()
    inputs = split_of(surrogate, lambda given, rng: 0.3 * given, 2, 30, 0).inputs
    seen = network.features.along(surrogate.input_scaling.apply(inputs)).astype(np.float64)
    assert seen.std((0, 1))[:2] == pytest.approx([1.0, 1.0], rel=1e-6)


FLIPPED = {"steps": 2, "batch": 4, "learning_rate": 0.01, "expert": {"flip_signs": True}}


@pytest.mark.parametrize("changes", [{"training": FLIPPED}, {"expert": {"pretraining": FLIPPED}}])
def test_signs_of_angles_are_not_flipped(tmp_path: Path, changes: dict[str, Any]) -> None:
    short_fit(tmp_path, {"features": ["changes"]}, **changes)
    with refused(ValueError, "flip_signs = true", "a training", "'turn'"):
        short_fit(tmp_path, {"features": ["turn"]}, **changes)


def test_features_that_the_training_did_not_see_count_as_the_largest_error(tmp_path: Path) -> None:
    """Up to a margin; the newest sample decides."""
    surrogate, estimator = centred_surrogate(), short_fit(tmp_path, {})
    inputs = np.concatenate(
        [split_of(surrogate, lambda given, rng: 0.3 * given, 2, 30, s).inputs for s in (0, 1)]
    )
    least, largest = inputs[:2].min((0, 1)), inputs[:2].max((0, 1))
    margin = 0.05 * (largest - least)
    assert estimator.ranges == pytest.approx(
        np.stack([least - margin, largest + margin]), abs=1e-5
    )
    record = np.repeat(0.5 * (least + largest)[None], 12, axis=0)
    record[5, 1] = largest[1] + 0.5 * margin[1]
    record[8, 0] = least[0] - 1.5 * margin[0]
    most = float(estimator.log_error.invert(np.array(1.0))) ** 2
    assert np.flatnonzero(estimator.along(record, 2)[:, 0] == most).tolist() == [8]


def test_feature_that_never_changes_is_known_up_to_rounding() -> None:
    """Two programs round it differently."""
    values = torch.zeros(2, 5, 2, dtype=torch.float64)
    values[..., 0] = torch.linspace(-1, 1, 5)
    least, largest = _ranges(values)
    assert least == pytest.approx([-1.1, 0], abs=1e-5)
    assert largest[1] - least[1] == pytest.approx(2e-6)
