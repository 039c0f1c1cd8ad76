"""The site builds from ``docs`` without warnings, and its pages need no network."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import slide_fmu
from tests.browser import Browser

pytestmark = pytest.mark.extended

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the site, built from a folder with a space in its name; a warning is an error.

    Pages of tutorials are written anew.
    """
    checkout = tmp_path_factory.mktemp("site") / "a checkout"
    shutil.copytree(ROOT / "docs", checkout / "docs", ignore=shutil.ignore_patterns("pages"))
    shutil.copy(ROOT / "mkdocs.yml", checkout)
    for shown in ("slide_fmu", "tests", "fmus"):  # pages show files from there
        (checkout / shown).symlink_to(ROOT / shown)
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", "built"]
    result = subprocess.run(command, cwd=checkout, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    return checkout / "built"


def test_pages_of_the_site_load_nothing_from_the_network(site: Path) -> None:
    pages = list(site.rglob("*.html"))
    names = {page.stem for page in pages}
    files = {page.stem for page in (ROOT / "docs").glob("*.md")}
    assert names > files - {"contributing", "testing"}  # these stay files of the repository
    for page in pages:
        text = page.read_text(encoding="utf-8")
        loaded = re.findall(r'<(?:script|link|img|iframe)[^>]*(?:src|href)="(https?:[^"]*)"', text)
        assert loaded == [], page.name


def test_links_and_pictures_of_the_site_lead_to_files(site: Path) -> None:
    for page in site.rglob("*.html"):
        if page.name == "404.html":
            continue  # its links begin at the root of a server
        for link in re.findall(r'(?:href|src)="([^"]*)"', page.read_text(encoding="utf-8")):
            path = link.split("#")[0].split("?")[0]
            if path and not re.match(r"(?:https?|data|mailto|javascript):", path):
                assert (page.parent / path).exists(), f"{page.name}: {link}"


@pytest.mark.parametrize(("width", "height"), [(900, 646), (368, 764)])
def test_front_page_shows_the_whole_robot_which_makes_its_chosen_move(
    chromium: Browser, site: Path, width: int, height: int
) -> None:
    """The frame has these sizes in ``site.css``, on a screen and on a phone."""
    front = (site / "index.html").read_text(encoding="utf-8")
    (name,) = re.findall(r'<iframe[^>]*src="([^"]*)"', front)
    chromium.resize(width, height)
    chromium.open(site / name)
    assert chromium.evaluate("document.documentElement.dataset.ready") == "yes"
    assert not chromium.evaluate("document.getElementById('drawing').hidden")
    assert chromium.evaluate("document.documentElement.scrollHeight") <= height
    assert chromium.evaluate("document.getElementById('way-moves').textContent") == "Optimise"
    chromium.evaluate("document.getElementById('way-moves').click()")
    assert chromium.evaluate("document.documentElement.scrollHeight") <= height
    said = str(chromium.evaluate("document.querySelector('.verdict').textContent"))
    assert re.findall(r"(\d+ %) earlier", said) == re.findall(r"(\d+ %) sooner", front)
    assert chromium.complaints() == []


def test_switch_of_the_theme_also_turns_the_robot_dark(chromium: Browser, site: Path) -> None:
    chromium.resize(1400, 900)
    chromium.call("Page.navigate", url=(site / "index.html").as_uri())
    switch = "[...document.querySelectorAll('label[for^=__palette]')].find((at) => !at.hidden)"
    scheme = "document.body?.dataset.mdColorScheme"
    chromium.until(f"{scheme} === 'default' && {switch} !== undefined")
    listen = "addEventListener('message', ({ data }) => { window.theme = data.theme; })"
    frame = "Object.assign(document.createElement('iframe'), { srcdoc: '', id: 'framed' })"
    chromium.evaluate(f"document.body.append({frame})")
    chromium.evaluate(f"document.getElementById('framed').contentWindow.eval(\"{listen}\")")
    for _ in range(2):  # to light, then to dark
        chromium.evaluate(f"{switch}.click()")
    chromium.until(f"{scheme} === 'slate'")
    chromium.until("document.getElementById('framed').contentWindow.theme === 'dark'")


@pytest.mark.parametrize("name", ["index.html", "tutorials/pages/index.html"])
def test_search_finds_pages_from_the_disk(chromium: Browser, site: Path, name: str) -> None:
    chromium.resize(1400, 900)
    chromium.call("Page.navigate", url=(site / name).as_uri())
    chromium.until("document.querySelector('input[name=query]') !== null")
    chromium.evaluate(
        "(query => { query.focus(); query.value = 'novelty';"
        " query.dispatchEvent(new Event('input', { bubbles: true }));"
        " query.dispatchEvent(new Event('keyup', { bubbles: true })); })"
        "(document.querySelector('input[name=query]'))"
    )
    chromium.until("document.querySelector('.md-search-result__link') !== null")
    links = chromium.evaluate(
        "[...document.querySelectorAll('.md-search-result__link')].map((at) => at.href)"
    )
    assert any("/trust.html" in link and link.startswith("file:") for link in links)
    assert chromium.complaints() == []


def test_page_of_the_python_interface_documents_every_public_name(site: Path) -> None:
    page = (site / "api.html").read_text(encoding="utf-8")
    for name in set(slide_fmu.__all__) - {"__version__"}:
        assert f'id="slide_fmu.{name}"' in page, name


@pytest.mark.parametrize(
    "name", [path.stem for path in sorted((ROOT / "docs/gallery").glob("*.py"))]
)
def test_tutorial_is_a_page_of_the_site_with_its_figures_and_its_picture(
    site: Path, name: str
) -> None:
    front = (site / "index.html").read_text(encoding="utf-8")
    assert f'href="tutorials/pages/{name}.html"' in front
    page = (site / "tutorials" / "pages" / f"{name}.html").read_text(encoding="utf-8")
    assert f'src="../results/{name}.png"' in page
    assert (site / "tutorials" / "results" / f"{name}.png").stat().st_size > 0
    printed = re.findall(r"^.*: [\d.]+ %$", _results(name), re.MULTILINE)
    assert printed
    assert all(line in page for line in printed)


def _results(name: str) -> str:
    return (ROOT / f"docs/tutorials/results/{name}.md").read_text(encoding="utf-8")
