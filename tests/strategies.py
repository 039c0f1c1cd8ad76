"""Hypothesis strategies, all of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from hypothesis import strategies as st

from slide_fmu.core.scaling import Affine, LogError
from slide_fmu.core.window import Window
from slide_fmu.network.activations import ACTIVATIONS
from slide_fmu.network.state_space.cell import CELL_ACTIVATIONS, GATED, Roles
from tests.fmu.samples import CellShape, Shape

if TYPE_CHECKING:
    from slide_fmu.fitting.state_space.cell import CellShape as LearntShape

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
    few = st.sampled_from([2, 4]) if kind == "director" else st.integers(1, most)
    n_inputs = draw(few)
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
        parameters=draw(st.sampled_from([0, 0, 1, 2])),
        substeps=draw(st.sampled_from([1, 1, 2, 3])),
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


@st.composite
def linear_systems(draw: st.DrawFn) -> tuple[np.ndarray, tuple[int, int, int, int], int]:
    """Eigenvalues, known or not, of growing or overdamped modes too; sizes; a seed."""
    values = draw(
        st.lists(
            st.complex_numbers(max_magnitude=60, allow_nan=False, allow_infinity=False).map(
                lambda v: complex(min(v.real, 2.0), abs(v.imag))
            ),
            max_size=8,
        )
    )
    pairs = draw(st.integers(1, 6))
    order = 2 * pairs + draw(st.integers(0, 5))
    vectors = st.sampled_from([3, 6, 9])
    return (
        np.array(values, complex),
        (order, pairs, draw(vectors), draw(vectors)),
        draw(st.integers(0, 99)),
    )


@st.composite
def point_to_point_tables(draw: st.DrawFn) -> dict[str, Any]:
    """Settings of point-to-point motions: fast and slow, with and without rests."""
    pairs = st.tuples(st.floats(0.05, 3.0), st.floats(0.05, 3.0)).map(sorted)
    share = draw(st.floats(0, 1))
    return dict(
        duration=draw(pairs),
        dwell_duration=draw(pairs),
        ramp=draw(st.tuples(st.floats(0.05, 0.5), st.floats(0.05, 0.5)).map(sorted)),
        speed=draw(st.lists(st.floats(0.1, 10), min_size=4, max_size=4)),
        acceleration=draw(st.lists(st.floats(0.1, 50), min_size=4, max_size=4)),
        reach=draw(st.floats(0.01, 1)),
        keep=share,
        single=(1 - share) * draw(st.floats(0, 0.99)),
        dwell=draw(st.floats(0, 1)),
    )


@st.composite
def learnt_cell_shapes(draw: st.DrawFn) -> LearntShape:
    """Small cells that are learnt: all sorts of units or none, of roles, factors, turned pairs."""
    from slide_fmu.fitting.state_space.cell import CellShape as LearntShape  # loads torch

    units = draw(st.sampled_from(["tanh", "cubic", "mixed", "gated"]))
    gated = units == "gated"
    n_states, n_features = draw(st.integers(1, 4)), draw(st.integers(1, 3))
    one, any_number = (
        st.lists(st.integers(0, n_features - 1), min_size=least, max_size=3, unique=True).map(
            tuple
        )
        for least in (1, 0)
    )
    drive = draw(one)
    turned = draw(st.integers(0, n_states // 2)) if gated else 0
    roles = Roles(
        drive,
        draw(st.just(drive) | one),
        draw(any_number) if gated else (),
        draw(one) if gated else (),
        draw(any_number),
        (n_features, n_features + 1) if turned else (),
    )
    bias = gated or draw(st.booleans())
    n_units, n_outputs = draw(st.integers(0, 4)), draw(st.integers(1, 3))
    substeps = draw(st.sampled_from([1, 1, 3]))
    sizes = n_states, n_units, n_outputs
    return LearntShape(*sizes, roles, units, bias, turned, substeps=substeps)
