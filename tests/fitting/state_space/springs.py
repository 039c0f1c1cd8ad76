"""A map of two states that stands for a spring, and fits of state-space networks to it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch

from slide_fmu.core.progress import Progress
from slide_fmu.core.scaling import Affine
from slide_fmu.core.window import Window
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.features.serial_chain import SerialChain
from slide_fmu.fitting.feature_choice import choose_features
from slide_fmu.fitting.history import History
from slide_fmu.fitting.problem import Problem
from slide_fmu.fitting.state_space.fit import fit_state_space
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.recipe.learning import LeastSquaresExpert, LeastSquaresRecipe, StateSpaceRecipe
from tests.fitting.plants import Still
from tests.progress import silent
from tests.recipes import with_expert

Pair = tuple[torch.Tensor, torch.Tensor]

POLE = complex(0.5, math.sqrt(0.05))
"""Of the spring at rest, with its conjugate; its radius is 0.548."""

WINDOW = Window(0.1, 32, 4)
FORGOTTEN = 1e-6
"""Relative RMS error of a linear network: what 28 samples do not forget, and float32."""
SMALL = 3e-3
"""Error of a small nonlinear network after a second, relative to outputs of about 0.4; the best
linear one has 3e-2."""
CUBIC = 0.5
"""Cubic share of the spring: at the largest deflections a third of the linear one."""
EIGENVALUES = np.array([np.log(POLE) / WINDOW.step])
"""Of the spring at rest in 1/s."""

QUICK = LeastSquaresRecipe(
    starts=3,
    iterations=12,
    expert=LeastSquaresExpert(segment=32, part=2, start_iterations=6, kept=2, kept_iterations=6),
)
"""A training of a second."""

NONLINEAR = {"order": 2, "hidden": 8}
"""Sizes that the nonlinear spring is learnt with."""


def answers(inputs: torch.Tensor, cubic: float) -> torch.Tensor:
    """Positions of a damped mass on a spring from rest, one sample more than inputs."""
    outputs = inputs.new_zeros(len(inputs), inputs.shape[1] + 1, 1)
    position = velocity = inputs.new_zeros(len(inputs))
    for k, force in enumerate(inputs[:, :, 0].T):
        velocity = 0.3 * velocity - 0.6 * position - cubic * position**3 + force
        position = position + 0.5 * velocity
        outputs[:, k + 1, 0] = position
    return outputs


def spring(
    seed: int, count: int, samples: int, cubic: float = 0.0, amplitude: float = 1.0
) -> Pair:
    """Records of the spring.

    Returns:
        Inputs up to the amplitude, (count, samples, 1), and outputs one sample longer. The inputs
        are numbers that float32 has.
    """
    values = np.random.default_rng(seed).uniform(-1, 1, (count, samples, 1))
    inputs = (amplitude * torch.from_numpy(values)).float().double()
    return inputs, answers(inputs, cubic)


@dataclass(frozen=True)
class Fitted:
    """What a fit gives, after how many iterations of all runs, with its table and its weights."""

    network: StateSpace
    history: History
    iterations: int
    table: Any

    @property
    def content(self) -> bytes:
        cell = self.network.cell
        parts = (cell.a, cell.b, cell.e, cell.w, cell.c, cell.d, cell.d0)
        products = [] if cell.v is None else [cell.v]
        return b"".join(part.tobytes() for part in (*parts, *products))

    @property
    def error(self) -> float:
        return min(self.history.validation_error)


def map_of(
    inputs: torch.Tensor, names: tuple[str, ...], chain: SerialChain | None = None
) -> FeatureMap:
    """Features of some names, normalised by these inputs."""
    n = inputs.shape[2]
    scaling = Affine(np.zeros(n), np.ones(n))
    return choose_features(names, Still(n, chain).offered(scaling), inputs.double().numpy())


def seen(features: FeatureMap, records: Pair) -> Pair:
    """Records as a network sees them, in their precision."""
    inputs, outputs = records
    return torch.from_numpy(features.along(inputs.numpy())).to(inputs), outputs


def problem_of(
    folder: Path,
    cubic: float = CUBIC,
    names: tuple[str, ...] = ("inputs",),
    chain: SerialChain | None = None,
    **changes: Any,
) -> Problem:
    """A fit to the spring; ``training``, ``validation`` and ``beyond`` are records with inputs."""
    pairs = {"training": spring(1, 6, 160, cubic), "validation": spring(2, 2, 160, cubic)}
    pairs |= {name: changes.pop(name) for name in (*pairs, "beyond") if changes.get(name)}
    features = map_of(pairs["training"][0], names, chain)
    records = {name: seen(features, pair) for name, pair in pairs.items()}
    problem = Problem(
        WINDOW,
        features,
        records.pop("training"),
        records.pop("validation"),
        folder / "c.pt",
        EIGENVALUES,
    )
    return replace(problem, **records, **changes)


def quick(**changes: Any) -> LeastSquaresRecipe:
    """Return the quick training with other keys, also those of its table ``expert``."""
    found = with_expert(QUICK, **changes)
    assert isinstance(found, LeastSquaresRecipe)
    return found


def fit(
    problem: Problem,
    network: dict[str, Any],
    progress: Progress = silent,
    **training: Any,
) -> Fitted:
    recipes = StateSpaceRecipe(**network), quick(**training)
    last = 0

    def tell(done: int, total: int, best: float) -> None:
        nonlocal last
        last = done
        progress(done, total, best)

    found = fit_state_space(problem, *recipes, tell)
    assert isinstance(found.network, StateSpace)
    return Fitted(found.network, found.history, last, found.table)


def relative_error(network: StateSpace, records: Pair) -> float:
    """Error of the network at all samples of records from rest, in the way of the FMU."""
    inputs, outputs = (values.numpy() for values in records)
    settled = network.n_samples
    error = (network.stream(inputs) - outputs[:, 1:])[:, settled:]
    return float(np.sqrt(np.mean(error**2) / np.mean(outputs[:, settled:] ** 2)))
