"""Small surrogates with an error bound, and plain loops over the definition of its trust."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from slide_fmu.core.block_means import N_BLOCKS
from slide_fmu.core.signals import FloatArray
from slide_fmu.surrogate.bound_statistics import logarithms
from slide_fmu.surrogate.error_bound import LocalErrors
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.samples import CellShape, Shape

SHAPE = Shape(
    n_in=9, n_out=4, n_inputs=2, n_outputs=2, differences=1, cell=CellShape(contraction=0.9)
)
SEEING = replace(SHAPE, positions=3)
"""Of a surrogate with an error estimator."""


def record(surrogate: Surrogate, count: int = 60, seed: int = 0) -> FloatArray:
    rng = np.random.default_rng(seed)
    return rng.uniform(-2, 3, (count, len(surrogate.inputs)))


def plain_mean(values: list[float], k: int, block: int) -> float:
    """Over the last whole blocks and the begun one; before the record, its first value."""
    first = (k // block - N_BLOCKS) * block
    taken = [values[max(i, 0)] for i in range(first, k + 1)]
    return math.fsum(taken) / len(taken)


def plain_trust(surrogate: Surrogate, inputs: FloatArray) -> LocalErrors:
    """Sample by sample, from states that are found by runs from zero."""
    bound = surrogate.bound
    assert bound is not None
    companion, n = bound.companion, bound.companion.n_samples
    scaled = surrogate.input_scaling.apply(inputs)
    held = np.concatenate([np.repeat(scaled[:1], 3 * n, axis=0), scaled])
    features = companion.features.along(held[None])[0]
    of_companion = companion.stream(scaled[None])[0].astype(float)
    predicted = surrogate.network.stream(scaled[None])[0].astype(float)
    squares = (predicted - of_companion) ** 2
    seen = []
    for k in range(len(scaled)):
        age = (k - 1) % n  # of the younger state, which began at sample k - age
        begin = 3 * n + k - age - n
        x = companion.run(features[None, begin : 3 * n + k + 1])[1][0]
        drive = features[3 * n + k, list(companion.roles.drive)]
        seen.append([*x.astype(float), *drive.astype(float)])
    found, disagreement, novelty = [], [], []
    for k in range(len(scaled)):
        short, long = (
            [plain_mean(squares[:, i].tolist(), k, block) for i in range(squares.shape[1])]
            for block in bound.blocks
        )
        columns = [[row[i] ** 2 for row in seen] for i in range(len(seen[0]))]
        levels = [plain_mean(column, k, bound.blocks[1]) for column in columns]
        watched = [*short, *long, *levels]
        expected = [] if bound.estimator is None else bound.estimator.along(scaled[: k + 1], 2)[k]
        every = zip((*squares[k], *watched, *expected), bound.quietest, strict=True)
        logs = [max(float(logarithms(np.array(v))), least) for v, least in every]
        values = bound.head.evaluate(np.array([*seen[k], *logs])[None, None])[0]
        found.append([2.0 ** float(v) for v in values])
        disagreement.append([math.sqrt(max(*p)) for p in zip(squares[k], short, strict=True)])
        pairs = zip(watched, bound.limits, strict=True)
        novelty.append(math.sqrt(max(mean / limit for mean, limit in pairs)))
    scales, rms = np.split(np.array(found), [squares.shape[1]], axis=1)
    return LocalErrors(
        scales, np.array(disagreement), np.array(novelty), rms if bound.span else None
    )
