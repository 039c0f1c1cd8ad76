"""Files that earlier versions wrote are read, and give the answers that they gave then."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import slide_fmu
from slide_fmu.fmu.export import read_fmu
from slide_fmu.fmu.native import NativeSurrogate
from slide_fmu.pipeline.run_folder import recipe_of_provenance
from slide_fmu.recipe.reading import load_recipe
from slide_fmu.surrogate.surrogate import Surrogate
from tests.acceptance.conftest import invoke
from tests.acceptance.kept_files import FMUS, KEPT, SPECIMENS, answers_of, folder_of, inputs_of

ROUNDING = 1e-5
"""Answers are computed in single precision, and not promised to the last bit."""

OF_THE_HEAD = 0.05
"""The same of what the head of a bound gives: it sees logarithms of small differences between two
networks, which rounding changes. How BLAS divides its sums is enough for 1 %."""

FOLDERS = sorted(path for path in KEPT.iterdir() if path.is_dir())


def kept(pattern: str) -> list[Any]:
    """Return the files of all versions, as parameters of a test."""
    paths = [path for folder in FOLDERS for path in sorted(folder.glob(pattern))]
    return [pytest.param(path, id=f"{path.parent.name}-{path.name}") for path in paths]


def given(path: Path) -> dict[str, Any]:
    """Return what a file answered when it was written."""
    return dict(json.loads((path.parent / "answers.json").read_text(encoding="utf-8"))[path.name])


def _require_same(surrogate: Surrogate, before: dict[str, Any]) -> None:
    now = answers_of(surrogate)
    assert set(before) - {"info"} <= set(now)
    for name, values in now.items():
        expected = np.array(before[name], dtype=float)
        size = max(float(np.abs(expected).max()), 1e-30)
        part = OF_THE_HEAD if surrogate.bound and name in ("bounds", "estimates") else ROUNDING
        np.testing.assert_allclose(values, expected, rtol=0, atol=part * size, err_msg=name)


@pytest.mark.parametrize("path", kept("*.slide"))
def test_surrogate_file_of_a_former_version_gives_its_answers_again(path: Path) -> None:
    surrogate = Surrogate.from_bytes(path.read_bytes())
    _require_same(surrogate, given(path))
    _require_same(Surrogate.from_bytes(surrogate.to_bytes()), given(path))


@pytest.mark.parametrize("path", kept("*.slide"))
def test_runtime_in_c_reads_a_surrogate_file_of_a_former_version(path: Path) -> None:
    surrogate = Surrogate.from_bytes(path.read_bytes())
    found = NativeSurrogate(surrogate).predict(inputs_of(surrogate)[None])[0]
    expected = np.array(given(path)["outputs"])
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-4 * np.abs(expected).max())


@pytest.mark.parametrize("path", kept("*.fmu"))
def test_fmu_of_a_former_version_is_read_with_its_recipe_and_figures(path: Path) -> None:
    surrogate, provenance = read_fmu(path)
    _require_same(surrogate, given(path))
    assert recipe_of_provenance(provenance, path.name).name == surrogate.name
    result = invoke("info", path, "--json", "-")
    assert result.exit_code == 0, result.output
    _require_kept(given(path)["info"], json.loads(result.stdout), path.name)


def _require_kept(before: Any, now: Any, place: str) -> None:
    """Refuse a figure that has gone, or has another value; new ones may come."""
    if isinstance(before, dict):
        assert isinstance(now, dict), place
        for name, value in before.items():
            assert name in now, f"{place}: {name} has gone"
            _require_kept(value, now[name], f"{place}: {name}")
    elif isinstance(before, float):
        assert now == pytest.approx(before, rel=1e-9, nan_ok=True), place
    else:
        assert now == before, place


@pytest.mark.parametrize("path", kept("*.toml"))
def test_recipe_of_a_former_version_is_read(path: Path) -> None:
    assert load_recipe(path).name == path.stem


def test_every_released_version_has_kept_its_files() -> None:
    names = {path.name for path in FOLDERS[-1].iterdir()}
    assert {f"{name}.slide" for name in SPECIMENS} | {f"{name}.fmu" for name in FMUS} <= names
    if "dev" not in slide_fmu.__version__:  # python -m tests.acceptance.kept_files writes them
        assert folder_of(slide_fmu.__version__).is_dir()
