"""The whole way of what ``slide-fmu init`` writes: a state-space network with an error bound.

``test_state_space_way`` and ``test_error_bound_way`` hold more, and take longer.
"""

from __future__ import annotations

import json
import re
from typing import Any

import fmpy
import numpy as np
import pytest

from slide_fmu.fmu.export import read_fmu
from slide_fmu.network.state_space.network import StateSpace
from tests.acceptance.conftest import SMALL_BOUNDED, Finished, invoke

LEARNT = 0.01
"""Relative RMSE after a second of training; without learning it would be 1."""

COVERED = 0.9
"""Least share of the samples that the bound of 95 % confidence covers on four trajectories."""

FMU_TOLERANCE = 2e-6
"""FMU against numpy, relative to the output's range: rounding of single precision."""

ROUNDING = 0.1
"""The head sees the logarithm of the difference of two results in single precision; where both
nearly agree, the bound may be off by this part."""

STEPS, BEYOND = 300, 240
"""Steps of a run, and the first of them whose force is beyond the range."""

NAMES = ["position", "position_error_estimate", "position_error_bound", "novelty", "in_domain"]


def rows_at(
    finished: Finished, group: str, inputs: str, steps: float, call: str = "plain"
) -> list[dict[str, Any]]:
    """Return the rows of some inputs in a call."""
    wanted = (group, inputs, call, steps)
    return [
        row
        for row in finished.figures["rows"]
        if (row["group"], row["inputs"], row["call"], row["steps"]) == wanted
    ]


def test_run_learns_the_range_and_its_bound_covers_the_error(bounded: Finished) -> None:
    in_range = bounded.figures["validation"]["in range"]
    assert in_range["outputs"][0]["relative_rmse"] < LEARNT
    (row,) = rows_at(bounded, "in range", "all kinds", 1.0)
    assert row["outputs"][0]["covered"] > COVERED
    assert row["trusted"] > 0.8
    assert in_range["error_estimate"]["span_samples"] > 1
    assert all(test["passed"] for test in bounded.figures["stability"])


def test_finished_fmu_carries_network_bound_and_figures(bounded: Finished) -> None:
    surrogate, provenance = read_fmu(bounded.fmu)
    assert isinstance(surrogate.network, StateSpace)
    assert len(surrogate.network.cell.w) == 4
    assert surrogate.bound is not None
    assert not np.array_equal(surrogate.bound.companion.cell.w, surrogate.network.cell.w)
    assert surrogate.bound.confidences == (0.9, 0.95)  # 40 trajectories calibrate no higher one
    assert provenance is not None
    assert provenance["recipe"] == SMALL_BOUNDED
    assert provenance["measured"] == bounded.released


@pytest.mark.parametrize("confidence", [0.9, 0.95])
def test_outputs_and_bounds_read_by_fmpy_are_those_of_numpy(
    bounded: Finished, confidence: float
) -> None:
    surrogate, _ = read_fmu(bounded.fmu)
    step, signal = surrogate.window.step, surrogate.outputs[0]
    force = np.random.default_rng(1).uniform(-1000, 1000, STEPS)
    force[BEYOND:] *= 2
    signals = np.empty(STEPS + 1, dtype=[("time", float), ("force", float)])
    signals["time"], signals["force"] = step * np.arange(STEPS + 1), [*force, 0.0]
    outputs = fmpy.simulate_fmu(
        str(bounded.fmu),
        stop_time=STEPS * step,
        output_interval=step,
        input=signals,
        start_values={"confidence": confidence, "inputs_held": 1.0},
        output=NAMES,
    )[1:]
    inputs = force[:, None]
    off = outputs["position"] - surrogate.predict_newest(inputs)[:, 0]
    assert np.max(np.abs(off)) < FMU_TOLERANCE * (signal.high - signal.low)
    estimates = surrogate.estimate_error(inputs)[:, 0]
    np.testing.assert_allclose(outputs["position_error_estimate"], estimates, rtol=ROUNDING)
    trust = surrogate.trust(inputs)
    bounds = trust.bounds(confidence)[:, 0]
    np.testing.assert_allclose(outputs["position_error_bound"], bounds, rtol=ROUNDING)
    novelty = trust.novelty
    np.testing.assert_allclose(outputs["novelty"], novelty, rtol=2e-3)
    expected = trust.in_domain
    assert expected[BEYOND - 50 : BEYOND].all()
    assert not expected[BEYOND + 10 :].any()
    assert (outputs["in_domain"].astype(bool) == expected)[np.abs(novelty - 1) > 0.01].all()


def test_report_and_card_show_the_bound_and_the_fading_memory(bounded: Finished) -> None:
    folder = bounded.fmu.parent
    page = (folder / "report.html").read_text(encoding="utf-8")
    for title in ("Error bound", "Fading memory and boundedness"):
        (section,) = re.findall(rf"<h2>{title}</h2>(.*?)</section>", page, re.DOTALL)
        assert "data-chart=" in section
    card = (folder / "card.md").read_text(encoding="utf-8")
    surrogate, _ = read_fmu(bounded.fmu)
    assert isinstance(surrogate.network, StateSpace)
    assert f"{len(surrogate.network.cell.a)} states and 4 hidden units" in page
    (row,) = rows_at(bounded, "in range", "all kinds", 1.0)
    (line,) = [line for line in card.splitlines() if line.startswith("| in range |")]
    assert f" {100 * row['outputs'][0]['covered']:.3g} % | " in line


def test_check_finds_nothing(bounded: Finished) -> None:
    result = invoke("check", bounded.fmu, "--json", "-")
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)["problems"] == []
