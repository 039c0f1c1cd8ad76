"""The page of an FMU is one file that needs nothing else."""

from __future__ import annotations

import base64
import gzip
import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner

from slide_fmu.apps.credentials import members
from slide_fmu.apps.page.page import write_page
from slide_fmu.cli.app import app
from slide_fmu.fmu.export import export_fmu, read_fmu, read_member
from slide_fmu.surrogate.description import SurrogateDescription
from tests.apps.page.conftest import FMUS

NAMES = sorted(path.parent.name for path in FMUS.glob("*/*.fmu"))


def _blobs(page: str) -> dict[str, str]:
    return dict(re.findall(r'<script type="text/plain" id="blob-(\w+)">(.*?)</script>', page))


def _facts(page: str) -> dict[str, object]:
    (text,) = re.findall(r'<script type="application/json" id="facts">(.*?)</script>', page)
    return dict(json.loads(text))


@pytest.mark.parametrize("name", NAMES)
def test_page_holds_the_surrogate_and_the_trajectory(
    page_of: Callable[[str], Path], name: str
) -> None:
    page, fmu = page_of(name).read_text(encoding="utf-8"), FMUS / name / f"{name}.fmu"
    blobs = _blobs(page)
    held = {key: gzip.decompress(base64.b64decode(text)) for key, text in blobs.items()}
    assert held["surrogate"] == read_fmu(fmu)[0].to_bytes()
    assert held["inputs"] == read_member(fmu, members.INPUTS)
    assert held["results"] == read_member(fmu, members.RESULTS)
    assert held["reference"] == read_member(fmu, members.REFERENCE_MODEL)


def test_page_names_no_address_on_the_network(page_of: Callable[[str], Path]) -> None:
    page = page_of("robot_6r").read_text(encoding="utf-8")
    script = gzip.decompress(base64.b64decode(_blobs(page)["script"])).decode("utf-8")
    assert re.findall(r"(?:https?:|src=|@import|url\()\S*", page + script) == []


def test_page_has_the_memory_of_the_verdict(page_of: Callable[[str], Path]) -> None:
    surrogate, _ = read_fmu(FMUS / "duffing" / "duffing.fmu")
    memory, page = (
        SurrogateDescription.of(surrogate).memory_s,
        page_of("duffing").read_text(encoding="utf-8"),
    )
    assert _facts(page)["memory"] == pytest.approx(memory)
    assert f"Outputs depend on the inputs of the last {memory:.3g} s." in page


def test_page_is_the_same_when_it_is_written_again(
    page_of: Callable[[str], Path], tmp_path: Path
) -> None:
    again = write_page(FMUS / "linear" / "linear.fmu", tmp_path / "again.html")
    assert again.read_bytes() == page_of("linear").read_bytes()


def test_page_of_an_fmu_without_a_trajectory_has_none(tmp_path: Path) -> None:
    surrogate, _ = read_fmu(FMUS / "linear" / "linear.fmu")
    fmu = export_fmu(surrogate, tmp_path / "bare.fmu")
    page = write_page(fmu, tmp_path / "bare.html").read_text(encoding="utf-8")
    assert _facts(page)["trajectory"] is None
    assert set(_blobs(page)) == {"runtime", "surrogate", "script"}


def test_title_of_a_page_may_hold_anything(tmp_path: Path) -> None:
    title = 'a < b </script> & "c" <!--'
    page = write_page(FMUS / "linear" / "linear.fmu", tmp_path / "odd.html", title)
    text = page.read_text(encoding="utf-8")
    assert _facts(text)["title"] == title
    assert '<h1 id="title">a &lt; b &lt;/script&gt; &amp; &#34;c&#34; &lt;!--</h1>' in text


def test_page_subcommand_writes_the_page(tmp_path: Path) -> None:
    path = tmp_path / "duffing.html"
    fmu = FMUS / "duffing" / "duffing.fmu"
    result = CliRunner().invoke(app, ["page", str(fmu), "-o", str(path), "--title", "a mass"])
    assert result.exit_code == 0, result.output
    assert str(path) in result.output.replace("\n", "")
    assert '<h1 id="title">a mass</h1>' in path.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("name", "said"),
    [("page.htm", "expected a name ending in .html"), ("page", "expected a name ending in .html")],
)
def test_page_subcommand_refuses_a_file_of_another_kind(
    tmp_path: Path, name: str, said: str
) -> None:
    fmu = FMUS / "linear" / "linear.fmu"
    result = CliRunner().invoke(app, ["page", str(fmu), "-o", str(tmp_path / name)])
    assert result.exit_code == 1
    assert said in result.output
    assert list(tmp_path.iterdir()) == []
