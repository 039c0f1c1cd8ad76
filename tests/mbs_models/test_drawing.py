"""Pictures of the mechanisms: their geometry, and that the same motion is drawn again."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from mbs_models.pictures import drawing
from mbs_models.pictures.drawing import draw_slider_crank
from mbs_models.pictures.robot_drawing import Camera, Facets, ball, draw_robot, tube
from mbs_models.robot_6r.robot_6r import Robot6R
from mbs_models.slider_crank.slider_crank import SliderCrank
from slide_fmu.core.signals import FloatArray
from slide_fmu.pipeline import run as release
from slide_fmu.pipeline.job import Job
from slide_fmu.pipeline.run_folder import RunFolder
from slide_fmu.recipe.case import Systems, case_of
from slide_fmu.systems.errors import LoadError
from tests.recipes import tiny_recipe
from tests.refusals import refused


@pytest.mark.extended
@pytest.mark.parametrize(
    ("system", "draw"),
    [(SliderCrank(), drawing.slider_crank_picture), (Robot6R(), drawing.robot_picture)],
    ids=["slider_crank", "robot_6r"],
)
def test_picture_of_the_same_seed_is_the_same(
    system: SliderCrank | Robot6R, draw: Callable[..., bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(drawing, "BEFORE", 0.1)
    monkeypatch.setattr(drawing, "DURATION", 0.8)
    pictures = [draw(system, seed=3), draw(system, seed=3), draw(system)]
    assert pictures[0] == pictures[1] != pictures[2]
    assert np.std(imread(io.BytesIO(pictures[0]))[..., :3]) > 0.05


def finished(folder: Path, picture: str | None = None) -> Job:
    """A job whose run folder is there."""
    folder.mkdir(exist_ok=True)
    recipe = tiny_recipe(system={"picture": picture})
    return Job("", case_of(recipe), RunFolder(folder), lambda stage: lambda *state: None)


@pytest.mark.extended
@pytest.mark.parametrize(
    ("system", "draw"),
    [(SliderCrank(), drawing.slider_crank_picture), (Robot6R(), drawing.robot_picture)],
    ids=["slider_crank", "robot_6r"],
)
def test_picture_that_the_recipe_names_goes_into_the_run_folder(
    system: SliderCrank | Robot6R,
    draw: Callable[..., bytes],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(drawing, "BEFORE", 0.1)
    monkeypatch.setattr(drawing, "DURATION", 0.8)
    monkeypatch.setattr(Systems, "reference", system)
    (tmp_path / "mechanism.png").write_bytes(b"an older one")
    job = finished(tmp_path, f"{drawing.__name__}:{draw.__name__}")
    assert release.draw_mechanism(job) == "mechanism.png"
    assert (tmp_path / "mechanism.png").read_bytes() == draw(system)
    assert (tmp_path / "mechanism.png").read_bytes().startswith(b"\x89PNG")


def test_picture_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with refused(LoadError, "system.picture = ", "has no function 'nothing'"):
        release.draw_mechanism(finished(tmp_path, f"{drawing.__name__}:nothing"))


def test_picture_of_a_model_that_does_not_draw_itself_may_lie_there(tmp_path: Path) -> None:
    assert release.draw_mechanism(finished(tmp_path)) is None
    (tmp_path / "mechanism.png").write_bytes(b"by somebody else")
    assert release.draw_mechanism(finished(tmp_path)) == "mechanism.png"
    assert (tmp_path / "mechanism.png").read_bytes() == b"by somebody else"


def test_a_single_state_is_a_picture_too() -> None:
    crank, robot = SliderCrank(), Robot6R()
    for picture in (
        draw_slider_crank(crank, [crank.straight_state(0.7, 0.0)]),
        draw_robot(robot, [robot.rest_state(np.zeros(6))]),
    ):
        assert imread(io.BytesIO(picture)).ndim == 3


def centre(body: Facets) -> FloatArray:
    return body.corners.reshape(-1, 3).mean(axis=0)


@pytest.mark.parametrize(
    "body",
    [
        tube(np.array([[0.1, 0.2, 0.0], [0.3, 0.6, 0.4]]), 0.05, "red"),
        ball(np.array([0.2, -0.1, 0.5]), 0.07, "red"),
    ],
    ids=["tube", "ball"],
)
def test_facets_enclose_their_body(body: Facets) -> None:
    areas = 0.5 * np.linalg.norm(
        np.cross(body.corners[:, 2] - body.corners[:, 0], body.corners[:, 3] - body.corners[:, 1]),
        axis=1,
    )
    # outward areas of a closed surface add up to nothing
    assert np.linalg.norm(areas @ body.normals) < 1e-9 * np.sum(areas) + 1e-6
    outward = np.sum(body.normals * (body.corners.mean(axis=1) - centre(body)), axis=1)
    assert np.all(outward > 0.0)
    assert np.linalg.norm(body.normals, axis=1) == pytest.approx(np.ones(len(areas)))


def test_camera_sees_the_near_half_the_nearest_last() -> None:
    body, camera = ball(np.zeros(3), 1.0, "red"), Camera(0.4, 0.3)
    assert camera.axes @ camera.axes.T == pytest.approx(np.eye(3))
    corners, shades = camera.shown(body)
    assert len(corners) == len(shades) == pytest.approx(0.5 * len(body.corners), rel=0.1)
    assert np.all((shades >= 0.0) & (shades <= 1.0))
    distance = np.linalg.norm(corners.mean(axis=1), axis=1)
    assert distance[-1] < 0.1 < 0.9 < distance[0]
    assert camera.flat(np.array([0.0, 0.0, 1.0])) == pytest.approx([0.0, np.cos(0.3)])
