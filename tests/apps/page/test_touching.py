"""Drawings that recipes name go into FMUs, and from there into pages and reports."""

from __future__ import annotations

import base64
import gzip
import json
import re
from pathlib import Path
from typing import Any

import pytest

from mbs_models.pictures import page_drawings
from slide_fmu.apps.page.drawing import DrawingError
from slide_fmu.apps.page.page import page_of
from slide_fmu.fmu.export import export_fmu, read_fmu
from slide_fmu.pipeline.apps import (
    check_app_tables,
    last_section,
    remarks_on_app_tables,
    with_origins,
)
from slide_fmu.recipe.recipe import RecipeError
from slide_fmu.systems.errors import LoadError
from tests.apps.page.conftest import FMUS
from tests.marks import needs_app
from tests.recipes import tiny_recipe
from tests.refusals import refused

LINEAR = FMUS / "linear" / "linear.fmu"
NAME = "mbs_models.pictures.page_drawings:oscillator"


def _drawing(page: str) -> dict[str, Any] | None:
    found = re.findall(r'<script type="text/plain" id="blob-drawing">(.*?)</script>', page)
    return json.loads(gzip.decompress(base64.b64decode(found[0]))) if found else None


def _fmu(folder: Path, drawing: str | None) -> Path:
    surrogate, _ = read_fmu(LINEAR)
    recipe = tiny_recipe(apps={} if drawing is None else {"page": {"drawing": drawing}})
    provenance = with_origins({"recipe": "", "drawing": {"old": 1}}, recipe, surrogate)
    return export_fmu(surrogate, folder / "drawn.fmu", provenance=provenance)


def test_drawing_of_a_recipe_is_drawn_in_the_page_without_its_module(tmp_path: Path) -> None:
    fmu = _fmu(tmp_path, NAME)
    drawing = _drawing(page_of(fmu))
    assert drawing is not None
    assert drawing["text"] == page_drawings.oscillator()["text"]
    assert _drawing(last_section(fmu)) == drawing


def test_drawing_of_an_older_fmu_is_dropped_where_the_recipe_names_none(tmp_path: Path) -> None:
    fmu = _fmu(tmp_path, None)
    _, provenance = read_fmu(fmu)
    assert provenance is not None
    assert "drawing" not in provenance
    assert _drawing(page_of(fmu)) is None


def test_drawing_that_is_asked_for_goes_before_that_of_the_fmu(tmp_path: Path) -> None:
    surrogate, _ = read_fmu(LINEAR)
    carried = {"text": "", "view": [0, 1, 0, 1], "points": {}, "shapes": []}
    fmu = export_fmu(surrogate, tmp_path / "f.fmu", provenance={"drawing": carried})
    drawing = _drawing(page_of(fmu, drawing=NAME))
    assert drawing is not None
    assert drawing["shapes"]


def test_damaged_drawing_in_an_fmu_is_refused(tmp_path: Path) -> None:
    surrogate, _ = read_fmu(LINEAR)
    fmu = export_fmu(surrogate, tmp_path / "f.fmu", provenance={"drawing": {"sound": "loud"}})
    with refused(DrawingError, "provenance of linear'", "text = "):
        page_of(fmu)


@pytest.mark.parametrize("name", ["nowhere:car", NAME.replace("osc", "")])
def test_drawing_that_cannot_be_found_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(LoadError):
        _fmu(tmp_path, name)


@pytest.mark.parametrize(
    ("tables", "words"),
    [
        ({"page": {"drawings": NAME}}, ("recipe 'tiny'", "[apps.page]", "drawings")),
        ({"page": {"drawing": "oscillator"}}, ("[apps.page]", "module:function")),
        pytest.param(
            {"calibrate": {"speed": 1}},
            ("[apps.calibrate]", "delete"),
            marks=needs_app("calibrate"),
        ),
    ],
)
def test_tables_of_apps_are_checked(
    tables: dict[str, dict[str, Any]], words: tuple[str, ...]
) -> None:
    with pytest.raises(RecipeError) as error:
        check_app_tables(tiny_recipe(apps=tables))
    assert all(word in str(error.value) for word in words)


def test_table_of_an_app_that_is_not_installed_is_remarked() -> None:
    (remark,) = remarks_on_app_tables(tiny_recipe(apps={"pages": {}, "page": {}}))
    assert "[apps.pages]" in remark
    assert "'page'" in remark
