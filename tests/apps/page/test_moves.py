"""Moves of a task in the page: what is carried, what is played, and what is said of it."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from slide_fmu.apps.motion.page_moves import moves_of, solved_moves
from slide_fmu.apps.motion.predictor import MotionError
from slide_fmu.apps.motion.solve import MoveSolution, solve
from slide_fmu.apps.motion.task import MoveTask
from slide_fmu.apps.page.facts import page_facts
from slide_fmu.apps.page.page import write_page
from slide_fmu.cli.app import app
from slide_fmu.core.figures import plain
from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.export import read_fmu
from tests.apps.page.conftest import FMUS
from tests.browser import Browser
from tests.refusals import refused

DUFFING = FMUS / "duffing" / "duffing.fmu"
CRANK = FMUS / "slider_crank_payload" / "slider_crank_payload.fmu"
OSCILLATOR = "mbs_models.pictures.page_drawings:oscillator"
TASK = 'kind = "earliest"\nstart = [0.0]\ngoal = [600.0]\ntolerance = 2e-3\n'


@pytest.fixture(scope="module")
def solved() -> MoveSolution:
    task = MoveTask(kind="earliest", start=(0.0,), goal=(600.0,), tolerance=2e-3)
    return solve(DUFFING, task)


@pytest.fixture(scope="module")
def page(solved: MoveSolution, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("moves") / "moves.html"
    return write_page(DUFFING, path, None, OSCILLATOR, plain(moves_of(solved)))


def _settled(solved: MoveSolution) -> list[float]:
    figures = solved.figures()
    shaped = min(row.settled_with_margin_s or math.inf for row in figures.baselines[1:])
    times = [
        figures.move.settled_with_margin_s,
        shaped,
        figures.baselines[0].settled_with_margin_s,
    ]
    return [time for time in times if time is not None]


def test_moves_go_from_rest_at_the_start_to_rest_at_the_goal(solved: MoveSolution) -> None:
    found = moves_of(solved)
    names = [move.name for move in found.moves]
    assert names == ["optimised", "ZVD on 2 modes", "fastest profile"]
    time = np.array(found.time)
    np.testing.assert_allclose(np.diff(time), solved.surrogate.window.step)
    for move in found.moves:
        (force,) = np.array(move.inputs)
        assert len(force) == len(time)
        assert force[0] == 0.0
        np.testing.assert_allclose(force[time > move.arrives + 1e-9], 600.0)
        assert time[-1] > move.arrives + 0.2


def test_inputs_of_a_move_are_known_and_moving_ones_are_set_one_step_ahead(tmp_path: Path) -> None:
    task = tmp_path / "task.toml"
    turn = 'kind = "earliest"\nstart = [0.0]\ngoal = [2.0]\ntolerance = 2e-3\n'
    limits = "[limits]\nspeed = [8.0]\nacceleration = [20.0]\n"
    task.write_text(turn + limits, encoding="utf-8")
    found, surrogate = solved_moves(CRANK, task), read_fmu(CRANK)[0]
    assert found.time[:2] == (-surrogate.window.step, 0.0)
    assert page_facts(surrogate).known == 12_000_000
    assert page_facts(read_fmu(DUFFING)[0]).known == 23_000_000


def test_task_of_a_path_has_no_moves(tmp_path: Path) -> None:
    task = tmp_path / "task.toml"
    task.write_text('kind = "compensate"\npath = "path.csv"\n', encoding="utf-8")
    with refused(MotionError, "expected a move from", "to follow"):
        solved_moves(DUFFING, task)


def test_page_begins_at_the_parameters_at_which_the_move_was_chosen(tmp_path: Path) -> None:
    task, path = tmp_path / "task.toml", tmp_path / "page.html"
    turn = 'kind = "earliest"\nstart = [0.0]\ngoal = [2.0]\ntolerance = 2e-3\n'
    limits = "[limits]\nspeed = [8.0]\nacceleration = [20.0]\n"
    task.write_text(f"{turn}{limits}[parameters]\nslider_mass = 1.4\n", encoding="utf-8")
    write_page(CRANK, path, moves=plain(solved_moves(CRANK, task)))
    carried = re.search(r'<script type="application/json"[^>]*>(.*?)</script>', path.read_text())
    assert carried is not None
    (mass,) = json.loads(carried.group(1))["parameters"]
    assert (mass["name"], mass["start"]) == ("slider_mass", 1.4)


def test_page_subcommand_carries_the_move_of_a_task(tmp_path: Path) -> None:
    task, path = tmp_path / "task.toml", tmp_path / "page.html"
    task.write_text(TASK, encoding="utf-8")
    words = ["page", str(DUFFING), "-o", str(path), "--motion", str(task)]
    result = CliRunner().invoke(app, words)
    assert result.exit_code == 0, result.output
    assert '"fastest profile"' in path.read_text(encoding="utf-8")


@pytest.mark.extended
def test_page_finds_the_times_that_the_search_found(
    chromium: Browser, solved: MoveSolution, page: Path
) -> None:
    chromium.resize(1400, 900)
    chromium.open(page)
    chromium.evaluate("document.getElementById('way-moves').click()")
    said = str(chromium.evaluate("document.querySelector('.verdict').textContent"))
    shown = [float(text) for text in re.findall(r"after ([\d.]+) s", said)]
    first, shaped, plain = _settled(solved)
    assert shown == pytest.approx([first, shaped, plain], abs=0.0051)
    assert f"{100 * (1 - first / shaped):.0f} % earlier than the ZVD on 2 modes" in said
    assert f"{100 * (1 - first / plain):.0f} % earlier than the fastest profile." in said
    assert chromium.complaints() == []


@pytest.mark.extended
def test_page_of_a_move_that_settles_later_says_so(
    chromium: Browser, solved: MoveSolution, tmp_path: Path
) -> None:
    moves = plain(moves_of(solved))
    for names, words in (
        (moves["moves"][:1:-1] + moves["moves"][:1], "% later."),
        (moves["moves"][:1] * 2, None),
    ):
        path = write_page(DUFFING, tmp_path / "later.html", moves={**moves, "moves": names})
        chromium.open(path)
        chromium.evaluate("document.getElementById('way-moves').click()")
        said = str(chromium.evaluate("document.querySelector('.verdict').textContent"))
        assert "earlier" not in said
        assert "-" not in said
        assert (words is None and "%" not in said) or (words is not None and words in said)


@pytest.mark.extended
def test_moves_are_played_to_their_end_and_again(chromium: Browser, page: Path) -> None:
    chromium.open(page)
    chromium.evaluate("document.getElementById('way-moves').click()")
    chromium.until("document.getElementById('play').textContent === 'Play'")
    end = chromium.evaluate("document.getElementById('time').valueAsNumber")
    last = chromium.evaluate("Number(document.getElementById('time').max)")
    assert end == pytest.approx(last)
    chromium.evaluate("document.getElementById('play').click()")
    chromium.until(f"document.getElementById('time').valueAsNumber < {end}")


def _drag(chromium: Browser, by: float) -> FloatArray:
    """Drag the machine to the right by a part of its drawing, and return what is set then."""
    box = chromium.evaluate(
        "(r => [r.left, r.top, r.width, r.height])"
        "(document.getElementById('drawing-canvas').getBoundingClientRect())"
    )
    begin = (box[0] + 0.5 * box[2], box[1] + 0.5 * box[3])
    for kind, x, buttons in (
        ("mousePressed", begin[0], 1),
        ("mouseMoved", begin[0] + by * box[2], 1),
        ("mouseReleased", begin[0] + by * box[2], 0),
    ):
        where = {"x": x, "y": begin[1], "button": "left", "buttons": buttons, "clickCount": 1}
        chromium.call("Input.dispatchMouseEvent", type=kind, **where)
    return chromium.evaluate("document.getElementById('slider-force').valueAsNumber")


def test_machine_that_is_dragged_moves_its_input(chromium: Browser, page: Path) -> None:
    chromium.resize(1400, 900)
    chromium.open(page)
    chromium.evaluate("document.getElementById('wander').click()")
    # A number that is shown may be older than the input, which wandered until now.
    chromium.evaluate(
        "(s => {s.value = 100; s.dispatchEvent(new Event('input'))})"
        "(document.getElementById('slider-force'))"
    )
    text = chromium.evaluate("document.getElementById('grip-text').textContent")
    assert text == "Drag the machine: → and ↑ move force."
    assert _drag(chromium, 0.1) == pytest.approx(300.0, abs=8.0)
    _drag(chromium, 0.49)
    assert _drag(chromium, 0.49) == 1000.0  # no further than the range
