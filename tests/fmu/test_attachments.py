"""Licences and icon that every FMU carries."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest
from matplotlib import rc_context
from matplotlib.image import imread

from slide_fmu.fmu.attachments.draw_icon import ICON, draw_icon
from slide_fmu.fmu.attachments.files import FOLDER, attached_files
from slide_fmu.fmu.export import export_fmu, read_folder
from slide_fmu.fmu.libraries.build import standard_headers
from slide_fmu.surrogate.surrogate import Surrogate
from tests.refusals import refused

LICENSES = FOLDER / "licenses"


def test_licence_of_the_runtime_is_that_of_the_project() -> None:
    project = Path(__file__).parents[2] / "LICENSE"
    assert (LICENSES / "slide-fmu.txt").read_bytes() == project.read_bytes()


@pytest.mark.parametrize(
    ("name", "original"), [("mingw-w64.txt", "lib/libc/mingw/COPYING"), ("zig.txt", "LICENSE")]
)
def test_notices_of_the_compiler_are_those_of_the_installed_one(name: str, original: str) -> None:
    specification = importlib.util.find_spec("ziglang")
    assert specification is not None
    assert specification.origin is not None
    text = (Path(specification.origin).parent / original).read_bytes()
    assert (LICENSES / name).read_bytes() == text


def test_notice_of_the_fmi_headers_is_that_in_them() -> None:
    header = next(p for p in standard_headers(3) if p.name == "fmi3Functions.h")
    assert (LICENSES / "fmi-headers.txt").read_text("utf-8").strip() in header.read_text("utf-8")


def test_first_page_of_the_licences_names_all_others() -> None:
    text = (LICENSES / "license.txt").read_text("utf-8")
    for path in LICENSES.glob("*.txt"):
        assert path.name == "license.txt" or path.name in text, path.name


def test_icon_is_the_one_that_the_script_draws(tmp_path: Path) -> None:
    """Builds of the libraries that draw differ in single pixels, and in how they compress."""
    draw_icon(tmp_path / "icon.png")
    drawn, kept = (imread(path) for path in (tmp_path / "icon.png", ICON))
    assert drawn.shape == kept.shape
    tiles = (drawn - kept).reshape(10, 10, 10, 10, 4).mean(axis=(1, 3))
    assert np.abs(tiles).max() < 0.05


def test_icon_does_not_depend_on_the_settings_of_matplotlib(tmp_path: Path) -> None:
    draw_icon(tmp_path / "before.png")
    with rc_context({"axes.linewidth": 3.0, "lines.antialiased": False, "savefig.facecolor": "k"}):
        draw_icon(tmp_path / "after.png")
    assert (tmp_path / "after.png").read_bytes() == (tmp_path / "before.png").read_bytes()


def test_icon_has_its_place_in_each_standard() -> None:
    assert "model.png" in attached_files(2)
    assert "terminalsAndIcons/icon.png" in attached_files(3)


def test_files_of_the_caller_do_not_replace_the_licences(
    surrogate: Surrogate, tmp_path: Path
) -> None:
    older = {"licenses/slide-fmu.txt": b"older", "licenses/own.txt": b"own"}
    path = export_fmu(surrogate, tmp_path / "m.fmu", documentation=older)
    found = read_folder(path, "documentation")
    assert found["licenses/slide-fmu.txt"] == (LICENSES / "slide-fmu.txt").read_bytes()
    assert found["licenses/own.txt"] == b"own"


@pytest.mark.parametrize("name", ["../outside", "/outside", ""])
def test_extra_files_stay_in_their_folder(surrogate: Surrogate, tmp_path: Path, name: str) -> None:
    with refused(ValueError, "extra file"):
        export_fmu(surrogate, tmp_path / "m.fmu", extra={name: b""})
