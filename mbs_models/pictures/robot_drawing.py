"""The robot is drawn in motion on its socket, with the deviation of its tool over time."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from mbs_models.robot_6r.flange import rotation_of
from mbs_models.robot_6r.puma_560 import JOINTS
from mbs_models.robot_6r.robot_6r import Robot6R
from mbs_models.robot_6r.socket import FLANGE
from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.base import State, System

AROUND, SLICE = 36, 0.01
"""Number of facets around a tube, and their approximate length in m."""
CAP_RINGS = 5
"""Number of rings of facets at each end of a tube."""


@dataclass(frozen=True, eq=False)
class Facets:
    """Facets have four corners, a normal and a colour each.

    Attributes:
        corners: positions (x, y, z) in m, shape (n, 4, 3).
        normals: outward unit vectors, shape (n, 3).
        colors: red, green, blue from 0 to 1, shape (n, 3).
    """

    corners: FloatArray
    normals: FloatArray
    colors: FloatArray

    @staticmethod
    def joined(parts: list[Facets]) -> Facets:
        """Return the facets of several bodies together."""
        return Facets(
            np.concatenate([part.corners for part in parts]),
            np.concatenate([part.normals for part in parts]),
            np.concatenate([part.colors for part in parts]),
        )


@dataclass(frozen=True)
class Camera:
    """A camera is a parallel projection from an azimuth about z and an elevation, both in rad."""

    azimuth: float
    elevation: float

    @cached_property
    def axes(self) -> FloatArray:
        """The rows point to the right, upwards and towards the viewer; shape (3, 3)."""
        ca, sa = np.cos(self.azimuth), np.sin(self.azimuth)
        ce, se = np.cos(self.elevation), np.sin(self.elevation)
        return np.array([[-sa, ca, 0.0], [-se * ca, -se * sa, ce], [ce * ca, ce * sa, se]])

    def flat(self, points: FloatArray) -> FloatArray:
        """Map points in space (..., 3) to places in the picture (..., 2), both in m."""
        return np.asarray(points @ self.axes[:2].T)

    def shown(self, facets: Facets) -> tuple[FloatArray, FloatArray]:
        """Project the facets that face the viewer, the farthest first, and shade them.

        The light comes from the left above the viewer. Drawn in this order, near facets cover far
        ones (painter's algorithm).

        Returns:
            Corners in the picture in m, shape (n, 4, 2), and red, green, blue, shape (n, 3).
        """
        towards = self.axes[2]
        light = self.axes.T @ np.array([-0.45, 0.65, 0.6])
        light /= np.linalg.norm(light)
        halfway = (light + towards) / np.linalg.norm(light + towards)
        depth = np.mean(facets.corners @ towards, axis=1)
        order = np.argsort(depth)
        order = order[facets.normals[order] @ towards > 0.0]
        normals = facets.normals[order]
        bright = 0.62 + 0.38 * np.clip(normals @ light, 0.0, 1.0)[:, None]
        gloss = 0.35 * np.clip(normals @ halfway, 0.0, 1.0)[:, None] ** 24
        shades = bright * facets.colors[order]
        return self.flat(facets.corners[order]), shades + gloss * (1.0 - shades)


def tube(centres: FloatArray, radius: float, color: str) -> Facets:
    """Return a closed tube along centres, shape (k, 3), with a radius, both in m, and a colour.

    Two centres are a straight tube, which is cut into slices.
    """
    if len(centres) == 2:
        count = int(np.linalg.norm(centres[1] - centres[0]) / SLICE) + 1
        place = np.linspace(0.0, 1.0, count + 1)[:, None]
        centres = (1.0 - place) * centres[0] + place * centres[1]
    along = np.gradient(centres, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    # the world axis that is the least parallel to the tube gives the directions across it
    side = np.eye(3)[np.argmin(np.abs(along[0]))]
    first = np.cross(along, side)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(along, first)
    angle = np.linspace(0.0, 2.0 * np.pi, AROUND + 1)[None, :, None]
    spokes = np.cos(angle) * first[:, None] + np.sin(angle) * second[:, None]
    rings = centres[:, None] + radius * spokes
    wall = _quads(rings)
    outward = _quads(spokes).mean(axis=1)
    shares = np.linspace(0.0, 1.0, CAP_RINGS + 1)[:, None, None]
    caps = [_quads(centres[end] + shares * (rings[end] - centres[end])) for end in (0, -1)]
    normals = [outward / np.linalg.norm(outward, axis=1, keepdims=True)]
    normals += [np.tile(axis, (len(caps[0]), 1)) for axis in (-along[0], along[-1])]
    return _colored(np.concatenate([wall, *caps]), np.concatenate(normals), color)


def ball(centre: FloatArray, radius: float, color: str) -> Facets:
    """Return a ball about a point in m, shape (3,), with a radius in m."""
    polar = np.linspace(0.0, np.pi, AROUND // 2 + 1)[:, None]
    angle = np.linspace(0.0, 2.0 * np.pi, AROUND + 1)[None, :]
    sine = np.sin(polar)
    out = np.stack(
        np.broadcast_arrays(sine * np.cos(angle), sine * np.sin(angle), np.cos(polar)), axis=-1
    )
    outward = _quads(out).mean(axis=1)
    normals = outward / np.linalg.norm(outward, axis=1, keepdims=True)
    return _colored(centre + radius * _quads(out), normals, color)


def _quads(grid: FloatArray) -> FloatArray:
    """Return the cells of a grid of points (k, n, 3), shape ((k - 1) (n - 1), 4, 3)."""
    cells = [grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]]
    return np.stack(cells, axis=2).reshape(-1, 4, 3)


def _colored(corners: FloatArray, normals: FloatArray, color: str) -> Facets:
    return Facets(corners, normals, np.tile(np.array(to_rgb(color)), (len(corners), 1)))


ARM, JOINT, PLASTICS, METAL, HAND = "#d7dde5", "#2f7fc1", "#f0913a", "#8d97a3", "#3a4450"
PATH, GRID, SHADOW = "#d62728", "#d5d9de", "#e9ebee"
AXES = {"x": "#1f77b4", "y": "#2ca02c", "z": "#9467bd"}
"""Colours of the components of the deviation."""
CAMERA = Camera(np.deg2rad(-52.0), np.deg2rad(20.0))
"""Camera that views the robot."""
SOCKET_RADIUS, HAND_LENGTH = 0.05, 0.1
"""Lengths in m."""
POSES, POSE_STEP = 6, 12
"""Number of instants that are drawn, and the number of samples between them."""


def draw_robot(system: Robot6R, states: Sequence[State]) -> bytes:
    """Draw the robot at the last instants of a motion, its tool's path and deviation.

    The states, at least one, are those at all samples; the system ends in the last one. The
    bending of the socket is at true scale. The PNG is returned.
    """
    chosen = list(range(len(states) - 1, -1, -POSE_STEP))[:POSES][::-1]
    figure = Figure(figsize=(11, 5.2), layout="constrained")
    scene, history = figure.subplots(1, 2, width_ratios=(1.5, 1))
    points = np.array([system.points(state) for state in states[chosen[0] :]])
    _draw_floor(scene, float(points[0, 0, 2]))
    last = _robot(system, states[chosen[-1]])
    _draw_shadow(scene, last, float(points[0, 0, 2]))
    for strength, index in list(zip(fading(len(chosen), 0.14), chosen, strict=True))[:-1]:
        _draw_facets(scene, _robot(system, states[index]), float(strength))
    _draw_path(scene, points[:, -1])
    _draw_facets(scene, last, 1.0)
    scene.set_aspect("equal")
    scene.set_axis_off()
    scene.margins(0.01)
    _draw_history(history, system, states, chosen)
    return png(figure)


def png(figure: Figure) -> bytes:
    """Return a figure as PNG, without the software's name: the same picture is the same bytes."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=130, metadata={"Software": None})
    return buffer.getvalue()


def fading(count: int, first: float) -> FloatArray:
    """Return the strengths of ``count`` instants, from the first to the last, which is full."""
    return np.append(np.linspace(first, 0.42, count - 1), 1.0)


def outputs_at(system: System, states: Sequence[State]) -> FloatArray:
    """Return the outputs at states in their units, shape (len(states), n_outputs)."""
    rows = []
    for state in states:
        system.set_state(state)
        rows.append(system.output())
    return np.array(rows)


def _robot(system: Robot6R, state: State) -> Facets:
    """Return socket, links and joints at a state as facets."""
    bottom, flange, shoulder, elbow, forearm, wrist, *_ = system.points(state)
    turn = rotation_of(state.coordinates[3:FLANGE])
    joints = state.coordinates[FLANGE : FLANGE + JOINTS]
    axes = turn @ system.chain.forward_kinematics(joints).rotations[..., 2].T
    upper, low, hand = axes[:, 1], axes[:, 2], axes[:, 6]
    parts = [
        tube(np.stack([bottom - [0, 0, 0.012], bottom]), 0.11, METAL),
        tube(_bent(bottom, flange, axes[:, 0]), SOCKET_RADIUS, PLASTICS),
        tube(np.stack([flange, flange + 0.014 * axes[:, 0]]), 0.075, METAL),
        tube(np.stack([flange, shoulder]), 0.058, ARM),
        tube(shoulder + np.outer([-0.085, 0.085], upper), 0.066, JOINT),
        tube(np.stack([shoulder, elbow]), 0.048, ARM),
        tube(np.stack([elbow - 0.06 * low, elbow + 0.21 * low]), 0.052, JOINT),
        tube(np.stack([forearm, wrist]), 0.036, ARM),
        ball(wrist, 0.045, JOINT),
        tube(np.stack([wrist, wrist + HAND_LENGTH * hand]), 0.022, HAND),
        tube(wrist + np.outer([0.8 * HAND_LENGTH, HAND_LENGTH], hand), 0.036, HAND),
    ]
    return Facets.joined(parts)


def _bent(bottom: FloatArray, top: FloatArray, axis: FloatArray) -> FloatArray:
    """Return the middle line of the bent socket in m, shape (12, 3).

    It is the cubic Hermite curve that is upright at the bottom and follows an axis at the top.
    """
    s = np.linspace(0.0, 1.0, 12)[:, None]
    length = float(np.linalg.norm(top - bottom))
    ends = (2 * s**3 - 3 * s**2 + 1) * bottom + (3 * s**2 - 2 * s**3) * top
    slopes = (s**3 - 2 * s**2 + s) * np.array([0.0, 0.0, 1.0]) + (s**3 - s**2) * axis
    return np.asarray(ends + length * slopes)


def _draw_facets(ax: Axes, facets: Facets, strength: float) -> None:
    corners, shades = CAMERA.shown(facets)
    colors = 1.0 - strength * (1.0 - shades)
    bodies = PolyCollection(list(corners), facecolors=colors, edgecolors=colors, lw=0.4)
    bodies.set_zorder(2.0 + strength)
    ax.add_collection(bodies)


def _draw_floor(ax: Axes, height: float) -> None:
    """Draw a grid of 0.2 m on the floor about the socket, at a height in m."""
    reach = 0.6
    ends, lines = np.array([-reach, reach]), []
    for offset in np.linspace(-reach, reach, 7):
        along = np.stack([ends, np.full(2, offset), np.full(2, height)], axis=1)
        lines += [CAMERA.flat(along), CAMERA.flat(along[:, [1, 0, 2]])]
    ax.add_collection(LineCollection(lines, colors=GRID, lw=0.8, zorder=0.9))


def _draw_shadow(ax: Axes, facets: Facets, height: float) -> None:
    dropped = facets.corners.copy()
    dropped[..., 2] = height
    flat = CAMERA.flat(dropped)
    shadow = PolyCollection(list(flat), facecolors=SHADOW, edgecolors=SHADOW, lw=0.4)
    shadow.set_zorder(0.8)
    ax.add_collection(shadow)


def _draw_path(ax: Axes, tool: FloatArray) -> None:
    """Draw the path of the tool point, shape (n, 3) in m, with a white edge."""
    flat = CAMERA.flat(tool)
    ax.plot(flat[:, 0], flat[:, 1], color="white", lw=3.5, zorder=2.9)
    ax.plot(flat[:, 0], flat[:, 1], color=PATH, lw=1.8, zorder=2.9)


def _draw_history(
    ax: Axes, system: Robot6R, states: Sequence[State], chosen: Sequence[int]
) -> None:
    """Draw the deviation in mm over the time in s, with the drawn instants as lines."""
    deviation, time = 1e3 * outputs_at(system, states)[:, :3], system.step * np.arange(len(states))
    for strength, index in zip(fading(len(chosen), 0.14), chosen, strict=True):
        ax.axvline(time[index], color=PATH, lw=0.9, alpha=float(strength))
    for (axis, color), values in zip(AXES.items(), deviation.T, strict=True):
        ax.plot(time, values, color=color, lw=1.4, label=axis)
    ax.set(xlabel="time / s", ylabel="deviation / mm", xlim=(0, time[-1] + 0.03))
    ax.set_title("tool point against that on a rigid socket", fontsize=10)
    ax.grid(alpha=0.3)
    ax.spines[["top", "right"]].set_visible(False)
    ax.legend(loc="best", ncols=3, fontsize=9)
