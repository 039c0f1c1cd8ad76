"""Round bodies are drawn as flat shaded facets, seen from far away, without a 3D renderer."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from matplotlib.colors import to_rgb

from slide_fmu.core.signals import FloatArray

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
