"""The subcommand ``bench``: its keys, on both families."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from slide_fmu.cli.app import app
from slide_fmu.fmu.export import export_fmu
from slide_fmu.fmu.libraries.platforms import FmiVersion
from tests.bounded import bounded_surrogate
from tests.fmu.samples import CellShape, Shape, random_surrogate
from tests.libraries import build_libraries

TIMES = ("fmu_step", "fmu_set_step_get", "fmu_set_step_get_without_estimates")
LITTLE = ["--rounds", "1", "--steps", "3", "--json", "-"]


@pytest.fixture(scope="module", autouse=True)
def _binaries() -> None:
    build_libraries()


def _bench(path: Path) -> dict[str, object]:
    result = CliRunner().invoke(app, ["bench", str(path), *LITTLE])
    assert result.exit_code == 0, result.output
    return dict(json.loads(result.stdout))


@pytest.mark.parametrize(
    ("shape", "fmi"),
    [
        (Shape(activation="elu", n_inputs=2, positions=2, skip=True), 2),
        (Shape(cell=CellShape()), 2),
        (Shape(cell=CellShape()), 3),
    ],
    ids=["layers", "cells", "FMI 3.0"],
)
def test_bench_gives_times_and_batches(tmp_path: Path, shape: Shape, fmi: FmiVersion) -> None:
    surrogate = random_surrogate(shape)
    path = export_fmu(surrogate, tmp_path / "tiny.fmu", fmi=fmi)
    figures = _bench(path)
    spread, batch = figures["spread"], figures["batch"]
    assert isinstance(spread, dict)
    assert isinstance(batch, dict)
    for name in TIMES:
        found = figures[name]
        assert isinstance(found, float), name
        assert 0 < spread[name][0] <= found <= spread[name][1], name
    assert set(batch) == {"native", "numpy"}
    assert min(batch.values()) > 0
    assert figures["n_weights"] == surrogate.network.count_parameters()
    assert figures["fmu"] == str(path)


def test_bench_gives_the_time_with_error_bounds(tmp_path: Path) -> None:
    path = export_fmu(bounded_surrogate(Shape(cell=CellShape())), tmp_path / "tiny.fmu")
    assert _bench(path)["fmu_set_step_get_with_bounds"] > 0  # type: ignore[operator]


def test_bench_prints_a_table_in_words_and_units_without_json(tmp_path: Path) -> None:
    path = export_fmu(bounded_surrogate(Shape(cell=CellShape())), tmp_path / "tiny.fmu")
    kept = tmp_path / "figures.json"
    few = ["--rounds", "1", "--steps", "3"]
    result = CliRunner().invoke(app, ["bench", str(path), *few, "--json", str(kept)])
    assert result.exit_code == 0, result.output
    words = (
        "doStep alone",
        "with error bounds",
        " µs",
        "80 % of the calls",
        "windows in a second",
    )
    for part in (*words, "medians of 3 calls", "times faster than real time"):
        assert part in result.stdout, part
    assert "{" not in result.stdout
    assert json.loads(kept.read_text(encoding="utf-8"))["step_s"] > 0
