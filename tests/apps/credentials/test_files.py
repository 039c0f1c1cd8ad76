"""What goes into an FMU beside model and surrogate, and how its experiment is made."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from slide_fmu.apps.credentials import members
from slide_fmu.apps.credentials.experiment import read_experiment
from slide_fmu.apps.credentials.files import members_of
from slide_fmu.apps.credentials.make_experiment import COMPARED, make_experiment
from slide_fmu.apps.credentials.manifest import read_manifest
from slide_fmu.apps.credentials.problems import credential_problems
from slide_fmu.apps.credentials.tables import rounded
from slide_fmu.core.window import Window
from slide_fmu.cosim.archive import hash_problems
from slide_fmu.data.draws import TEST, Stream, draw, drawn_outputs
from slide_fmu.fmu.export import EXTRA, export_fmu, read_fmu, read_folder, read_member
from slide_fmu.fmu.hashes import HASHES
from slide_fmu.pipeline.apps import Release
from slide_fmu.pipeline.documents import PAGE, documents, write_release
from slide_fmu.pipeline.export import export_again
from slide_fmu.pipeline.run_folder import recipe_of_provenance
from slide_fmu.recipe.case import case_of
from slide_fmu.surrogate.input_forecast import InputForecast
from tests.fmu.moving_inputs import forecasting
from tests.fmu.samples import sum_surrogate
from tests.libraries import build_libraries
from tests.recipes import recipe_of_model

FMUS = Path(__file__).parents[3] / "fmus"
LINEAR = FMUS / "linear" / "linear.fmu"
CARD_TEXT = "# card\n\ntext\n"
DOCUMENTS = documents(b"<body>report</body>", CARD_TEXT)


@pytest.fixture(scope="module", autouse=True)
def _binaries() -> None:
    build_libraries()


def test_same_arguments_give_the_same_bytes_whatever_the_order_of_the_provenance() -> None:
    surrogate, origin = read_fmu(LINEAR)
    assert origin is not None
    recipe = recipe_of_provenance(origin, "x")
    turned = dict(reversed(list(origin.items())))
    turned = {**turned, "versions": dict(reversed(list(origin["versions"].items())))}
    one = Release(surrogate, case_of(recipe), origin, DOCUMENTS, former=LINEAR)
    other = dataclasses.replace(one, provenance=json.loads(json.dumps(turned)))
    assert members_of(one) == members_of(other)


def test_fmu_that_was_not_measured_says_so_and_links_to_nothing_else(tmp_path: Path) -> None:
    surrogate, provenance = read_fmu(LINEAR)
    origin = {key: value for key, value in (provenance or {}).items() if key != "measured"}
    release = Release(surrogate, case_of(recipe_of_provenance(origin, "x")), origin)
    path = write_release(release, tmp_path / "linear.fmu")
    assert credential_problems(path, surrogate) == []
    metadata, manifest = read_member(path, members.METADATA), read_member(path, members.MANIFEST)
    assert b"The error of this surrogate has not been measured." in (metadata or b"")
    assert [file.role for file in read_manifest(manifest or b"")] == ["meta-data", "method"]
    assert read_experiment(path) is None


def test_report_links_to_the_other_pages_once() -> None:
    surrogate, provenance = read_fmu(LINEAR)
    arguments = surrogate, case_of(recipe_of_provenance(provenance, "x")), provenance or {}
    once = members_of(Release(*arguments, DOCUMENTS))[PAGE]
    for place in ("fmi-ls-ref.html", "model_card.md", "licenses/license.txt"):
        assert once.count(f'href="{place}"'.encode()) == 1
    again = members_of(Release(*arguments, documents(once, "")))[PAGE]
    assert again == once


def extra_of(path: Path) -> dict[str, bytes]:
    """Read the extra files but the list of hashes: it differs with the version of FMI."""
    return {
        name: read
        for name, read in read_folder(path, EXTRA).items()
        if f"{EXTRA}/{name}" != HASHES
    }


def test_fmu_that_is_exported_again_keeps_its_credentials(tmp_path: Path) -> None:
    again = export_again(LINEAR, tmp_path / "three.fmu", 3, False)
    assert extra_of(again) == extra_of(LINEAR)
    assert hash_problems(again) == []
    kept = read_folder(LINEAR, "documentation")
    assert read_folder(again, "documentation") == kept
    assert credential_problems(again, read_fmu(again)[0]) == []


def test_experiment_is_the_begin_of_the_first_unseen_trajectory() -> None:
    surrogate, provenance = read_fmu(LINEAR)
    recipe = recipe_of_provenance(provenance, "x")
    experiment = make_experiment(LINEAR, surrogate, case_of(recipe), 3)
    assert experiment.compared == COMPARED + 1
    burn_in = round(recipe.data.burn_in / recipe.window.step)
    first = max(burn_in + 1, surrogate.network.memory_length)
    assert experiment.steps == first + COMPARED
    force = experiment.inputs["force"]
    np.testing.assert_array_equal(force, rounded(force))
    other = make_experiment(LINEAR, surrogate, case_of(recipe), 4)
    assert not np.array_equal(other.inputs["force"], force)
    # 3e-7 of its RMS is what the linear surrogate errs
    assert experiment.relative_errors()["position"] < 1e-6


MASS = """
inputs = {"force": {"unit": "N", "range": [-1.0, 1.0]}}
outputs = {"position": {"unit": "m", "range": [-1.0, 1.0]}}
hold = "first_order"
start = [0.0, 0.0]

def f(x, u, p):
    return [x[1], u[0] - 9.0 * x[0] - 0.8 * x[1]]

def g(x, u, p):
    return [x[0]]
"""


def test_reference_of_the_experiment_is_driven_by_inputs_as_they_bend(tmp_path: Path) -> None:
    """As in the data; straight lines through such sines lower them by two per cent."""
    (tmp_path / "mass.py").write_text(MASS)
    sine = {"kind": "harmonic", "weight": 1.0, "angular_frequency": (5.0, 6.0)}
    recipe = recipe_of_model(
        tmp_path / "mass.py",
        window={"step": 0.1, "n_in": 8, "n_out": 4},
        data={"duration": 40.0, "substeps": 4, "excitation": [sine]},
    )
    system = case_of(recipe).reference
    known = dataclasses.replace(
        sum_surrogate(8, "first_order"),
        window=Window(0.1, 8, 1),
        inputs=system.inputs,
        outputs=system.outputs,
    )
    surrogate = forecasting(known, True)
    fmu = export_fmu(surrogate, tmp_path / "mass.fmu")
    experiment = make_experiment(fmu, surrogate, case_of(recipe), 3)
    drawn = draw(recipe, system, Stream(TEST, 3, (1.0, 1.0), 40.0), 0)
    bent = drawn_outputs(system, drawn)[: experiment.steps + 1][-experiment.compared :, 0]
    straight = drawn_outputs(system, dataclasses.replace(drawn, between=None))
    chords = straight[: experiment.steps + 1][-experiment.compared :, 0]
    np.testing.assert_array_equal(
        experiment.inputs["force"], rounded(drawn.inputs[: experiment.steps, 0])
    )
    assert np.abs(experiment.reference["position"] - bent).max() < 1e-7
    assert np.abs(chords - bent).max() > 1e-3


def test_inputs_that_the_fmu_forecasts_are_set_to_what_they_are_now(tmp_path: Path) -> None:
    released = FMUS / "slider_crank" / "slider_crank.fmu"
    surrogate, provenance = read_fmu(released)
    recipe = recipe_of_provenance(provenance, "x")
    surrogate = surrogate.reaching_inputs_by_step_end()
    known = export_fmu(surrogate, tmp_path / "known.fmu")
    straight = np.zeros((2, 1, 1))
    straight[0] = -1.0  # the director turns on as far as in the step before
    forecast = InputForecast(False, False, straight, np.array([0.5, 0.0]))
    other = dataclasses.replace(surrogate, forecast=forecast)
    fmu = export_fmu(other, tmp_path / "slider_crank.fmu")
    ahead = make_experiment(known, surrogate, case_of(recipe), 3)
    now = make_experiment(fmu, other, case_of(recipe), 3)
    for name, values in ahead.inputs.items():
        np.testing.assert_array_equal(now.inputs[name][1:], values[:-1])
    np.testing.assert_array_equal(now.reference["deflection"], ahead.reference["deflection"])
    errors = [experiment.relative_errors()["deflection"] for experiment in (ahead, now)]
    assert errors[0] < errors[1] < 0.5
