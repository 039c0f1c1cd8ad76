"""Descriptions of machines in motion: what they place where, and which are refused."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mbs_models.pictures import page_drawings
from mbs_models.robot_6r.puma_560 import LIMITS, puma_560
from mbs_models.slider_crank.slider_crank_plant import CRANK_LENGTH, ROD_LENGTH
from slide_fmu.apps.page.drawing import DrawingError, checked_drawing, load_drawing
from slide_fmu.apps.page.page import write_page
from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.export import export_fmu, load, read_fmu
from slide_fmu.systems.errors import LoadError
from tests.apps.page.conftest import FMUS
from tests.browser import Browser
from tests.refusals import refused

DRAWINGS = {
    "duffing": "oscillator",
    "duffing_10ms": "oscillator",
    "linear": "oscillator",
    "linear_10ms": "oscillator",
    "mass_chain": "mass_chain",
    "mass_chain_10ms": "mass_chain",
    "slider_crank": "slider_crank",
    "slider_crank_20ms": "slider_crank",
    "slider_crank_payload": "slider_crank",
    "robot_6r": "robot",
}

OPERATIONS: dict[str, Callable[..., float]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": lambda a, b: a / b,
    "sqrt": math.sqrt,
    "sin": math.sin,
    "cos": math.cos,
}


def _value(expression: Any, known: Mapping[str, float]) -> float:
    if isinstance(expression, str):
        return known[expression]
    if isinstance(expression, int | float):
        return float(expression)
    operation, *arguments = expression
    return OPERATIONS[operation](*(_value(argument, known) for argument in arguments))


def _points(drawing: dict[str, Any], **signals: float) -> dict[str, FloatArray]:
    known = {**signals, "magnification": drawing.get("magnification", 1.0)}
    for name, expression in drawing.get("values", []):
        known[name] = _value(expression, known)
    return {
        name: np.array([_value(c, known) for c in coordinates])
        for name, coordinates in drawing["points"].items()
    }


def test_robot_is_drawn_where_its_kinematics_place_it() -> None:
    chain = puma_560(np.array([0.0, 0.0, page_drawings.HAND]))
    still = {f"deviation_{axis}": 0.0 for axis in "xyz"}
    for joints in np.random.default_rng(3).uniform(-LIMITS, LIMITS, (5, 6)):
        angles = {f"joint_{i + 1}": angle for i, angle in enumerate(joints)}
        points = _points(page_drawings.robot(), **angles, **still)
        frames = chain.forward_kinematics(joints)
        for link in range(1, 7):
            np.testing.assert_allclose(points[f"link_{link}"], frames.positions[link], atol=1e-9)
        np.testing.assert_allclose(points["tool"], chain.tool_position(joints), atol=1e-9)


def test_robot_s_tool_is_moved_by_its_deviation_and_the_bottom_stays() -> None:
    angles = {f"joint_{i + 1}": 0.3 * i for i in range(6)}
    rigid = _points(page_drawings.robot(), **angles, deviation_x=0, deviation_y=0, deviation_z=0)
    bent = _points(
        page_drawings.robot(), **angles, deviation_x=1e-3, deviation_y=0, deviation_z=-2e-3
    )
    moved = page_drawings.DEVIATION_SCALE * np.array([1e-3, 0.0, -2e-3])
    np.testing.assert_allclose(bent["tool"] - rigid["tool"], moved, atol=1e-12)
    np.testing.assert_allclose(bent["socket_0"], rigid["socket_0"], atol=1e-12)


@pytest.mark.parametrize("angle", [0.0, 1.0, 2.5, -2.0])
def test_rod_of_the_slider_crank_keeps_its_length_and_bends_to_the_left(angle: float) -> None:
    director = {"director_x": math.cos(angle), "director_y": math.sin(angle)}
    points = _points(page_drawings.slider_crank(), **director, deflection=0.01)
    tip, slider = points["tip"], points["slider"]
    assert np.linalg.norm(tip) == pytest.approx(CRANK_LENGTH)
    assert np.linalg.norm(slider - tip) == pytest.approx(ROD_LENGTH)
    assert slider[1] == 0
    middle = points[f"rod_{page_drawings.ROD_PARTS // 2}"] - (tip + slider) / 2
    along = (slider - tip) / ROD_LENGTH
    left = np.array([-along[1], along[0]])
    np.testing.assert_allclose(middle, page_drawings.DEFLECTION_SCALE * 0.01 * left, atol=1e-12)


@pytest.mark.parametrize("name", DRAWINGS)
def test_drawings_of_the_released_machines_fit_their_fmus(name: str) -> None:
    surrogate, _ = read_fmu(FMUS / name / f"{name}.fmu")
    signals = [signal.name for signal in (*surrogate.inputs, *surrogate.outputs)]
    drawing = load_drawing(f"mbs_models.pictures.page_drawings:{DRAWINGS[name]}", signals)
    assert drawing.shapes


PLAIN: dict[str, Any] = {
    "text": "a dot",
    "view": [-1, 1, -1, 1],
    "points": {"dot": ["x", ["*", 2, "y"]]},
    "shapes": [{"disc": "dot", "radius": 0.1}],
}


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"points": {"dot": ["x", "z"]}}, "'z'; expected one of"),
        ({"points": {"dot": ["x"]}}, "has 1 coordinates; expected 2"),
        ({"points": {"dot": ["x", ["^", "x", 2]]}}, r"operation '\^' with 2 arguments"),
        ({"points": {"dot": ["x", ["sin", "x", 2]]}}, "operation 'sin' with 2 arguments"),
        ({"points": {"dot": ["x", None]}}, "None; expected a number, a name or an operation"),
        ({"values": [["a", "b"], ["b", 1]]}, "value 'a': 'b'; expected one of"),
        ({"shapes": [{"line": ["dot", "dash"]}]}, r"unknown points \['dash'\]"),
        ({"shapes": [{"disc": "dot", "colour": "red"}]}, "colour"),
        ({"sound": "loud"}, "sound"),
    ],
)
def test_drawing_that_is_not_usable_is_refused(change: dict[str, Any], said: str) -> None:
    assert checked_drawing(PLAIN, ["x", "y"], "plain").text == "a dot"
    with pytest.raises(DrawingError, match=said):
        checked_drawing({**PLAIN, **change}, ["x", "y"], "plain")


def test_drawing_that_is_not_there_is_refused() -> None:
    with refused(LoadError, "has no function 'car'"):
        load_drawing("mbs_models.pictures.page_drawings:car", [])
    with refused(LoadError, "no_such_module"):
        load_drawing("no_such_module:car", [])


@pytest.mark.extended
@pytest.mark.parametrize("name", ["duffing", "slider_crank", "robot_6r"])
def test_page_draws_the_machine_as_it_moves(chromium: Browser, tmp_path: Path, name: str) -> None:
    path = tmp_path / "drawn.html"
    drawing = f"mbs_models.pictures.page_drawings:{DRAWINGS[name]}"
    write_page(FMUS / name / f"{name}.fmu", path, None, drawing)
    chromium.resize(1400, 900)
    chromium.open(path, "#stored")
    picture = "document.getElementById('drawing-canvas').toDataURL()"
    chromium.until("document.getElementById('drawing-canvas').width > 300")
    chromium.evaluate(f"window.last = {picture}; null")
    chromium.evaluate(
        "(e => { e.value = e.max / 2; e.dispatchEvent(new Event('input')); })"
        "(document.getElementById('time'))"
    )
    chromium.until(f"{picture} !== window.last")
    assert chromium.complaints() == []


@pytest.mark.extended
def test_page_without_a_drawing_shows_no_place_for_it(chromium: Browser, tmp_path: Path) -> None:
    surrogate = load(FMUS / "mass_chain" / "mass_chain.fmu")
    plain = export_fmu(surrogate, tmp_path / "plain.fmu")  # without what the released one carries
    chromium.open(write_page(plain, tmp_path / "plain.html"))
    assert chromium.evaluate("document.getElementById('drawing').hidden")
