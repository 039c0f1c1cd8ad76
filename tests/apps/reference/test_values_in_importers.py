"""Physical parameters of FMUs in real importers, by the SSV files of an SSP and one by one."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from fmpy.ssp.simulation import simulate_ssp
from fmpy.ssp.ssd import read_ssd, read_ssv

from slide_fmu.core.signals import FloatArray
from slide_fmu.cosim.ssp import Connection, write_system
from slide_fmu.cosim.ssv import SET
from slide_fmu.fmu.export import export_fmu
from slide_fmu.surrogate.surrogate import Surrogate
from tests.acceptance.importers import needs, run_ecos, run_libcosim
from tests.fmu.samples import STEP, CellShape, Shape, random_surrogate
from tests.refusals import refused

GIVEN = {"mass": 2.5, "damping": -1.0}
STEPS = 60
SAME = 1e-5
"""Rounding of single precision, beside outputs of about 1."""


@pytest.fixture(scope="module")
def surrogate() -> Surrogate:
    """It starts at 0, which is what FMPy gives to the inputs of an SSP at first."""
    shape = Shape(n_in=20, n_out=6, cell=CellShape(states=4, parameters=2))
    found = random_surrogate(shape)
    (signal,) = found.inputs
    scaling = dataclasses.replace(found.input_scaling, offset=np.zeros(1))
    limit = float(scaling.scale[0])
    about_0 = dataclasses.replace(signal, low=-limit, high=limit, start=0.0)
    return dataclasses.replace(found, inputs=(about_0,), input_scaling=scaling)


@pytest.fixture(scope="module")
def ssp(surrogate: Surrogate, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A surrogate with parameters of its own, which drives another one."""
    folder = tmp_path_factory.mktemp("ssp")
    fmu = export_fmu(surrogate, folder / "sample.fmu")
    output, (signal,) = surrogate.outputs[0].name, surrogate.inputs
    connections = [Connection(("plant", output), ("other", signal.name))]
    components = {"plant": fmu, "other": fmu}
    return write_system(folder / "two.ssp", "two", components, connections, {"plant": GIVEN})


def expected(surrogate: Surrogate) -> float:
    """The first component's output at the end, which the start values would not give."""
    rest = np.zeros((STEPS, 1))
    found = float(surrogate.predict_newest(rest, GIVEN)[-1, 0])
    assert abs(found - surrogate.predict_newest(rest)[-1, 0]) > 100 * SAME
    return found


def test_system_keeps_to_the_standard(ssp: Path) -> None:
    """FMPy holds both files against their schemas."""
    plant, other = read_ssd(str(ssp)).system.elements
    assert [binding.source for binding in plant.parameterBindings] == ["resources/plant.ssv"]
    assert other.parameterBindings == []
    found = read_ssv(str(ssp), "resources/plant.ssv").parameters
    assert {parameter.name: float(parameter.value) for parameter in found} == GIVEN


@needs("libcosimpy")
def test_libcosim_takes_the_parameters_of_a_system(ssp: Path, surrogate: Surrogate) -> None:
    outputs = [("plant", surrogate.outputs[0].name)]
    found = run_libcosim(ssp, outputs, STEP, STEPS)
    assert found[-1, 0] == pytest.approx(expected(surrogate), abs=SAME)


@needs("ecospy")
def test_ecos_takes_the_parameters_of_a_system(ssp: Path, surrogate: Surrogate) -> None:
    """It is told the name of the set."""
    outputs = [("plant", surrogate.outputs[0].name)]
    found = run_ecos(ssp, outputs, STEP, STEPS, SET)
    assert found[-1, 0] == pytest.approx(expected(surrogate), abs=SAME)


def test_fmpy_takes_parameters_of_components(surrogate: Surrogate, tmp_path: Path) -> None:
    """FMPy does not look for SSV files in an SSP by itself, and needs all inputs connected."""
    fmu = export_fmu(surrogate, tmp_path / "sample.fmu")
    output, (signal,) = surrogate.outputs[0].name, surrogate.inputs
    loop = [
        Connection((one, output), (two, signal.name))
        for one, two in (("plant", "other"), ("other", "plant"))
    ]
    ssp = write_system(tmp_path / "loop.ssp", "loop", {"plant": fmu, "other": fmu}, loop)
    values = [
        SimpleNamespace(name=f"plant.{name}", value=str(value)) for name, value in GIVEN.items()
    ]
    result = simulate_ssp(
        str(ssp),
        stop_time=(STEPS - 0.5) * STEP,
        step_size=STEP,
        parameter_set=SimpleNamespace(parameters=values),
    )
    found = [result[f"{component}.{output}"] for component in ("plant", "other")]
    np.testing.assert_allclose(found, in_a_loop(surrogate, len(found[0])), rtol=0, atol=SAME)


def in_a_loop(surrogate: Surrogate, steps: int) -> FloatArray:
    """Outputs of two surrogates, shape (2, steps), of which the first has its own parameters.

    Each steps with what the other gave at the end of the step before, at first with 0.
    """
    both, found = (surrogate.at(GIVEN), surrogate), np.zeros((2, steps + 1))
    for k in range(steps):
        for index, one in enumerate(both):
            taken = found[1 - index, : k + 1, None]
            found[index, k + 1] = one.predict_newest(taken)[-1, 0]
    return found[:, 1:]


def test_parameters_of_an_unknown_component_are_refused(ssp: Path) -> None:
    with refused(ValueError, "expected components out", "parameters of"):
        write_system(ssp.with_name("x.ssp"), "x", {}, [], {"arm": {"mass": 1.0}})
