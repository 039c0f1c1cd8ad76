"""The same calls, legal and illegal, to a torch module's FMU and to the native one."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave

from slide_fmu.core.signals import Hold
from slide_fmu.fmu.export import export_fmu
from slide_fmu.python_fmu.torch_export import export_module
from tests.fmu.samples import STEP
from tests.python_fmu.modules import (
    CLOSE,
    IN_RANGE,
    PARAMETERS,
    RESULTS,
    saved,
    start,
    surrogate_with,
)

CALLS = 250
VARIABLES = [0, 1, *RESULTS, *PARAMETERS]
LENGTHS = [1.0, 1.0, 1.0, 2.0, 3.0, 12.0, 13.0, 0.3, 0.01, 1.7, 20.5, 1 + 1e-8]
"""Communication steps in h; the window has 12 samples."""
NO_STEPS = [0.0, -1.0, float("nan"), float("inf"), 1e15]
NO_POINTS = [-1.0, 1.0, 1e-3, float("nan")]
"""Distances from the present time in h."""
NO_VALUES = [float("nan"), float("inf"), -float("inf"), 1e300]


def accepted(call: Callable[..., object], *arguments: object) -> bool:
    """Whether a call is answered with fmi2OK."""
    try:
        call(*arguments)
    except FMICallException:
        return False
    return True


class Pair:
    """A native FMU and one with a torch module, called alike. Final.

    Attributes:
        time: of both, in s.
    """

    def __init__(self, native: FMU2Slave, module: FMU2Slave) -> None:
        self.native, self.module = native, module
        self.both = (native, module)
        self.time = 0.0
        self.saved: tuple[float, list[object]] | None = None

    def compare(self) -> None:
        expected, found = (np.array(slave.getReal(VARIABLES)) for slave in self.both)
        np.testing.assert_allclose(found, expected, rtol=0, atol=8 * CLOSE)
        np.testing.assert_allclose(found[[0, 1, 4]], expected[[0, 1, 4]], rtol=1e-12, atol=0)
        assert found[5:].tolist() == expected[5:].tolist()
        truths = [slave.getBoolean([IN_RANGE]) for slave in self.both]
        assert truths[0] == truths[1]

    def set(self, references: list[int], values: list[float]) -> bool:
        """PythonFMU has no status for values that are refused: the next step is, instead."""
        good = accepted(self.native.setReal, references, values)
        self.module.setReal(references, values)
        if not good:
            assert not accepted(self.module.doStep, self.time, STEP)
        return good

    def step(self, point: float, length: float) -> bool:
        good, other = (accepted(slave.doStep, point, length) for slave in self.both)
        assert good == other
        self.time += length if good else 0.0
        return good

    def save(self) -> None:
        blobs = [slave.serializeFMUstate(slave.getFMUstate()) for slave in self.both]
        self.saved = self.time, blobs

    def restore(self) -> None:
        if self.saved is not None:
            self.time = self.saved[0]
            for slave, data in zip(self.both, self.saved[1], strict=True):
                slave.setFMUstate(slave.deSerializeFMUstate(data))

    def begin(self, start: float, parameters: list[float]) -> None:
        """Reset, and go to step mode; nobody may set parameters afterwards."""
        self.time = start
        for slave in self.both:
            slave.reset()
            slave.setupExperiment(startTime=start)
            slave.enterInitializationMode()
            slave.setReal(PARAMETERS, parameters)
            slave.exitInitializationMode()


def call_at_random(pair: Pair, rng: np.random.Generator, done: dict[str, int]) -> None:
    """One call; what it was is counted."""
    values = rng.uniform(-2.5, 3.5, 2).tolist()
    name = str(rng.choice(["go", "go", "go", "go", "wrong", "value", "variable", "state", "new"]))
    match name:
        case "go":
            assert pair.set([0, 1], values)
            name += str(pair.step(pair.time, STEP * float(rng.choice(LENGTHS))))
        case "wrong" if rng.random() < 0.5:
            name += str(pair.step(pair.time, STEP * float(rng.choice(NO_STEPS))))
        case "wrong":
            name += str(pair.step(pair.time + STEP * float(rng.choice(NO_POINTS)), STEP))
        case "value":
            name += str(pair.set([0, 1], [values[0], float(rng.choice(NO_VALUES))]))
        case "variable":
            name += str(
                pair.set(
                    [0, int(rng.choice([2, RESULTS[0], IN_RANGE, PARAMETERS[0], PARAMETERS[2]]))],
                    [values[0], 1.0],
                )
            )
        case "state" if rng.random() < 0.5:
            pair.save()
        case "state":
            pair.restore()
        case "new" if rng.random() < 0.3:
            known = float(rng.integers(2))
            pair.begin(float(rng.uniform(-1, 5)), [known, *rng.uniform(-2, 3, 2).tolist()])
    done[name] = done.get(name, 0) + 1


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("hold", ["zero_order", "first_order"])
def test_the_same_calls_give_the_same(hold: Hold, seed: int, tmp_path: Path) -> None:
    surrogate = surrogate_with(hold)
    native = export_fmu(surrogate, tmp_path / "native.fmu")
    module = export_module(*saved(surrogate, tmp_path, ".pt"), tmp_path / "module.fmu")
    pair = Pair(start(native, tmp_path / "a"), start(module, tmp_path / "b"))
    rng, done = np.random.default_rng(seed), dict[str, int]()
    for _ in range(CALLS):
        call_at_random(pair, rng, done)
        pair.compare()
    assert {"goTrue", "wrongFalse", "valueFalse", "variableFalse", "state", "new"} == set(done)
    for slave in pair.both:
        slave.freeInstance()
