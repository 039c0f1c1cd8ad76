"""Deviations of error estimates by span."""

from __future__ import annotations

import argparse
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import estimate_spans
import numpy as np
import pytest
from estimate_spans import Errors, measure, relative_deviation, span_figures
from samples_of_tiny import held_by_an_fmu

from slide_fmu.core.measures import moving_rms
from slide_fmu.data.draws import TEST, Stream, draw
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.reading import parse_recipe
from slide_fmu.systems.simulation import simulate
from tests.progress import no_stages
from tests.refusals import refused


def measured(monkeypatch: pytest.MonkeyPatch, positions: int = 8) -> dict[str, Any]:
    monkeypatch.setattr(estimate_spans, "read_fmu", lambda path: held_by_an_fmu(positions))
    arguments = argparse.Namespace(
        fmu=Path("tiny.fmu"), spans=(0.125, 100.0), trajectories=3, duration=None, seed=5
    )
    return measure(arguments, no_stages)


def test_the_span_of_the_fmu_gives_the_deviation_of_its_estimate(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """In range and, with the next seed, at the amplitudes of the estimator's training."""
    surrogate, provenance = held_by_an_fmu()
    recipe = parse_recipe(provenance["recipe"], "tiny")
    system, found = case_of(recipe).reference, measured(monkeypatch)
    assert found["estimated_samples"] == 8
    for name, seed, factors in (("in range", 5, (1.0, 1.0)), ("beyond the range", 6, (1.0, 2.0))):
        deviations = []
        for index in range(3):
            drawn = draw(recipe, system, Stream(TEST, seed, factors, 2.0), index)
            true = simulate(system, drawn.inputs, drawn.initial).outputs
            first = max(drawn.burn_in + 1, surrogate.network.memory_length)
            error = surrogate.predict_newest(drawn.inputs)[first - 1 :] - true[first:]
            estimate = surrogate.estimate_error(drawn.inputs)[first - 1 :][7:]
            resolution = 1e-3 * surrogate.output_scaling.scale
            deviations.append(relative_deviation(estimate, moving_rms(error, 8), resolution))
        values = np.concatenate(deviations)
        spans = found["motions"][name]["spans"]
        assert (spans[0]["samples"], found["motions"][name]["seed"]) == (8, seed)
        expected = {
            "mean_relative_deviation": pytest.approx(values.mean()),
            "p95_relative_deviation": pytest.approx(np.quantile(values, 0.95)),
        }
        assert spans[0]["together"] == spans[0]["outputs"][0] == expected
        assert spans[0]["euclidean"] is None  # one output
        assert spans[1]["samples"] == 6400
        assert spans[1]["outputs"] is spans[1]["together"] is None  # no motion is as long


def test_norm_of_several_outputs_and_resolution() -> None:
    """True errors 3 and 4, estimated 6 and 8: twice as much, but for what is not told apart."""
    part = Errors(np.tile([3.0, 4.0], (9, 1)), np.tile([6.0, 8.0], (9, 1)))

    def found(resolution: tuple[float, float], length: int = 4) -> dict[str, Any]:
        bench = SimpleNamespace(resolution=np.array(resolution), several=True)
        return span_figures(bench, [part, part], length)  # type: ignore[arg-type]

    fine = found((1e-3, 1e-3))
    assert fine["euclidean"] == {"mean_relative_deviation": 1, "p95_relative_deviation": 1}
    assert fine["outputs"] == [fine["euclidean"]] * 2
    coarse = found((6.0, 1e-3))  # the first output cannot be told from its resolution
    assert coarse["outputs"][0]["mean_relative_deviation"] == 0
    assert coarse["together"]["mean_relative_deviation"] == 0.5
    limit = np.hypot(6.0, 1e-3)
    deviation = (10 - limit) / limit
    assert coarse["euclidean"]["mean_relative_deviation"] == pytest.approx(deviation)
    assert found((1e-3, 1e-3), 10)["euclidean"] is None


def test_one_estimate_of_a_whole_window_has_no_spans(monkeypatch: pytest.MonkeyPatch) -> None:
    with refused(SystemExit, "expected errors sample", "whole window"):
        measured(monkeypatch, positions=1)


def test_relative_deviation_has_a_resolution() -> None:
    """Below the resolution 0.1, errors count as 0.1, in estimate and truth."""
    estimate, true = np.array([3.0, 0.0, 0.2, 0.05]), np.array([2.0, 0.2, 0.0, 0.01])
    assert relative_deviation(estimate, true, 0.1) == pytest.approx([0.5, 0.5, 1.0, 0.0])


def test_relative_deviation_broadcasts_the_resolution_over_channels() -> None:
    found = relative_deviation(np.array([[0.0, 0.0]]), np.array([[1.0, 1.0]]), [0.5, 0.25])
    assert found.tolist() == [[0.5, 0.75]]
