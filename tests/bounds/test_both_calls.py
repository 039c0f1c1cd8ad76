"""Bounds of planned motions hold in the plain call and where these are known."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from slide_fmu.bounds.fit import fit_surrogate
from slide_fmu.core.signals import FloatArray
from slide_fmu.cosim.run import run_fmu, unpacked
from slide_fmu.data.draws import TEST, Stream, draw, simulate_draw
from slide_fmu.data.generation import generate
from slide_fmu.fitting.preparation import Work
from slide_fmu.fmu.export import export_fmu
from slide_fmu.recipe.case import case_of
from slide_fmu.surrogate.surrogate import Surrogate
from tests.bounds.learnt_soon import LEARNT_SOON
from tests.libraries import build_libraries
from tests.progress import no_stages, silent
from tests.recipes import tiny_state_space_recipe

pytestmark = pytest.mark.extended

RECIPE = tiny_state_space_recipe(
    system={
        "model": "mbs_models.oscillators:DuffingBaseMotion",
        "parameters": {"damping": 40.0, "substeps": 6},
    },
    window={"planned": True},
    data={
        "train": 6,
        "duration": 2.5,
        "bound": 40,
        "calibration": 60,
        "excitation": [
            {
                "kind": "multisine",
                "weight": 1.0,
                "amplitude": [0.1, 0.6],
                "angular_frequency": [2.0, 30.0],
                "components": [2, 6],
            }
        ],
    },
    **LEARNT_SOON,
)
FRESH = 40
"""Trajectories that nothing has seen."""
SLACK = 0.03
"""What chance does to the covered share of as many trajectories, with some margin."""


@pytest.fixture(scope="module")
def surrogate(tmp_path_factory: pytest.TempPathFactory) -> Surrogate:
    folder = tmp_path_factory.mktemp("calls")
    with ThreadPoolExecutor(1) as pool:
        generate(case_of(RECIPE), folder / "store", pool, silent)
    build_libraries()
    work = Work(case_of(RECIPE), folder / "store", folder / "checkpoints", no_stages)
    return fit_surrogate(work).surrogate


@pytest.fixture(scope="module")
def found(
    surrogate: Surrogate, tmp_path_factory: pytest.TempPathFactory
) -> dict[str, tuple[FloatArray, FloatArray, FloatArray]]:
    """Errors, bounds and the flag of all trajectories in both calls, after the start."""
    system = case_of(RECIPE).system
    stream = Stream(TEST, 92, (1.0, 1.0), RECIPE.data.duration)
    runs = [simulate_draw(system, draw(RECIPE, system, stream, i)) for i in range(FRESH)]
    path = export_fmu(surrogate, tmp_path_factory.mktemp("fmu") / "tiny.fmu")
    assert surrogate.bound is not None
    first = max(surrogate.window.n_in, surrogate.bound.filling_length)
    step, calls = surrogate.window.step, {}
    names = "position", "position_error_bound", "trusted"
    with unpacked(path) as fmu:
        for call, known in (("plain", 0.0), ("known", 1.0)):
            rows = []
            for run in runs:
                base = run.inputs[:, 0]
                given = {"base": base if known else np.concatenate([base[:1], base[:-1]])}
                values = run_fmu(fmu, given, names, {"inputs_at_step_end": known}, step).values
                error = np.abs(values[1:, 0] - run.outputs[1:, 0])
                rows.append(np.stack([error, *values[1:, 1:].T])[:, first:])
            calls[call] = tuple(np.stack(part) for part in zip(*rows, strict=True))
    return calls


@pytest.mark.parametrize("call", ["plain", "known"])
def test_bound_covers_what_it_promises_in_each_call(
    found: dict[str, tuple[FloatArray, FloatArray, FloatArray]], call: str
) -> None:
    errors, bounds, _ = found[call]
    assert abs(np.mean(errors <= bounds) - 0.95) < SLACK


def test_bound_in_the_plain_call_has_the_error_of_the_forecast_too(
    found: dict[str, tuple[FloatArray, FloatArray, FloatArray]],
) -> None:
    (plain, plain_bounds, _), (known, known_bounds, _) = found["plain"], found["known"]
    ratio = np.quantile(plain, 0.95) / np.quantile(known, 0.95)
    assert ratio > 2
    assert 0.5 * ratio < np.median(plain_bounds) / np.median(known_bounds) < 2 * ratio


def test_tolerances_are_those_of_known_motions(
    found: dict[str, tuple[FloatArray, FloatArray, FloatArray]],
) -> None:
    assert RECIPE.bound is not None
    untrusted = {call: 1 - np.mean(trusted) for call, (*_, trusted) in found.items()}
    assert untrusted["known"] < 2 * RECIPE.bound.false_alarms
    assert untrusted["plain"] > 2 * untrusted["known"]
