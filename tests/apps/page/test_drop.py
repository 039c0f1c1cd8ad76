"""A page without a surrogate takes FMUs of users, and shows what their own pages show."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner

from slide_fmu.apps.page.page import write_drop_page
from slide_fmu.cli.app import app
from slide_fmu.fmu.export import export_fmu, read_fmu
from tests.apps.page.conftest import FMUS
from tests.browser import Browser
from tests.marks import essential

SHOWN = """
({
  names: [...document.querySelectorAll(".output h3")].map((e) => e.textContent),
  units: [...document.querySelectorAll(".output .value")].map((e) => e.textContent.split(" ")[1]),
  sliders: [...document.querySelectorAll(".slider")].map((e) => {
    const range = e.querySelector("input");
    return [e.querySelector("label").textContent, Number(range.min), Number(range.max)];
  }),
  errors: [...document.querySelectorAll("#errors tr")].map((e) => e.textContent),
  summary: document.getElementById("summary").textContent,
  keys: document.querySelector(".output .keys").textContent.includes("error"),
  drawn: !document.getElementById("drawing").hidden,
})
"""


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_drop_page(tmp_path_factory.mktemp("drop") / "drop.html")


def _give(chromium: Browser, path: Path) -> None:
    root = chromium.call("DOM.getDocument")["root"]["nodeId"]
    found = chromium.call("DOM.querySelector", nodeId=root, selector="#fmu")["nodeId"]
    chromium.call("DOM.setFileInputFiles", files=[str(path)], nodeId=found)


@pytest.mark.extended
@pytest.mark.parametrize(
    "name", essential(["duffing", "slider_crank_payload", "robot_6r"], "duffing")
)
def test_dropped_fmu_is_shown_as_on_its_own_page(
    chromium: Browser, page: Path, page_of: Callable[[str], Path], name: str
) -> None:
    chromium.resize(1400, 900)
    chromium.open(page_of(name), "#stored")
    expected = chromium.evaluate(SHOWN)
    chromium.open(page, "#stored")
    assert chromium.evaluate("document.documentElement.dataset.ready") == "wait"
    _give(chromium, FMUS / name / f"{name}.fmu")
    chromium.until("document.documentElement.dataset.ready === 'yes'")
    assert chromium.evaluate(SHOWN) == expected
    same = str(chromium.evaluate("document.getElementById('same').textContent"))
    assert float(same.split()[0]) < 5e-4  # per cent: single precision
    assert chromium.complaints() == []


@pytest.mark.extended
def test_dropped_fmu_of_fmi_3_without_a_trajectory_is_shown(
    chromium: Browser, page: Path, tmp_path: Path
) -> None:
    surrogate, _ = read_fmu(FMUS / "linear" / "linear.fmu")
    fmu = export_fmu(surrogate, tmp_path / "three.fmu", fmi=3)
    chromium.open(page)
    _give(chromium, fmu)
    chromium.until("document.documentElement.dataset.ready === 'yes'")
    chromium.until("parseFloat(document.getElementById('clock').textContent) > 0.2")
    assert chromium.evaluate("document.querySelectorAll('.slider').length") >= 1
    assert chromium.complaints() == []


@pytest.mark.parametrize(
    ("member", "said"), [(None, "no ZIP archive"), ("model.txt", "no resources/surrogate.slide")]
)
def test_dropped_file_of_another_kind_is_refused(
    chromium: Browser, page: Path, tmp_path: Path, member: str | None, said: str
) -> None:
    path = tmp_path / "other.fmu"
    if member is None:
        path.write_text("nothing", encoding="utf-8")
    else:
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr(member, "nothing")
    chromium.open(page)
    _give(chromium, path)
    chromium.until("!document.getElementById('problem').hidden")
    text = str(chromium.evaluate("document.getElementById('problem').textContent"))
    assert "other.fmu" in text
    assert said in text
    assert "expected an FMU made by slide-fmu" in text


def test_theme_is_switched_before_and_after_an_fmu_is_open(chromium: Browser, page: Path) -> None:
    switched = "(theme.click(), document.documentElement.dataset.theme)"
    chromium.resize(400, 900)
    chromium.open(page)
    assert chromium.evaluate(switched) == "dark"
    words = chromium.evaluate(
        "(({ scrollWidth, clientWidth }) => [scrollWidth, clientWidth])"
        "(document.querySelector('#welcome > .what'))"
    )
    assert words[0] == words[1]  # nothing is cut
    _give(chromium, FMUS / "linear" / "linear.fmu")
    chromium.until("document.documentElement.dataset.ready === 'yes'")
    assert chromium.evaluate("document.documentElement.dataset.theme") == "dark"
    assert chromium.evaluate(switched) == "light"
    chromium.evaluate("document.body.dispatchEvent(new DragEvent('drop', { bubbles: true }))")
    summary = chromium.evaluate("document.getElementById('summary').textContent")
    assert summary == "Reload this page to open another FMU."


def test_page_subcommand_writes_the_page_for_any_fmu(tmp_path: Path) -> None:
    path = tmp_path / "drop.html"
    result = CliRunner().invoke(app, ["page", "--drop", "-o", str(path)])
    assert result.exit_code == 0, result.output
    assert 'id="blob-surrogate"' not in path.read_text(encoding="utf-8")
    for words in (["--drop", str(FMUS / "linear" / "linear.fmu")], []):
        result = CliRunner().invoke(app, ["page", *words, "-o", str(path)])
        assert result.exit_code == 1
        assert "expected one FMU, or --drop" in " ".join(result.output.split())
