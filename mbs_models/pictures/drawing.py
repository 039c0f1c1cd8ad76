"""The mechanisms are drawn in motion, at true scale.

``slide-fmu run`` draws a recipe's system by the function that ``system.picture`` names, which is
one of ``slider_crank_picture`` and ``robot_picture``.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon, Rectangle
from scipy.interpolate import CubicSpline

from mbs_models.pictures.robot_drawing import draw_robot, fading, outputs_at, png
from mbs_models.robot_6r.robot_6r import Robot6R
from mbs_models.slider_crank.slider_crank import SliderCrank
from mbs_models.slider_crank.slider_crank_plant import CRANK_LENGTH, ROD_LENGTH
from slide_fmu.core.signals import FloatArray
from slide_fmu.excitation.base import Kind
from slide_fmu.excitation.point_to_point import PointToPoint
from slide_fmu.excitation.speed_ramps import SpeedRamps
from slide_fmu.systems.base import State, System

DARK, STEEL, BLUE, ORANGE, GROUND = "#222222", "#6b7785", "#1f77b4", "#ff7f0e", "#8a8f96"
"""Colours of the slider-crank's picture."""
CRANK_RADIUS, ROD_THICKNESS, BLOCK, RAIL = 0.03, 0.02, (0.17, 0.12), 0.065
"""Half the crank's width, the rod's thickness, the slider's length and height, and the rails'
distance from the middle, in m."""
POSES = 7
"""Number of instants that are drawn, the last one in full colour."""
POSE_STEP = 3
"""Number of samples between two drawn instants."""
BEFORE, DURATION = 2.0, 4.0
"""Times in s: the first part of a motion is left out, the second is drawn."""


def motion(system: System, kind: Kind, seed: int) -> list[State]:
    """Simulate a random motion, and return its states at all samples of ``DURATION``.

    The first part, in which initial effects decay, is left out. The system ends in the last state.
    """
    count = round((BEFORE + DURATION) / system.step)
    time = system.step * np.arange(count + 1, dtype=np.float64)
    inputs = kind.inputs(system.inputs, time, 1.0, np.random.default_rng(seed))
    system.set_state(system.rest_state(inputs[0]))
    states = [system.get_state()]
    for row in inputs[1:]:
        system.advance(row)
        states.append(system.get_state())
    return states[round(BEFORE / system.step) :]


def draw_slider_crank(system: SliderCrank, states: Sequence[State]) -> bytes:
    """Draw crank, bent rod and slider at the last instants of a motion, and return the PNG.

    The states, at least one, are those at all samples; the system ends in the last one.
    """
    chosen = list(range(len(states) - 1, -1, -POSE_STEP))[:POSES][::-1]
    figure = Figure(figsize=(9, 6.3), layout="constrained")
    above, below = figure.subplots(2, 1, height_ratios=(3.4, 1))
    deflections = outputs_at(system, states)[:, 0]
    _draw_ground(above)
    for alpha, index in zip(fading(len(chosen), 0.1), chosen, strict=True):
        _draw_instant(above, system.points(states[index]), float(alpha))
    _mark_deflection(above, system.points(states[chosen[-1]])[2:], float(deflections[chosen[-1]]))
    above.set(xlim=(-0.62, 1.68), ylim=(-0.6, 0.6), aspect="equal")
    above.set_axis_off()
    time = system.step * np.arange(len(states), dtype=np.float64)
    _draw_history(below, time, 1e3 * deflections, chosen)
    return png(figure)


def _draw_ground(ax: Axes) -> None:
    """Draw the pivot's bearing, the slider's rails and the circle of the crank's tip."""
    reach = CRANK_LENGTH + ROD_LENGTH
    for side in (-1.0, 1.0):
        _draw_rail(ax, (ROD_LENGTH - CRANK_LENGTH - 0.14, reach + 0.14), side * RAIL, side)
    ax.add_patch(Polygon([(0, 0), (-0.075, -0.12), (0.075, -0.12)], fc="white", ec=DARK, lw=1.4))
    _draw_rail(ax, (-0.11, 0.11), -0.12, -1.0)
    ax.add_patch(Circle((0, 0), CRANK_LENGTH, fc="none", ec=GROUND, lw=0.8, ls=(0, (6, 5))))


def _draw_rail(ax: Axes, span: tuple[float, float], height: float, side: float) -> None:
    """Draw a line with hatches on one side, -1 for below or 1 for above."""
    low = height if side > 0 else height - 0.035
    hatched = Rectangle((span[0], low), span[1] - span[0], 0.035, fc="none", ec=GROUND, lw=0)
    hatched.set_hatch("//////")
    ax.add_patch(hatched)
    ax.plot(span, (height, height), color=DARK, lw=1.4, zorder=1.5)


def _draw_instant(ax: Axes, points: FloatArray, alpha: float) -> None:
    """Draw crank, rod, slider and joints at the points of ``SliderCrank.points``, (n, 2) in m."""
    order = 2.0 + alpha
    slider = points[-1]
    corner = (slider[0] - 0.5 * BLOCK[0], slider[1] - 0.5 * BLOCK[1])
    block = Rectangle(corner, *BLOCK, fc="#c9d3de", ec=DARK, lw=1.2, alpha=alpha, zorder=order)
    ax.add_patch(block)
    crank = Polygon(_bar(points[0], points[1], CRANK_RADIUS), fc=STEEL, ec=DARK, lw=1.0)
    rod = Polygon(_beam(points[2:], ROD_THICKNESS), fc=BLUE, ec=BLUE, lw=0.6)
    for patch in (crank, rod):
        patch.set(alpha=alpha, zorder=order + 0.01)
        ax.add_patch(patch)
    for joint in (points[0], points[1], slider):
        circle = Circle((joint[0], joint[1]), 0.014, fc="white", ec=DARK, lw=1.2)
        circle.set(alpha=alpha, zorder=order + 0.02)
        ax.add_patch(circle)


def _bar(start: FloatArray, end: FloatArray, radius: float) -> FloatArray:
    """Return the outline of a bar with round ends in m, shape (n, 2)."""
    along = end - start
    turn = np.arctan2(along[1], along[0]) + np.linspace(0.5, 1.5, 25) * np.pi
    arc = radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    return np.vstack([start + arc, end - arc])


def _beam(nodes: FloatArray, thickness: float) -> FloatArray:
    """Return the outline of a beam through nodes in m, both of shape (n, 2)."""
    curve = CubicSpline(np.linspace(0.0, 1.0, len(nodes)), nodes)
    place = np.linspace(0.0, 1.0, 81)
    middle, slope = curve(place), curve(place, 1)
    normal = np.stack([-slope[:, 1], slope[:, 0]], axis=1)
    offset = 0.5 * thickness * normal / np.linalg.norm(normal, axis=1, keepdims=True)
    return np.vstack([middle + offset, (middle - offset)[::-1]])


def _mark_deflection(ax: Axes, rod: FloatArray, deflection: float) -> None:
    """Draw the line between the rod's ends and the distance of its middle from it, in m."""
    start, end = rod[0], rod[-1]
    ax.plot(*np.stack([start, end]).T, color=ORANGE, lw=1.2, ls="--", zorder=4)
    across = np.array([start[1] - end[1], end[0] - start[0]]) / np.linalg.norm(end - start)
    middle = rod[len(rod) // 2]
    foot = middle - deflection * across
    away = 0.3 * np.sign(deflection) * across
    ax.plot(*np.stack([foot, middle + away]).T, color=ORANGE, lw=0.8, zorder=4)
    label = middle + away
    text = f"deflection {abs(1e3 * deflection):.0f} mm"
    vertical = "bottom" if away[1] > 0 else "top"
    ax.annotate(text, (label[0], label[1]), ha="center", va=vertical, color="#c45f00", zorder=5)


def _draw_history(
    ax: Axes, time: FloatArray, deflections: FloatArray, chosen: Sequence[int]
) -> None:
    """Draw the deflection in mm over the time in s, with the drawn instants as dots."""
    ax.axhline(0.0, color=GROUND, lw=0.8)
    ax.plot(time, deflections, color=BLUE, lw=1.4)
    for alpha, index in zip(fading(len(chosen), 0.1), chosen, strict=True):
        ax.plot(time[index], deflections[index], "o", color=ORANGE, ms=5, alpha=float(alpha))
    ax.set(xlabel="time / s", ylabel="deflection / mm", xlim=(time[0], time[-1] + 0.03))
    ax.grid(alpha=0.3)
    ax.spines[["top", "right"]].set_visible(False)


def slider_crank_picture(system: SliderCrank, seed: int = 7) -> bytes:
    """Draw the slider-crank in a motion that shows much, and return the PNG."""
    ramps = SpeedRamps(kind="speed_ramps", weight=1.0, speed=8.0, acceleration=20.0)
    return draw_slider_crank(system, motion(system, ramps, seed))


def robot_picture(system: Robot6R, seed: int = 189) -> bytes:
    """Draw the robot in a motion that shows much, and return the PNG."""
    moves = PointToPoint(kind="point_to_point", weight=1.0, reach=0.6, keep=0.0)
    return draw_robot(system, motion(system, moves, seed))
