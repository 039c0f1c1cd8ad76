"""From records of several specimens to an FMU whose parameter is their mass."""

from __future__ import annotations

import json
from pathlib import Path

import fmpy
import numpy as np
import pytest

import slide_fmu as slide
from tests.acceptance.conftest import invoke
from tests.libraries import build_libraries
from tests.marks import needs_app
from tests.own_records import RECIPE, STEP, force_and_travel, write_record

pytestmark = pytest.mark.extended

MASSES = (1.0, 2.0, 1.25, 1.6)
UNSEEN = 1.4
SAMPLES = 4000
TABLES = f"""starts = 2
expert.start_iterations = 10
expert.kept = 1
expert.kept_iterations = 10

[parameters.mass]
values = {list(MASSES)}
unit = "kg"
transform = "log"
"""


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder in which the whole way was gone."""
    build_libraries()
    folder = tmp_path_factory.mktemp("specimens")
    for seed, mass in enumerate(MASSES):
        write_record(folder / f"{seed}.csv", SAMPLES, seed, mass=mass)
    files = 'model = "0.csv"\nfurther = ["1.csv", "2.csv", "3.csv"]'
    text = RECIPE.replace('model = "bench.csv"', files).replace("240", "400") + TABLES
    (folder / "bench.toml").write_text(text.replace("iterations = 10\n", "iterations = 30\n", 1))
    done = invoke("run", folder / "bench.toml", "--runs", folder / "runs", "--json", "-")
    assert done.exit_code == 0, done.output
    return folder


def test_every_specimen_is_measured(place: Path) -> None:
    report = json.loads((place / "runs/bench/report.json").read_text(encoding="utf-8"))
    unseen = report["validation"]["in range"]["parameters"]["unseen"]
    assert {row["mass"] for row in unseen} == set(MASSES)
    [output] = report["validation"]["in range"]["outputs"]
    assert output["relative_rmse"] < 0.03


@needs_app("credentials")
def test_experiment_of_a_specimen_has_its_mass(place: Path) -> None:
    from slide_fmu.apps.credentials.experiment import read_experiment

    fmu = place / "runs/bench/bench.fmu"
    experiment = read_experiment(fmu)
    assert experiment is not None
    assert experiment.parameters["mass"] in MASSES
    assert experiment.relative_errors()["travel"] < 0.05
    assert invoke("check", fmu, "--run").exit_code == 0


def test_fmu_follows_a_mass_that_no_specimen_has(place: Path) -> None:
    force, travel = force_and_travel(SAMPLES, 9, mass=UNSEEN)
    fmu = place / "runs/bench/bench.fmu"
    time = STEP * np.arange(SAMPLES)
    # what acts during a step is set at its start; the outputs are those at its end
    signals = np.array(
        list(zip(time[:-1], force[1:], strict=True)), dtype=[("time", "f8"), ("force", "f8")]
    )
    errors = []
    for mass in (UNSEEN, MASSES[0]):
        simulated = fmpy.simulate_fmu(
            str(fmu),
            stop_time=time[-2],
            output_interval=STEP,
            input=signals,
            start_values={"mass": mass, "inputs_at_step_end": 1},
            output=["travel"],
        )["travel"]
        error = simulated[300:] - travel[300 : 300 + len(simulated[300:])]
        errors.append(float(np.sqrt(np.mean(error**2)) / travel.std()))
    own, other = errors
    assert own < 0.05
    assert other > 5 * own


def test_record_of_another_specimen_tells_its_mass(place: Path) -> None:
    force, travel = force_and_travel(SAMPLES, 9, mass=UNSEEN)
    calibration = slide.calibrate(
        place / "runs/bench/bench.fmu", force[1:, None], travel[1:, None]
    )
    assert calibration.values["mass"] == pytest.approx(UNSEEN, rel=0.02)


def test_too_few_values_are_refused_in_words(place: Path) -> None:
    text = (place / "bench.toml").read_text().replace("values = [1.0, ", "values = [")
    (place / "few.toml").write_text(text)
    done = invoke("try", place / "few.toml")
    assert done.exit_code == 1
    assert "expected 4 of them, one for each file of records" in " ".join(done.output.split())
    assert "Traceback" not in done.output
