"""``slide-fmu compare`` on the command line."""

from __future__ import annotations

import json

import pytest

from tests.acceptance.conftest import Finished, invoke
from tests.acceptance.test_base_install import call
from tests.apps.compare.lessons import needs_sysidentpy


@pytest.mark.extended
@needs_sysidentpy
def test_compare_prints_a_table_and_writes_figures_and_report(bounded: Finished) -> None:
    command = ("compare", bounded.recipe, "--runs", bounded.runs)
    result = invoke(*command, "--budget", 0.2, "--trajectories", 2, "--json", "-")
    assert result.exit_code == 0, result.output
    figures = json.loads(result.stdout)
    assert (figures["budget_s"], figures["trajectories"]) == (0.2, 2)
    titles = [model["title"] for model in figures["models"]]
    assert titles[0] == "own: state space"
    assert all(title in result.stderr for title in titles)
    assert "error of position" in result.stderr
    page = bounded.runs / bounded.name / "compare" / "report.html"
    assert str(page) in result.stderr
    assert page.exists()


@pytest.mark.extended
def test_compare_without_sysidentpy_names_the_extra(bounded: Finished) -> None:
    arguments = ("compare", bounded.recipe, "--runs", bounded.runs)
    result = call(*arguments, missing=("sysidentpy",))
    assert result.returncode == 1
    assert "pip install 'slide-fmu[compare]'" in result.stderr
    assert "Traceback" not in result.stderr


def test_budget_that_is_no_time_is_refused(bounded: Finished) -> None:
    result = invoke("compare", bounded.recipe, "--runs", bounded.runs, "--budget", 0)
    assert result.exit_code == 1
    assert "budget = 0.0 s; expected a positive" in result.stderr
