"""Steps that end between samples go on from what networks saw a whole number of samples before."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from slide_fmu.core.signals import Hold
from slide_fmu.fmu.description.variables import PARAMETERS_SETTLED
from slide_fmu.network.state_space.network import StateSpace
from tests.fmu.any_step import LASTING, both_holds, drawn, go
from tests.fmu.future import future
from tests.fmu.native import ERROR, OK, Load
from tests.fmu.samples import STEP, CellShape, Shape, random_surrogate
from tests.fmu.test_parameters import GIVEN, SHAPE, Run, inputs


@both_holds
@pytest.mark.parametrize("parts", [(0.5, 0.5), (0.2, 0.8), (0.5, 1.0, 0.5)])
def test_steps_between_samples_go_on_from_the_samples_before(
    load: Load, parts: tuple[float, ...], hold: Hold
) -> None:
    """At samples they give, to the bit, what whole steps give: nothing was forgotten on the way.
    A window that is seen anew would be off by the truncation error."""
    surrogate = random_surrogate(Shape(positions=3, cell=LASTING, hold=hold, differences=1))
    loaded, whole = load(surrogate), round(sum(parts))
    first, ends, wanted = np.zeros((1, 1)), drawn(30, 1), 5
    before = np.concatenate([first, ends[:-1]]) if hold == "first_order" else ends
    done = np.cumsum(parts) / whole
    rows = (before[:, None] + done[:, None] * (ends - before)[:, None]).reshape(-1, 1)
    one, other = loaded.instance().start(), loaded.instance().start()
    go(one, [1], first), go(other, [1], first)
    found = go(one, parts * len(ends), rows, wanted)[len(parts) - 1 :: len(parts)]
    np.testing.assert_array_equal(found, go(other, [whole] * len(ends), ends, wanted))


def test_failed_half_step_leaves_what_is_aside(load: Load) -> None:
    """The second half goes on from the sample before the first one, also when tried again."""
    surrogate = random_surrogate(Shape(cell=CellShape(), hold="first_order"))
    network = surrogate.network
    assert isinstance(network, StateSpace)
    steep = dataclasses.replace(network.cell, b=1000 * network.cell.b)
    network = StateSpace(steep, network.n_samples, network.n_out, network.features)
    native = load(dataclasses.replace(surrogate, network=network)).instance().start()
    for row in (0.1, 0.2, -0.3):
        native.step(row)
    assert native.do_step(3 * STEP, 0.5 * STEP) == OK
    native.set(3e38)
    before = future(native, 3.5 * STEP, (1.0,), 2)
    assert native.do_step(3.5 * STEP, 0.5 * STEP) == ERROR
    assert future(native, 3.5 * STEP, (1.0,), 2) == before


@both_holds
def test_step_goes_on_from_nothing_that_knows_former_parameters(load: Load, hold: Hold) -> None:
    """A whole step lies between the change and the half step that could go on."""
    loaded = load(random_surrogate(dataclasses.replace(SHAPE, hold=hold)))
    run, other, rows = Run(loaded, 2), Run(loaded, 2), inputs(30)
    assert other.set(**GIVEN) == OK
    for one in (run, other):
        one.native.start()
        for row in rows:
            one.step(row)
        one.step(rows[1], 0.5)
    assert run.set(**GIVEN) == OK
    for length in (1.0, 0.5):
        found, expected = (one.step(rows[2], length) for one in (run, other))
    assert found == pytest.approx(expected, abs=1e-4)
    assert run.get(PARAMETERS_SETTLED) == 1


def test_half_steps_count_on_since_parameters_changed(load: Load) -> None:
    """What is seen at samples counts from the change on, what is seen between them is anew."""
    loaded = load(random_surrogate(SHAPE))
    run, memory = Run(loaded, 2), loaded.surrogate.network.memory_length
    run.native.start()
    for row in inputs(30):
        run.step(row)
    assert run.set(**GIVEN) == OK
    settled = []
    for row, length in zip(inputs(5), (1.0, 0.5, 0.5, 0.5, 0.5), strict=True):
        run.step(row, length)
        settled.append(run.get(PARAMETERS_SETTLED) * memory)
    assert settled == pytest.approx([1, memory, 2, memory, 3])
