"""A recipe with a loop goes the whole way: kinds, errors and gains of the loop are reported."""

from __future__ import annotations

from pathlib import Path

import pytest

from slide_fmu.cli.python_calls import run

PART = """
import numpy as np

inputs = {
    "road": {"unit": "m", "range": [-0.05, 0.05]},
    "body": {"unit": "m", "range": [-0.1, 0.1]},
}
outputs = {"force": {"unit": "N", "range": [-500.0, 500.0]}}
hold = "first_order"
start = [0.0]


def f(x, u, p, du):
    return [(u[0] - u[1] - x[0]) / 0.05]  # a spring in a row with a damper


def g(x, u, p, du):
    travel = u[0] - u[1]
    return [1000.0 * travel + 5e4 * travel**3 + 300.0 * (travel - x[0])]
"""
RECIPE = """
name = "part"
description = "spring and damper under a body"

[system]
kind = "function"
model = "part.py"

[window]
step = 0.01
n_in = 60
n_out = 20

[data]
duration = 3.0
burn_in = 0.6
train = 8
validation = 3
substeps = 2

[[data.excitation]]
kind = "multisine"
weight = 0.5
amplitude = [0.1, 0.9]
angular_frequency = [1.0, 30.0]

[[loop]]
output = "force"
input = "body"
weight = 0.5
mass = [1.0, 20.0]

[network]
order = 1
hidden = 4

[training]
starts = 1
iterations = 30

[validation]
trajectories = 6
"""


@pytest.mark.extended
def test_recipe_with_a_loop_reports_its_errors_and_gains(tmp_path: Path) -> None:
    (tmp_path / "part.py").write_text(PART, encoding="utf-8")
    (tmp_path / "part.toml").write_text(RECIPE, encoding="utf-8")
    learnt = run(tmp_path / "part.toml", runs=tmp_path / "runs", workers=0)
    in_range = learnt.figures["validation"]["in range"]
    kinds = [kind["name"] for kind in in_range["excitations"]]
    assert sorted(kinds) == ["loop", "multisine"]
    assert in_range["outputs"][0]["relative_rmse"] < 0.1
    gains = {one["partner"]: one["gain"] for one in learnt.figures["loops"]}
    assert list(gains) == ["a mass of 1 kg", "a mass of 4.47 kg", "a mass of 20 kg"]
    assert all(1.0 < gain < 100.0 for gain in gains.values())
    page = learnt.report.read_text("utf-8")
    assert "output force; input body; mass 1.0 .. 20.0" in page
    assert "an error of force becomes about" in page
