"""Planned motions have one bound in the plain call, and one where they are known."""

from __future__ import annotations

import ctypes
import dataclasses

import numpy as np
import pytest

from tests.bounded import bounded_surrogate, with_plain, with_span
from tests.fmu.native import OK, Load, Loaded, Native
from tests.fmu.test_error_bounds import BLOCKS, SHAPES, go, judging, read, surrogate_of
from tests.fmu.test_estimates import PATTERNS
from tests.fmu.test_moving_inputs import set_at_step_end


@pytest.mark.parametrize("name", ["judged", "both_span", "both_seen"])
def test_each_call_has_its_own_bound(load: Load, name: str) -> None:
    surrogate = surrogate_of("judged")
    if name == "both_seen":
        shape = dataclasses.replace(SHAPES["judged"], positions=3)
        surrogate = judging(bounded_surrogate(shape, BLOCKS))
    surrogate = with_plain(with_span(surrogate) if name == "both_span" else surrogate)
    bound = surrogate.bound
    assert bound is not None
    alone = {0.0: bound.plain, 1.0: dataclasses.replace(bound, plain=None)}
    both = load(surrogate)
    for at_step_end, own in alone.items():
        results = [
            go(started(one, at_step_end), surrogate, PATTERNS["odd"], lambda k: k % 3 > 0)[1]
            for one in (
                both,
                load(dataclasses.replace(surrogate, name=f"own_{at_step_end:g}", bound=own)),
                load(
                    dataclasses.replace(
                        surrogate, name=f"other_{at_step_end:g}", bound=alone[1 - at_step_end]
                    )
                ),
            )
        ]
        assert results[0] == results[1]
        found, others = (np.array(list(rows.values()))[:, :3] for rows in results[1:])
        assert not np.isclose(found, others, rtol=0.01).any(axis=1).all()


@pytest.mark.parametrize("at_step_end", [0.0, 1.0])
def test_bound_read_before_the_call_was_chosen_is_that_of_the_chosen_one(
    load: Load, at_step_end: float
) -> None:
    surrogate = with_plain(surrogate_of("judged"))
    loaded, steps = load(surrogate), [1.0] * 30
    expected = go(started(loaded, at_step_end), surrogate, steps, lambda k: k > 20)[1]
    native = loaded.instance()
    set_at_step_end(native, 1 - at_step_end)
    zero = ctypes.c_double(0)
    assert native.call("fmi2SetupExperiment", 0, zero, zero, 0, zero) == OK
    assert native.call("fmi2EnterInitializationMode") == OK
    read(native, surrogate)
    set_at_step_end(native, at_step_end)
    assert native.call("fmi2ExitInitializationMode") == OK
    assert go(native, surrogate, steps, lambda k: k > 20)[1] == expected


def started(loaded: Loaded, at_step_end: float) -> Native:
    """An instance whose inputs are set to what they are at the start or at the end of a step."""
    native = loaded.instance()
    set_at_step_end(native, at_step_end)
    return native.start()
