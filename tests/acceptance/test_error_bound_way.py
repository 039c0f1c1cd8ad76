"""The whole way of the recipe that the page on trust shows: credentials, ``info``, ``validate``.

``make test`` takes a smaller recipe with an error bound the whole way, in ``test_bounded_way``.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest

from slide_fmu.fmu.export import read_fmu
from slide_fmu.surrogate.error_bound import CONFIDENCES
from tests.acceptance.conftest import Finished, invoke, run_recipe
from tests.acceptance.test_bounded_way import rows_at
from tests.libraries import build_libraries
from tests.limits import HANGS
from tests.marks import needs_app

pytestmark = pytest.mark.extended

METADATA = "extra/org.ssp-standard.ssp-traceability.srmd/resourceMetaData.srmd"

TUTORIALS = Path(__file__).parents[2] / "docs/tutorials"
ROUNDING = 0.1
"""The head sees the logarithm of the difference of two results in single precision; where both
nearly agree, the bound may be off by this part."""

NAMES = ["position_error_bound", "novelty", "in_domain", "error_bound_filled", "trusted"]


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Finished:
    """The recipe that docs/trust.md shows, finished."""
    build_libraries()
    text = (TUTORIALS / "duffing_bounded.toml").read_text(encoding="utf-8")
    return run_recipe(tmp_path_factory.mktemp("bounded"), "duffing_bounded", text, workers=2)


def test_bound_holds_in_range_and_is_mostly_trusted(finished: Finished) -> None:
    (row,) = rows_at(finished, "in range", "all kinds", 1.0)
    (output,) = row["outputs"]
    assert output["covered"] > 0.9
    assert output["width"] < 1.5
    assert 0.93 < row["trusted"] < 1  # 0.96 of the calibration; few trajectories here
    assert row["silent"] < 0.01
    tolerances = finished.figures["validation"]["in range"]["tolerances"]
    factors = [row["tolerances"][0] for row in tolerances]
    assert len(factors) == 5
    assert factors == sorted(factors, reverse=True)


CHANGES = 4
"""Changes in a row at the start, after which the plain call knows that an input is held."""


def test_bound_read_by_fmpy_is_that_of_python(finished: Finished) -> None:
    surrogate, _ = read_fmu(finished.fmu)
    count, step = 400, surrogate.window.step
    force = np.random.default_rng(1).uniform(-1000, 1000, count)
    force[300:] *= 2  # beyond the range
    trust = surrogate.trust(force[:, None])
    signals = np.empty(count + 1, dtype=[("time", float), ("force", float)])
    signals["time"], signals["force"] = step * np.arange(count + 1), [*force, 0.0]
    for confidence in CONFIDENCES:
        outputs = fmpy.simulate_fmu(
            str(finished.fmu),
            stop_time=count * step,
            output_interval=step,
            input=signals,
            start_values={"confidence": confidence},
            output=NAMES,
        )[1:]
        bounds = trust.bounds(confidence)[:, 0]
        off = np.abs(outputs["position_error_bound"] / bounds - 1)
        assert np.median(off) < 1e-3
        assert off.max() < ROUNDING
    novelty = trust.novelty
    np.testing.assert_allclose(outputs["novelty"], novelty, rtol=2e-3)
    expected = trust.in_domain
    assert expected[200:300].all()
    assert not expected[310:].any()
    clear = np.abs(novelty - 1) > 0.01
    clear[:CHANGES] = False
    assert (outputs["in_domain"].astype(bool) == expected)[clear].all()
    ratio = trust.bounds()[:, 0] / surrogate.error_tolerances[0]
    clear &= np.abs(ratio - 1) > ROUNDING
    trusted = trust.trusted()
    assert (outputs["trusted"].astype(bool) == trusted)[clear].all()
    assert trusted[200:300].mean() > 0.7
    assert surrogate.bound is not None
    filled = np.arange(1, count + 1) / surrogate.bound.filling_length
    np.testing.assert_allclose(outputs["error_bound_filled"], np.minimum(filled, 1))


def test_report_and_card_show_the_bound(finished: Finished) -> None:
    folder = finished.fmu.parent
    page = (folder / "report.html").read_text(encoding="utf-8")
    drawn = []
    for title in ("Error against communication step", "Error bound", "The worst windows"):
        (section,) = re.findall(rf"<h2>{title}</h2>(.*?)</section>", page, re.DOTALL)
        drawn.append(section.count("data-chart="))
    assert drawn[:2] == [1, 4]
    assert 1 <= drawn[2] <= 10
    card = (folder / "card.md").read_text(encoding="utf-8")
    (row,) = rows_at(finished, "in range", "all kinds", 1.0)
    (line,) = [line for line in card.splitlines() if line.startswith("| in range |")]
    assert f" {100 * row['outputs'][0]['covered']:.3g} % | " in line
    assert "| in range: held_random | " in card
    assert "| in range: multisine | " in card


@needs_app("credentials")
def test_credentials_have_the_bound(finished: Finished) -> None:
    with zipfile.ZipFile(finished.fmu) as archive:
        metadata = archive.read(METADATA).decode("utf-8")
    assert 'keyword="accuracy.rows"' in metadata
    assert "Where in_domain is false" in metadata
    result = invoke("check", finished.fmu, "--json", "-")
    assert json.loads(result.stdout)["problems"] == []


@needs_app("credentials")
def test_experiment_repeats_bound_novelty_and_domain(finished: Finished) -> None:
    result = invoke("check", finished.fmu, "--run", "--json", "-")
    checked = json.loads(result.stdout[result.stdout.index("{") : result.stdout.rindex("}") + 1])
    assert checked["problems"] == []
    assert set(NAMES) < checked["replay"]["differences"].keys()


def test_info_tells_sizes_confidences_and_blocks(finished: Finished) -> None:
    told = json.loads(invoke("info", finished.fmu, "--json", "-").stdout)["error_bound"]
    surrogate, _ = read_fmu(finished.fmu)
    assert surrogate.bound is not None
    assert told == {
        "companion_parameters": surrogate.network.count_parameters(),  # the same network again
        "head_parameters": surrogate.bound.head.count_parameters(),
        "confidences": [0.9, 0.95, 0.99],
        "blocks_s": [0.015625, 0.125],
        "filled_s": surrogate.bound.filling_length * surrogate.window.step,
        "tolerances": surrogate.error_tolerances.tolist(),
    }
    assert "trusted" in invoke("info", finished.fmu).stdout


def test_validate_prints_a_row_for_each_kind_and_the_verdict(finished: Finished) -> None:
    result = invoke("validate", finished.fmu, "--trajectories", 2, "--report", finished.runs / "v")
    assert result.exit_code == 0, result.output
    assert "plain call, h = 15.62 ms, h/4 = 3.906 ms" in result.output
    assert re.search(r"in the plain call is [\d.]+ %", result.output)
    assert "<h2>Error bound</h2>" in (finished.runs / "v/report.html").read_text(encoding="utf-8")


def test_example_of_the_page_on_trust_runs_and_tells_both_forces_apart(
    finished: Finished,
) -> None:
    done = subprocess.run(
        [sys.executable, str(TUTORIALS / "bounded_duffing.py"), str(finished.fmu)],
        capture_output=True,
        text=True,
        timeout=HANGS,
    )
    assert done.returncode == 0, done.stderr
    shares = re.findall(r"up to \d+ N: ([\d.]+) % of the steps are trusted", done.stdout)
    usual, strong = map(float, shares)
    assert usual > 85
    assert strong < 5
    usual, strong = map(float, re.findall(r"([\d.]+) % are in the domain", done.stdout))
    assert usual > 95
    assert strong < 5
    page = (TUTORIALS.parent / "trust.md").read_text(encoding="utf-8")
    assert (TUTORIALS / "bounded_duffing.py").read_text(encoding="utf-8") in page
    told = [re.sub(r"[\d.e-]+", "#", line) for line in done.stdout.splitlines()]
    assert "\n".join(told) in re.sub(r"[\d.e-]+", "#", page)
