"""The page in headless Chromium, opened from disk: what people do, and what they see then."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from slide_fmu.apps.credentials import members
from slide_fmu.apps.credentials.experiment import read_experiment
from slide_fmu.apps.credentials.tables import write_table
from slide_fmu.fmu.export import read_member
from tests.apps.page.conftest import FMUS
from tests.browser import Browser

PageOf = Callable[[str], Path]

SIZES = [(400, 900), (1400, 900)]
NAMES = sorted(path.parent.name for path in FMUS.glob("*/*.fmu"))
ROUNDING = 1e-7
"""Of relative errors: outputs are of single precision."""

CLOCK = "parseFloat(document.getElementById('clock').textContent)"


def _click(chromium: Browser, element: str) -> None:
    chromium.evaluate(f"document.getElementById('{element}').click()")


def _text(chromium: Browser, element: str) -> str:
    return str(chromium.evaluate(f"document.getElementById('{element}').textContent"))


def _problem(chromium: Browser) -> str | None:
    found = "(e => e.hidden ? null : e.textContent)(document.getElementById('problem'))"
    message = chromium.evaluate(found)
    return None if message is None else str(message)


def _give_file(chromium: Browser, path: Path) -> None:
    """Choose a file where the page asks for one."""
    root = chromium.call("DOM.getDocument")["root"]["nodeId"]
    found = chromium.call("DOM.querySelector", nodeId=root, selector="#open")["nodeId"]
    chromium.call("DOM.setFileInputFiles", files=[str(path)], nodeId=found)


@pytest.mark.parametrize("name", NAMES)
def test_page_opens_from_disk_and_runs_without_a_complaint(
    chromium: Browser, page_of: PageOf, name: str
) -> None:
    chromium.resize(1400, 900)
    chromium.open(page_of(name))
    assert chromium.evaluate("document.documentElement.dataset.ready") == "yes"
    chromium.until(f"{CLOCK} > 0.2")
    assert _problem(chromium) is None
    assert chromium.complaints() == []


def test_page_that_is_damaged_says_so(chromium: Browser, page_of: PageOf, tmp_path: Path) -> None:
    text = page_of("linear").read_text(encoding="utf-8")
    begin = text.index('id="blob-surrogate">') + len('id="blob-surrogate">')
    damaged = tmp_path / "damaged.html"
    damaged.write_text(text[:begin] + "H4sI" + "A" * 40 + text[begin + 44 :], encoding="utf-8")
    chromium.open(damaged)
    assert chromium.evaluate("document.documentElement.dataset.ready") == "no"
    assert "The page cannot run here" in str(_problem(chromium))
    chromium.events.clear()


@pytest.mark.extended
@pytest.mark.parametrize(("width", "height"), SIZES)
@pytest.mark.parametrize("name", ["duffing", "robot_6r"])
def test_page_fits_phones_and_screens_dark_and_light(
    chromium: Browser, page_of: PageOf, tmp_path: Path, name: str, width: int, height: int
) -> None:
    colours = []
    for dark in (False, True):
        chromium.resize(width, height, dark)
        chromium.open(page_of(name), "#stored")
        chromium.until("document.querySelector('.plot.main').width > 300")
        assert chromium.evaluate("document.documentElement.scrollWidth") <= width
        colours.append(chromium.evaluate("getComputedStyle(document.body).backgroundColor"))
        path = tmp_path / f"{name}-{width}-{dark}.png"
        chromium.screenshot(path)
        print(path)
        assert path.stat().st_size > 10_000
    assert colours[0] != colours[1]
    _click(chromium, "theme")
    assert chromium.evaluate("getComputedStyle(document.body).backgroundColor") == colours[0]


@pytest.mark.extended
@pytest.mark.parametrize("name", NAMES)
def test_stored_trajectory_is_computed_as_the_fmu_did_with_the_errors_of_the_card(
    chromium: Browser, page_of: PageOf, name: str
) -> None:
    experiment = read_experiment(FMUS / name / f"{name}.fmu")
    assert experiment is not None
    chromium.open(page_of(name), "#stored")
    assert float(_text(chromium, "same").split()[0]) < 5e-4  # per cent
    rows = chromium.evaluate(
        "[...document.querySelectorAll('#errors tr')].map(r => [...r.cells].map(c => c.innerText))"
    )
    expected = experiment.relative_errors()
    assert [row[0].replace(" ", "_") for row in rows] == list(expected)
    shown = [float(row[1].split()[0]) / 100 for row in rows]
    np.testing.assert_allclose(shown, list(expected.values()), rtol=5e-3, atol=ROUNDING)


def test_keys_alone_move_inputs_and_stop_the_clock(chromium: Browser, page_of: PageOf) -> None:
    chromium.open(page_of("duffing"))
    slider = "document.getElementById('slider-force')"
    for _ in range(30):
        chromium.press("Tab")
        if chromium.evaluate(f"document.activeElement === {slider}"):
            break
    # The input wanders until the key is pressed.
    chromium.evaluate(
        f"{slider}.addEventListener('keydown', () => before = {slider}.valueAsNumber, true), 0"
    )
    chromium.press("ArrowRight")
    moved = chromium.evaluate(f"{slider}.valueAsNumber - before")
    assert chromium.evaluate(f"document.activeElement === {slider}")
    assert abs(moved) == pytest.approx(20.0)
    assert not chromium.evaluate("document.getElementById('wander').checked")
    chromium.evaluate("document.activeElement.blur()")
    chromium.press(" ")
    assert _text(chromium, "play") == "Play"
    chromium.evaluate("new Promise(done => setTimeout(done, 200))")  # until it is shown
    stopped = chromium.evaluate(CLOCK)
    chromium.evaluate("new Promise(done => setTimeout(done, 300))")
    assert chromium.evaluate(CLOCK) == stopped


def test_pad_sets_the_input_where_it_is_touched(chromium: Browser, page_of: PageOf) -> None:
    chromium.resize(1400, 900)
    chromium.open(page_of("duffing"))
    box = chromium.evaluate(
        "(r => [r.left, r.top, r.width, r.height])"
        "(document.querySelector('.pad').getBoundingClientRect())"
    )
    chromium.click(box[0] + 0.75 * box[2], box[1] + 0.5 * box[3])
    value = chromium.evaluate("document.getElementById('slider-force').valueAsNumber")
    assert value == pytest.approx(500, abs=10)
    chromium.until("document.querySelector('.card .value').textContent.includes('0.2')")


def test_lamp_warns_of_inputs_that_no_calibration_saw(
    chromium: Browser, page_of: PageOf, tmp_path: Path
) -> None:
    chromium.open(page_of("duffing"))
    time = 0.03 * np.arange(800)
    loud = tmp_path / "loud.csv"
    loud.write_bytes(write_table(time, {"force": 1500 * np.sign(np.sin(8 * time))}))
    _give_file(chromium, loud)
    chromium.until("document.body.dataset.way === 'own'")
    chromium.until("document.getElementById('lamp').dataset.state === 'bad'")
    assert _text(chromium, "lamp-title") == "outside the domain"


def test_own_record_is_answered_as_the_fmu_answers_it(
    chromium: Browser, page_of: PageOf, tmp_path: Path
) -> None:
    fmu = FMUS / "duffing" / "duffing.fmu"
    experiment = read_experiment(fmu)
    assert experiment is not None
    own = tmp_path / "own.csv"
    own.write_bytes(read_member(fmu, members.INPUTS) or b"")
    chromium.open(page_of("duffing"))
    chromium.evaluate(
        "URL.createObjectURL = (blob) => { window.saved = blob.text(); return '#'; }; null"
    )
    _give_file(chromium, own)
    chromium.until("!document.getElementById('save').disabled")
    _click(chromium, "save")
    lines = str(chromium.evaluate("window.saved")).splitlines()
    names = lines[0].split(",")
    assert names[:3] == ["time", "force", "position"]
    assert {"position_error_estimate", "position_error_bound", "in_domain"} <= set(names)
    position = [float(line.split(",")[2]) for line in lines[1:]]
    np.testing.assert_allclose(position, experiment.results["position"], atol=5 * 2e-6)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("t,force\n0,1\n1,2\n", 'expected names of columns, "time" first'),
        ("time,power\n0,1\n1,2\n", "force is missing"),
        ("time,force\n0,1\n1\n", "line 3 has 1 values; expected 2"),
        ("time,force\n0,1\n1,much\n", 'line 3: "much"; expected a number'),
        ("time,force\n0,1\n0,1\n", "line 3: time 0; expected rising times"),
    ],
)
def test_own_record_that_cannot_be_used_is_refused_with_its_line(
    chromium: Browser, page_of: PageOf, tmp_path: Path, text: str, said: str
) -> None:
    chromium.open(page_of("duffing"))
    path = tmp_path / "wrong.csv"
    path.write_text(text, encoding="utf-8")
    _give_file(chromium, path)
    chromium.until("!document.getElementById('problem').hidden")
    assert said in str(_problem(chromium))
    assert chromium.evaluate("document.body.dataset.way") == "live"
