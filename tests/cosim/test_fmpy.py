"""What fmpy's own simulation gives of inputs that move, which is the plain call."""

from __future__ import annotations

from pathlib import Path

import fmpy
import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.export import export_fmu
from slide_fmu.importer.file import unpacked
from slide_fmu.importer.instance import instantiated
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.moving_inputs import MovingOracle, forecasting
from tests.fmu.samples import STEP, Shape, random_surrogate
from tests.libraries import build_libraries
from tests.refusals import refused

COUNT = 60
TOLERANCE = 4e-5
"""Of single precision, for outputs of a few units."""


@pytest.fixture(scope="module")
def surrogate() -> Surrogate:
    return forecasting(random_surrogate(Shape(hold="first_order", differences=1)))


@pytest.fixture(scope="module")
def fmu(surrogate: Surrogate, tmp_path_factory: pytest.TempPathFactory) -> Path:
    build_libraries()
    return export_fmu(surrogate, tmp_path_factory.mktemp("fmpy") / "one.fmu")


def heights() -> FloatArray:
    return np.asarray(0.5 + 0.4 * np.sin(0.3 * np.arange(COUNT)))


def table() -> np.ndarray:
    rows = np.zeros(COUNT, dtype=[("time", float), ("u0", float)])
    rows["time"], rows["u0"] = STEP * np.arange(COUNT), heights()
    return rows


def run(fmu: Path, **others: object) -> FloatArray:
    settings = {"stop_time": STEP * (COUNT - 1), "output_interval": STEP, "output": ["y0"]}
    found = fmpy.simulate_fmu(str(fmu), input=table(), **settings, **others)
    return np.asarray(found["y0"])


def test_plain_simulation_has_the_outputs_of_the_forecast(fmu: Path, surrogate: Surrogate) -> None:
    moving = MovingOracle(surrogate)
    expected = [moving.step(STEP, row).results()[0][0] for row in heights()[:-1, None]]
    np.testing.assert_allclose(run(fmu)[1:], expected, rtol=0, atol=TOLERANCE)


def test_plain_simulation_is_late_where_values_count_as_those_of_the_step_end(
    fmu: Path, surrogate: Surrogate
) -> None:
    found = run(fmu, start_values={"inputs_at_step_end": 1})
    late = surrogate.predict_newest(heights()[:-1, None])[:, 0]
    np.testing.assert_allclose(found[1:], late, rtol=0, atol=TOLERANCE)


def test_fmpy_has_room_for_the_derivatives_of_nine_inputs_only(fmu: Path) -> None:
    """When this fails, fmpy is repaired, and docs/use_an_fmu.md says too much."""
    with refused(ValueError, "assign sequence"):
        run(fmu, set_input_derivatives=True)


def test_derivatives_can_be_told_in_a_loop_of_ones_own(fmu: Path, surrogate: Surrogate) -> None:
    """By the call that docs/use_an_fmu.md names."""
    moving, slopes = MovingOracle(surrogate), 0.4 * 0.3 / STEP * np.cos(0.3 * np.arange(COUNT))
    found, expected = [], []
    with unpacked(fmu) as files, instantiated(files) as instance:
        calls = instance.calls
        instance.set_up({})
        instance.enter_initialization()
        instance.exit_initialization()
        for k, (height, slope) in enumerate(zip(heights(), slopes, strict=True)):
            calls.setReal([0], [height])
            calls.setRealInputDerivatives([0], [1], [slope])
            calls.doStep(k * STEP, STEP)
            found += calls.getReal([1_000_000])
            known = moving.step(STEP, np.array([height]), np.array([slope]))
            expected.append(known.results()[0][0])
    np.testing.assert_allclose(found, expected, rtol=0, atol=TOLERANCE)
