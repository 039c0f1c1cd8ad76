"""``slide-fmu ssp`` with values of physical parameters, in real importers."""

from __future__ import annotations

import tomllib
import zipfile
from pathlib import Path

import numpy as np
import pytest
from fmpy.ssp.ssd import read_ssd, read_ssv

from mbs_models.oscillators import LinearOscillator
from slide_fmu.core.signals import FloatArray
from slide_fmu.cosim.ssp import Connection, write_system
from slide_fmu.cosim.ssv import parameter_set, read_parameter_set
from slide_fmu.fmu.export import load
from slide_fmu.recipe.writing import tables_text
from tests.acceptance.conftest import Finished, invoke, run_recipe
from tests.acceptance.importers import needs, run_ecos, run_fmpy, run_libcosim
from tests.apps.reference.test_importers import IMPORTERS, Importer
from tests.recipes import TINY
from tests.refusals import refused

pytestmark = pytest.mark.extended

MASS, OTHER, STEP, STEPS = 1.8, 1.1, 0.015625, 100
OUTPUTS = [("inputs", "force"), ("reference", "position"), ("surrogate", "position")]
SMALL = 0.01
"""Relative error of the network; that of a mass which was left at its start is 0.2 and more."""


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Finished:
    """A linear oscillator with an open mass, from 1 to 2 kg, learnt in seconds."""
    tables = tomllib.loads(TINY)
    tables["name"] = "open"
    tables["parameters"] = {"mass": {"range": [1.0, 2.0], "unit": "kg", "transform": "log"}}
    tables["data"] |= {"train": 10, "validation": 4}
    tables["network"] = {"order": 2, "hidden": 0}
    tables["training"] = {"iterations": 15, "expert": {"segment": 32}}
    return run_recipe(tmp_path_factory.mktemp("open"), "open", tables_text(tables))


@pytest.fixture(scope="module")
def ssp(finished: Finished) -> Path:
    path = finished.runs / "open.ssp"
    result = invoke("ssp", finished.fmu, "-o", path, "--set", f"mass={MASS}")
    assert result.exit_code == 0, result.output
    return path


def relative_error(found: FloatArray, true: FloatArray) -> float:
    return float(np.sqrt(np.mean((found - true) ** 2) / np.mean(true**2)))


def model(inputs: FloatArray, mass: float) -> FloatArray:
    """The oscillator under inputs from its rest without a force on, shape (N,)."""
    system = LinearOscillator(step=STEP, damping=40.0, substeps=6, mass=mass)
    return system.simulate(np.append(0.0, inputs)[:, None])[2:, 0]


@pytest.mark.parametrize("run", IMPORTERS)
def test_reference_and_surrogate_have_the_mass_that_was_set(run: Importer, ssp: Path) -> None:
    """Also in FMPy, which does not look for SSV files: it is their start value too."""
    force, reference, surrogate = run(ssp, OUTPUTS, STEP, STEPS).T
    assert relative_error(surrogate, reference) < SMALL
    # what the inputs give at the end of a step drives the others in the next one
    assert relative_error(reference[1:], model(force[:-1], MASS)) < 1e-9
    assert relative_error(reference[1:], model(force[:-1], OTHER)) > 10 * SMALL


@pytest.mark.parametrize(
    "run",
    [
        pytest.param(run_libcosim, id="libcosim", marks=needs("libcosimpy")),
        pytest.param(run_ecos, id="ecos", marks=needs("ecospy")),
    ],
)
def test_changed_ssv_files_set_other_values(run: Importer, ssp: Path, tmp_path: Path) -> None:
    """Both FMUs start with another mass than these say."""
    with zipfile.ZipFile(ssp) as archive:
        archive.extractall(tmp_path)
    components = {name: tmp_path / f"resources/{name}.fmu" for name, _ in OUTPUTS}
    connections = [Connection(OUTPUTS[0], (name, "force")) for name in ("reference", "surrogate")]
    given = {"reference": {"mass": OTHER}, "surrogate": {"mass": OTHER, "inputs_held": 1.0}}
    other = write_system(tmp_path / "other.ssp", "open", components, connections, given)
    options = ("parameters",) if run is run_ecos else ()
    force, reference, surrogate = run(other, OUTPUTS, STEP, STEPS, *options).T
    assert relative_error(surrogate, reference) < SMALL
    assert relative_error(reference[1:], model(force[:-1], OTHER)) < 1e-9


def test_values_of_a_file_and_of_the_command_line_stand_in_the_system(
    finished: Finished, tmp_path: Path
) -> None:
    ssv, path = tmp_path / "fitted.ssv", tmp_path / "open.ssp"
    ssv.write_bytes(parameter_set({"mass": OTHER}))
    for options, mass in (((), OTHER), (("--set", f"mass={MASS}"), MASS)):
        result = invoke("ssp", finished.fmu, "-o", path, "--parameters", ssv, *options)
        assert result.exit_code == 0, result.output
        for name in ("reference", "surrogate"):
            parameters = read_ssv(str(path), f"resources/{name}.ssv").parameters
            told = {"inputs_held": 1.0} if name == "surrogate" else {}
            assert {p.name: float(p.value) for p in parameters} == {"mass": mass, **told}
    _, reference, surrogate = read_ssd(str(path)).system.elements
    for component in (reference, surrogate):
        assert len(component.parameterBindings) == 1


def test_system_without_values_has_the_start_values(finished: Finished, tmp_path: Path) -> None:
    path = tmp_path / "open.ssp"
    assert invoke("ssp", finished.fmu, "-o", path).exit_code == 0
    (parameter,) = read_ssv(str(path), "resources/reference.ssv").parameters
    assert float(parameter.value) == load(finished.fmu).parameters[0].start_value
    force, reference, _ = run_fmpy(path, OUTPUTS, STEP, STEPS).T
    assert relative_error(reference[1:], model(force[:-1], float(parameter.value))) < 1e-9


MISTAKES = {
    "name": ("--set mas=1.5", "parameter 'mas'; expected one of ['mass']"),
    "range": ("--set mass=5", "'mass' = 5.0 kg; expected a number in its range, 1 .. 2 kg"),
    "number": ("--set mass=heavy", "--set mass=heavy; expected a number behind ="),
    "file of another FMU": ("--parameters other.ssv", "parameter 'arm'; expected one of ['mass']"),
    "unit": ("--parameters grams.ssv", "'mass' has the unit 'g'; expected 'kg'"),
    "no file": ("--parameters nowhere.ssv", "'nowhere.ssv': there is no such file or folder"),
    "no XML": ("--parameters text.ssv", "text.ssv is no XML document"),
    "other XML": ("--parameters page.ssv", "begins with the element 'html'; expected an SSV"),
}


@pytest.mark.parametrize("case", MISTAKES)
def test_mistakes_are_refused_in_words(
    finished: Finished, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, case: str
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("other.ssv").write_bytes(parameter_set({"arm": 1.0}))
    grams = parameter_set({"mass": 1.5}).replace(b"Real value", b'Real unit="g" value')
    Path("grams.ssv").write_bytes(grams)
    Path("text.ssv").write_text("mass = 1.8", encoding="utf-8")
    Path("page.ssv").write_text("<html></html>", encoding="utf-8")
    options, message = MISTAKES[case]
    result = invoke("ssp", finished.fmu, "-o", "open.ssp", *options.split())
    assert result.exit_code == 1
    assert message in result.output.replace("\n", " ")
    assert not Path("open.ssp").exists()


def test_parameters_of_an_fmu_without_any_are_refused(tmp_path: Path) -> None:
    fmu = Path(__file__).parents[3] / "fmus" / "linear" / "linear.fmu"
    result = invoke("ssp", fmu, "-o", tmp_path / "x.ssp", "--set", "mass=1.0")
    assert result.exit_code == 1
    assert "the surrogate has no parameters" in result.output.replace("\n", " ")


def test_values_are_read_as_they_were_written(tmp_path: Path) -> None:
    values, path = {"mass": 1.8, "stiffness": 1.0e-7 / 3}, tmp_path / "some.ssv"
    path.write_bytes(parameter_set(values))
    assert read_parameter_set(path) == values
    path.write_bytes(parameter_set(values).replace(b"Real", b"String"))
    with refused(ValueError, "'mass' has the values []", "expected one number"):
        read_parameter_set(path)
