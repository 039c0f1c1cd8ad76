"""Gradients over the whole window against finite differences of plain float64 loops."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from slide_fmu.surrogate.gradient import gradient, jacobian
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.plain import five_point_slope, plain_outputs
from tests.fmu.samples import SEEN, CellShape, Shape, random_surrogate
from tests.refusals import refused

ALLOWED = 1e-5
"""Relative to the largest derivative: features are rounded to single precision."""

FAMILIES = {
    "relu block": {"activation": "relu"},
    "elu, skip": {"activation": "elu", "skip": True, "hidden": (9, 5)},
    "gelu, some ages": {"activation": "gelu", "ages": 4, "block": False},
    "cubic at positions": {"activation": "cubic", "block": False},
    "tanh": {"activation": "tanh", "block": False, "skip": True},
    "tanh cell": {"cell": CellShape(4, 6)},
    "mixed cell": {"cell": CellShape(4, 7, "mixed", roles=True)},
    "cubic cell": {"cell": CellShape(4, 6, "cubic", roles=True, factors=2)},
    "cell with sub-steps": {"cell": CellShape(3, 4, "mixed", substeps=3)},
    "gated cell": {"cell": CellShape(5, 6, "gated", turned=2, factors=2)},
}
CASES = list(itertools.product(SEEN, FAMILIES))


def surrogate_of(seen: str, family: str) -> Surrogate:
    shape = Shape(n_in=8, n_out=3, n_outputs=2, seed=3)
    return random_surrogate(replace(shape, **SEEN[seen], **FAMILIES[family]))


def some_windows(surrogate: Surrogate, batch: int = 2) -> np.ndarray:
    rng = np.random.default_rng(4)
    size = (batch, surrogate.window.n_in, len(surrogate.inputs))
    return 1.0 + np.cumsum(rng.normal(0, 0.05, size), axis=1)


@pytest.mark.parametrize(("seen", "family"), CASES, ids=map(" ".join, CASES))
def test_jacobian_is_that_of_plain_loops(seen: str, family: str) -> None:
    surrogate = surrogate_of(seen, family)
    windows = some_windows(surrogate)
    found = jacobian(surrogate, windows)
    assert found.shape == (2, 3, 2, 8, len(surrogate.inputs))
    for b, direction in itertools.product(range(2), np.eye(8)[[0, 2, 7]]):
        moved = direction[:, None] * np.linspace(-1, 0.7, len(surrogate.inputs))
        expected = five_point_slope(
            lambda amount, b=b, d=moved: plain_outputs(surrogate, windows[b] + amount * d)
        )
        allowed = ALLOWED * np.abs(found[b]).max()
        along = np.einsum("ijkl,kl->ij", found[b], moved)
        np.testing.assert_allclose(along, expected, rtol=0, atol=allowed)


@pytest.mark.parametrize("family", ["elu, skip", "gated cell"])
def test_gradient_is_a_product_with_the_jacobian(family: str) -> None:
    surrogate = surrogate_of("chain", family)
    windows = some_windows(surrogate, 3)
    weights = np.random.default_rng(5).normal(size=(3, 3, 2))
    expected = np.einsum("bij,bijkl->bkl", weights, jacobian(surrogate, windows))
    found = gradient(surrogate, windows, weights)
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12 * np.abs(expected).max())


def test_gradient_of_a_window_does_not_depend_on_the_others() -> None:
    surrogate = surrogate_of("differences", "tanh cell")
    windows = some_windows(surrogate, 3)
    together = jacobian(surrogate, windows)
    np.testing.assert_allclose(together[1:2], jacobian(surrogate, windows[1:2]), rtol=1e-12)


def test_gradient_of_wrong_shapes_and_values_is_refused() -> None:
    surrogate = surrogate_of("inputs", "tanh cell")
    windows, weights = some_windows(surrogate), np.ones((2, 3, 2))
    with refused(ValueError, "expected (B", "windows of"):
        jacobian(surrogate, windows[:, 1:])
    with refused(ValueError, "expected (B", "weights of"):
        gradient(surrogate, windows, weights[:, 1:])
    with refused(ValueError, "expected those of", "1 windows"):
        gradient(surrogate, windows, weights[1:])
    windows[0, 0, 0] = np.nan
    with refused(ValueError, "not finite"):
        jacobian(surrogate, windows)


@pytest.mark.parametrize("family", ["relu block", "tanh"])
def test_gradient_of_no_windows_is_empty(family: str) -> None:
    surrogate = random_surrogate(Shape(**FAMILIES[family]))
    window, n = surrogate.window, len(surrogate.outputs)
    windows = np.zeros((0, window.n_in, len(surrogate.inputs)))
    assert gradient(surrogate, windows, np.zeros((0, window.n_out, n))).shape == windows.shape
    assert len(jacobian(surrogate, windows)) == 0
