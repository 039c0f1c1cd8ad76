"""Round bodies as flat shaded facets, seen from far away: for pictures without a 3D renderer."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from matplotlib.colors import to_rgb

from slide_fmu.core.signals import FloatArray

AROUND, SLICE = 36, 0.01
"""Facets around a tube, and their length along it in m, roughly."""
CAP_RINGS = 5
"""Rings of facets on the ends of a tube."""


@dataclass(frozen=True, eq=False)
class Facets:
    """Four-cornered facets with their colours.

    Attributes:
        corners: in m, shape (n, 4, 3).
        normals: outward unit vectors, shape (n, 3).
        colors: red, green, blue from 0 to 1, shape (n, 3).
    """

    corners: FloatArray
    normals: FloatArray
    colors: FloatArray

    @staticmethod
    def joined(parts: list[Facets]) -> Facets:
        """All facets of several bodies."""
        return Facets(
            np.concatenate([part.corners for part in parts]),
            np.concatenate([part.normals for part in parts]),
            np.concatenate([part.colors for part in parts]),
        )


@dataclass(frozen=True)
class Camera:
    """A parallel projection.

    Attributes:
        azimuth: of the viewer about z from x, in rad.
        elevation: of the viewer above the xy plane, in rad.
    """

    azimuth: float
    elevation: float

    @cached_property
    def axes(self) -> FloatArray:
        """Rows: to the right, upwards, towards the viewer; shape (3, 3)."""
        ca, sa = np.cos(self.azimuth), np.sin(self.azimuth)
        ce, se = np.cos(self.elevation), np.sin(self.elevation)
        return np.array([[-sa, ca, 0.0], [-se * ca, -se * sa, ce], [ce * ca, ce * sa, se]])

    def flat(self, points: FloatArray) -> FloatArray:
        """Places in the picture in m of points in space, shape (..., 2) of (..., 3)."""
        return np.asarray(points @ self.axes[:2].T)

    def shown(self, facets: Facets) -> tuple[FloatArray, FloatArray]:
        """Visible facets in the picture, (n, 4, 2), the farthest first, and their shades (n, 3).

        The light comes from the left above the viewer.
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
    """A closed tube along a line of centres in m, shape (k, 3), k >= 2."""
    if len(centres) == 2:
        count = int(np.linalg.norm(centres[1] - centres[0]) / SLICE) + 1
        place = np.linspace(0.0, 1.0, count + 1)[:, None]
        centres = (1.0 - place) * centres[0] + place * centres[1]
    along = np.gradient(centres, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
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
    """A ball about a point in m, shape (3,)."""
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
    """Cells of a grid of points (k, n, 3), shape ((k - 1) (n - 1), 4, 3)."""
    cells = [grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]]
    return np.stack(cells, axis=2).reshape(-1, 4, 3)


def _colored(corners: FloatArray, normals: FloatArray, color: str) -> Facets:
    return Facets(corners, normals, np.tile(np.array(to_rgb(color)), (len(corners), 1)))
