"""Hypothesis strategies, all of them."""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import strategies as st

from slide_fmu.core.scaling import Affine, LogError
from slide_fmu.core.window import Window
from slide_fmu.network.activations import ACTIVATIONS
from slide_fmu.network.state_space import CELL_ACTIVATIONS, GATED
from tests.fmu.samples import CellShape, Shape

numbers = st.floats(-1e6, 1e6)
scales = st.floats(1e-6, 1e6)


@st.composite
def windows(draw: st.DrawFn) -> Window:
    """Windows of up to 12 samples."""
    n_in = draw(st.integers(1, 12))
    return Window(0.1, n_in, draw(st.integers(1, n_in)))


@st.composite
def affines(draw: st.DrawFn) -> Affine:
    """Affine maps of up to three channels."""
    count = draw(st.integers(1, 3))
    values = [draw(st.lists(kind, min_size=count, max_size=count)) for kind in (numbers, scales)]
    return Affine.of_channels(*values)


@st.composite
def log_errors(draw: st.DrawFn) -> LogError:
    """Logarithmic maps between 0.1 and 10 decades wide, of small and large errors."""
    low = draw(st.floats(-10, 5))
    return LogError(low, low + draw(st.floats(0.1, 10)))


@st.composite
def seen_features(draw: st.DrawFn, most: int = 3) -> dict[str, Any]:
    """Inputs and the features formed of them: arguments of Shape."""
    kind = draw(st.sampled_from(["differences", "differences", "director", "chain"]))
    n_inputs = 2 if kind == "director" else draw(st.integers(1, most))
    return {
        "n_inputs": n_inputs,
        "features": kind,
        "differences": draw(st.integers(0, 2)),
    }


@st.composite
def surrogate_shapes(draw: st.DrawFn) -> Shape:
    """Shapes of small surrogates: one-sample or block, with and without skip and estimator."""
    n_in = draw(st.integers(1, 10))
    return Shape(
        n_in=n_in,
        n_out=draw(st.integers(1, n_in)),
        n_outputs=draw(st.integers(1, 3)),
        hidden=tuple(draw(st.lists(st.integers(1, 6), max_size=2))),
        activation=draw(st.sampled_from(list(ACTIVATIONS))),
        block=draw(st.booleans()),
        skip=draw(st.booleans()),
        **draw(estimators()),
        seed=draw(st.integers(0, 1000)),
        **draw(seen_features()),
    )


@st.composite
def estimators(draw: st.DrawFn) -> dict[str, Any]:
    """None, or one over a span that may be longer than the window."""
    return {
        "positions": draw(st.integers(0, 14)),
        "estimator_samples": draw(st.integers(1, 6)),
        "ages": draw(st.integers(0, 4)),
        "means": draw(st.booleans()),
        "narrow": draw(st.booleans()),
    }


@st.composite
def cell_shapes(draw: st.DrawFn) -> CellShape:
    """Small cells of all kinds."""
    activation, states = draw(st.sampled_from(CELL_ACTIVATIONS)), draw(st.integers(1, 10))
    return CellShape(
        states=states,
        units=draw(st.integers(0, 10)),
        activation=activation,
        roles=draw(st.booleans()),
        turned=draw(st.integers(0, states // 2)) if activation == GATED else 0,
        factors=draw(st.sampled_from([0, 0, 1, 3])),
    )


@st.composite
def state_space_shapes(draw: st.DrawFn) -> Shape:
    """Shapes of small state-space surrogates, with and without units and estimator."""
    n_in = draw(st.integers(1, 10))
    return Shape(
        n_in=n_in,
        n_out=draw(st.integers(1, n_in)),
        n_outputs=draw(st.integers(1, 3)),
        hidden=(4,),
        **draw(estimators()),
        seed=draw(st.integers(0, 1000)),
        hold=draw(st.sampled_from(["zero_order", "first_order"])),
        cell=draw(cell_shapes()),
        **draw(seen_features()),
    )


def all_shapes() -> st.SearchStrategy[Shape]:
    """Shapes of small surrogates of both families."""
    return surrogate_shapes() | state_space_shapes()


def records(n_channels: int, max_samples: int = 40) -> st.SearchStrategy[np.ndarray]:
    """Random input records of shape (samples, n_channels), at least one sample."""
    return st.builds(
        lambda seed, count: np.random.default_rng(seed).uniform(-2, 3, (count, n_channels)),
        st.integers(0, 1000),
        st.integers(1, max_samples),
    )
