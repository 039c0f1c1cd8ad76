"""The flexible socket under the robot is a finite-element model, reduced to what the robot feels.

The bottom is clamped, the flange on top is rigid. The reduction (Hurty, 1965; Craig and Bampton,
1968) leaves the displacement u and the rotation vector theta of the flange, both in world axes,
and some internal modes. ``mbs_models.robot_6r.socket_mesh`` computes the file that is kept here.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from slide_fmu.core.signals import FloatArray

FILE = Path(__file__).parent / "data" / "socket.json"
"""File of the reduced socket that comes with the package."""
FLANGE = 6
"""Number of coordinates of the flange: u in m and theta in rad."""
_MATRICES = ("mass", "stiffness", "weight")
_BENT, _SHEARED = [3, 4], [0, 1]
"""Bending about x and y has the first two coordinates, shear along x and y the other two."""


@dataclass(frozen=True)
class SocketMesh:
    """The socket is a closed hollow cylinder along z; its material and its mesh are given too.

    The defaults are the numbers of the paper where it has them.

    Attributes:
        radius: outer radius in m.
        wall: thickness of the wall in m.
        length: length in m, with top and bottom.
        top: thickness of the solid top in m.
        bottom: thickness of the bottom plate in m.
        youngs_modulus: Young's modulus in Pa.
        poissons_ratio: Poisson's ratio.
        density: density in kg/m^3.
        element_size: largest edge of an element in m.
        element_order: 1 for linear, 2 for quadratic tetrahedra.
        internal_modes: number of modes in addition to the flange's coordinates.
    """

    radius: float = 0.05
    wall: float = 0.01
    length: float = 0.3
    top: float = 0.055
    bottom: float = 0.01
    youngs_modulus: float = 1e9
    poissons_ratio: float = 0.3
    density: float = 1000.0
    element_size: float = 0.009
    element_order: int = 2
    internal_modes: int = 8


@dataclass(frozen=True, eq=False)
class Socket:
    """The reduced socket follows M s'' + K (s + d s') = W g + forces on the flange.

    The coordinates s are u, theta and the internal coordinates, all in SI units.

    Attributes:
        mesh: geometry, material and mesh of the full socket.
        mass: M, shape (n, n), n = 6 + internal modes.
        stiffness: K, shape (n, n); zero between flange and internal coordinates.
        weight: W, force in s per acceleration of gravity, shape (n, 3).
        nodes: number of nodes of the mesh.

    Raises:
        ValueError: shapes do not belong together.
    """

    mesh: SocketMesh
    mass: FloatArray
    stiffness: FloatArray
    weight: FloatArray
    nodes: int

    def __post_init__(self) -> None:
        n = FLANGE + self.mesh.internal_modes
        for name, shape in {"mass": (n, n), "stiffness": (n, n), "weight": (n, 3)}.items():
            given = getattr(self, name).shape
            if given != shape:
                raise ValueError(f"socket: {name} of shape {given}; expected {shape}")

    def symmetric(self) -> Socket:
        """Return the socket with a flange stiffness as symmetric about z as the cylinder is.

        The mesh is not quite symmetric, but ``SocketSpring`` needs symmetry.
        """
        stiffness = self.stiffness.copy()
        stiffness[:FLANGE, :FLANGE] = _symmetric(stiffness[:FLANGE, :FLANGE])
        return Socket(self.mesh, self.mass, stiffness, self.weight, self.nodes)

    def without_modes(self) -> Socket:
        """Return the socket without internal modes, as the flange feels it at low frequencies."""
        flange = slice(0, FLANGE)
        return Socket(
            replace(self.mesh, internal_modes=0),
            self.mass[flange, flange],
            self.stiffness[flange, flange],
            self.weight[flange],
            self.nodes,
        )

    def write(self, path: Path) -> None:
        """Write the socket to a JSON file, with a checksum."""
        content = {
            "mesh": asdict(self.mesh),
            "nodes": self.nodes,
            **{name: getattr(self, name).tolist() for name in _MATRICES},
        }
        content["checksum"] = _checksum(content)
        path.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")

    @staticmethod
    def read(path: Path = FILE) -> Socket:
        """Read the socket from a file that ``write`` made; by default from the package.

        Raises:
            ValueError: the file has changed since it was written.
        """
        content = json.loads(path.read_text(encoding="utf-8"))
        if content.pop("checksum", None) != _checksum(content):
            raise ValueError(
                f"{path} does not match its checksum: make it again with "
                "python -m mbs_models.robot_6r.socket_mesh"
            )
        matrices = {name: np.array(content[name], dtype=np.float64) for name in _MATRICES}
        return Socket(SocketMesh(**content["mesh"]), nodes=content["nodes"], **matrices)


def _checksum(content: Mapping[str, object]) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _symmetric(stiffness: FloatArray) -> FloatArray:
    """Return the part of a flange's stiffness, shape (6, 6), that a turn about z leaves as it is.

    Bending couples u_y with theta_x and, with the other sign, u_x with theta_y.
    """
    diagonal = np.diag(stiffness).copy()
    diagonal[_SHEARED], diagonal[_BENT] = diagonal[_SHEARED].mean(), diagonal[_BENT].mean()
    coupling = 0.5 * (stiffness[1, 3] - stiffness[0, 4])
    result = np.diag(diagonal)
    result[1, 3] = result[3, 1] = coupling
    result[0, 4] = result[4, 0] = -coupling
    return result
