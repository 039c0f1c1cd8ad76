"""The runtime as WebAssembly gives what the native library gives, in Node."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from slide_fmu.apps.credentials.experiment import read_experiment
from slide_fmu.core.signals import FloatArray
from slide_fmu.cosim.whole_run import run_fmu
from slide_fmu.fmu.export import read_fmu
from slide_fmu.fmu.libraries.build import BINARIES, PAGE_LIBRARY
from slide_fmu.importer.file import unpacked
from slide_fmu.surrogate.surrogate import Surrogate
from tests.apps.page.node import run_task, task_of_fmu
from tests.marks import every
from tests.node import node

FMUS = sorted((Path(__file__).parents[3] / "fmus").glob("*/*.fmu"))
PARAMETRIC = next(path for path in FMUS if path.stem == "slider_crank_payload")

TOLERANCE = 5e-6
"""Of an output's range, or of the largest value: both are of single precision."""

LOOSER = {"error_bound": 0.1, "novelty": 1e-4}
"""Of an error bound and of the novelty, which follow from how far two networks are apart: the
rounding of both is a part of that difference."""

CHANGES = 5
"""Samples until inputs that begin to change at the start are known to be held."""

OF_BOUND = {"error_estimate": 2e-2}
"""The same of an error estimate that is made of an error bound: its networks may agree to 1e-7."""


@pytest.mark.parametrize("fmu", every(3, FMUS), ids=[path.stem for path in FMUS])
def test_page_library_gives_the_answers_of_the_native_library(fmu: Path, tmp_path: Path) -> None:
    surrogate, experiment = read_fmu(fmu)[0], read_experiment(fmu)
    assert experiment is not None
    result = run_task(task_of_fmu(fmu, tmp_path), tmp_path)
    assert result.returncode == 0, result.stderr
    columns = json.loads(result.stdout)["columns"]
    with unpacked(fmu) as files:
        run = run_fmu(files, experiment.inputs, list(columns), experiment.parameters)
    ranges = {signal.name: signal.high - signal.low for signal in surrogate.outputs}
    assert set(ranges) <= set(columns)
    for name, expected in zip(columns, run.values.T, strict=True):
        scale = ranges.get(name, np.abs(expected).max())
        apart = np.abs(np.array(columns[name]) - expected)
        if name == "trusted":  # where a bound is at its tolerance, rounding decides
            native = dict(zip(columns, run.values.T, strict=True))
            apart = apart[~_across_a_tolerance(surrogate, native, columns)]
        # the page does not say that inputs are held: a start is in doubt there
        if name == "in_domain":
            apart = apart[CHANGES:]
        difference = float(apart.max())
        print(f"{name}: {difference / scale:.2g} of {scale:.3g}")
        assert np.ptp(expected) > 0 or name.endswith(
            ("filled", "in_range", "in_domain", "trusted")
        )
        kinds = LOOSER if surrogate.estimator is not None else LOOSER | OF_BOUND
        looser = [value for kind, value in kinds.items() if name.endswith(kind)]
        tolerance = looser[0] if looser else TOLERANCE
        assert difference <= tolerance * scale, name


def _across_a_tolerance(
    surrogate: Surrogate, native: dict[str, FloatArray], page: dict[str, list[float]]
) -> NDArray[np.bool_]:
    """Return the samples where a bound is above its tolerance in one library alone, (N,)."""
    names = [f"{signal.name}_error_bound" for signal in surrogate.outputs]
    above = [
        np.stack([np.asarray(values[name]) for name in names], axis=1) > surrogate.error_tolerances
        for values in (native, page)
    ]
    found = np.asarray(np.any(above[0] != above[1], axis=1))
    assert np.mean(found) < 0.05
    return found


def test_page_library_asks_nothing_of_its_host() -> None:
    code = (
        "const module = new WebAssembly.Module(require('fs').readFileSync(process.argv[1]));"
        "console.log(WebAssembly.Module.imports(module).length)"
    )
    command = [node(), "-e", code, str(BINARIES / PAGE_LIBRARY)]
    result = subprocess.run(command, capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "0"


def test_page_library_refuses_a_damaged_surrogate_with_a_reason(tmp_path: Path) -> None:
    task = task_of_fmu(PARAMETRIC, tmp_path)
    path = Path(task["surrogate"])
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    result = run_task(task, tmp_path)
    assert result.returncode != 0
    assert "Refused" in result.stderr
    assert "checksum" in result.stderr


def test_page_library_refuses_parameters_outside_their_range(tmp_path: Path) -> None:
    task = {**task_of_fmu(PARAMETRIC, tmp_path), "parameters": [99.0]}
    result = run_task(task, tmp_path)
    assert result.returncode != 0
    assert "99; expected 0.5 to 1.5" in result.stderr


def test_page_library_refuses_a_step_of_no_length(tmp_path: Path) -> None:
    task = task_of_fmu(PARAMETRIC, tmp_path)
    task["time"][3] = task["time"][2]
    result = run_task(task, tmp_path)
    assert result.returncode != 0
    assert "expected a positive, finite step" in result.stderr
