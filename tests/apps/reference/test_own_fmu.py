"""An FMU of the user is its own reference, in an SSP too, where it runs by itself."""

from __future__ import annotations

import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slide_fmu.apps.reference.side_by_side import write_reference, write_side_by_side
from slide_fmu.core.parameters import Parameter
from slide_fmu.core.scaling import range_scaling
from slide_fmu.core.window import Window
from slide_fmu.fmu.export import export_fmu
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.reading import parse_open_recipe
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import System
from slide_fmu.systems.errors import LoadError
from slide_fmu.systems.simulation import simulate
from tests.acceptance.importers import needs, run_libcosim
from tests.fmu.samples import CellShape, Shape, random_surrogate, sum_surrogate
from tests.libraries import build_libraries
from tests.own_models.quarter_car import build_in_c
from tests.recipes import FMU_RECIPE
from tests.refusals import refused


@pytest.fixture
def car(tmp_path: Path) -> Path:
    return build_in_c(tmp_path / "car.fmu", co_simulation=True)


def text_of(car: Path, parameters: str = "") -> str:
    text = FMU_RECIPE.replace("MODEL", str(car))
    return text.replace("[system.inputs", f"{parameters}\n[system.inputs", 1)


def test_a_co_simulation_fmu_is_copied_as_reference(car: Path, tmp_path: Path) -> None:
    recipe = parse_open_recipe(text_of(car), "recipe").guess
    written = write_reference(case_of(recipe), tmp_path / "reference.fmu")
    assert written.read_bytes() == car.read_bytes()
    with refused(ValueError, "expected a name ending", "ending in"):
        write_reference(case_of(recipe), tmp_path / "reference.zip")


def test_an_fmu_with_parameters_is_no_reference_by_itself(car: Path, tmp_path: Path) -> None:
    recipe = parse_open_recipe(text_of(car, "parameters = { spring = 20e3 }"), "recipe").guess
    with refused(LoadError, "expected a co-simulation", "parameters ['spring']"):
        write_reference(case_of(recipe), tmp_path / "reference.fmu")


def test_a_model_exchange_fmu_is_no_reference_by_itself(tmp_path: Path) -> None:
    exchanged = build_in_c(tmp_path / "car.fmu", co_simulation=False)
    recipe = parse_open_recipe(text_of(exchanged), "recipe").guess
    with refused(LoadError, "used for model_exchange"):
        write_reference(case_of(recipe), tmp_path / "reference.fmu")


def test_an_ssp_holds_the_fmu_of_the_user_beside_the_surrogate(car: Path, tmp_path: Path) -> None:
    text = text_of(car)
    system = case_of(parse_open_recipe(text, "recipe").guess).system
    build_libraries()
    surrogate = replace(
        sum_surrogate(16),
        name="car",
        window=Window(0.005, 16, 1),
        inputs=system.inputs,
        outputs=system.outputs,
    )
    fmu = export_fmu(surrogate, tmp_path / "surrogate.fmu", provenance={"recipe": text})
    path, _ = write_side_by_side(fmu, tmp_path / "side.ssp", seed=1, duration=None)
    with zipfile.ZipFile(path) as archive:
        assert archive.read("resources/reference.fmu") == car.read_bytes()
        structure = archive.read("SystemStructure.ssd").decode()
    assert 'endElement="reference" endConnector="road"' in structure


SPRING = Parameter("spring", "N/m", 10e3, 40e3)


def with_open_spring(system: System) -> Surrogate:
    """Return a surrogate of a car whose spring stays open; its weights are random."""
    found = random_surrogate(Shape(n_in=16, n_out=8, cell=CellShape(parameters=1)))
    assert isinstance(found.network, StateSpace)
    polynomial = found.network.polynomial
    assert polynomial is not None
    polynomial = replace(polynomial, basis=replace(polynomial.basis, parameters=(SPRING,)))
    network = found.network
    return replace(
        found,
        name="car",
        inputs=system.inputs,
        outputs=system.outputs,
        input_scaling=range_scaling(system.inputs),
        output_scaling=range_scaling(system.outputs),
        network=StateSpace(polynomial, network.n_samples, network.n_out, network.features),
    )


@needs("libcosimpy")
def test_an_open_parameter_of_the_fmu_of_the_user_is_set_by_the_ssp(
    car: Path, tmp_path: Path
) -> None:
    """libcosim holds inputs over each step, and so does the system."""
    text = text_of(car).replace("0.05]\n", '0.05]\nhold = "zero_order"\n', 1)
    text += '[parameters.spring]\nrange = [10e3, 40e3]\nunit = "N/m"\n'
    recipe, given = parse_open_recipe(text, "recipe").guess, {"spring": 31e3}
    build_libraries()
    surrogate = with_open_spring(case_of(recipe).system)
    fmu = export_fmu(surrogate, tmp_path / "surrogate.fmu", provenance={"recipe": text})
    path, remark = write_side_by_side(fmu, tmp_path / "side.ssp", 1, None, given)
    assert remark is not None
    assert "your own FMU, whose parameters are set by the SSV file" in remark
    places = [("inputs", "road"), ("reference", "suspension_travel")]
    road, travel = run_libcosim(path, places, 0.005, 100).T
    before = np.append(0.0, road[:-1])[:, None]
    for values, same in ((given, True), ({}, False)):
        system = case_of(recipe.at({"spring": SPRING.start_value, **values})).system
        expected = simulate(system, before, None).outputs[1:, 0]
        assert np.allclose(travel, expected, rtol=0, atol=1e-3 * np.ptp(expected)) == same
