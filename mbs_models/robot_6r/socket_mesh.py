"""Mesh the socket with Netgen and NGSolve and reduce it with exudyn.

Usage: python -m mbs_models.robot_6r.socket_mesh [--element-size 0.009] [--element-order 2]
[--file ...]

This writes the file that the robot's model reads, and needs the extra ``mesh``. The model itself
needs only the file.
"""

# mypy: allow-untyped-calls
from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np
from exudyn.FEM import FEMinterface

from mbs_models.robot_6r.socket import FILE, FLANGE, Socket, SocketMesh
from slide_fmu.core.signals import FloatArray

_NEVER = 10**9
"""exudyn reports its progress from this many coordinates on: never."""


def finite_elements(mesh: SocketMesh) -> tuple[Any, list[int], list[int]]:
    """Mesh the cylinder and compute its modes.

    Returns:
        exudyn's FEMinterface with the Hurty-Craig-Bampton modes, the indices of the nodes of the
        bottom, and those of the flange.
    """
    import ngsolve  # an optional dependency

    meshed = ngsolve.Mesh(_cylinder(mesh).GenerateMesh(maxh=mesh.element_size))
    if mesh.element_order > 1:
        meshed.Curve(mesh.element_order)
    elements = FEMinterface()
    elements.ImportMeshFromNGsolve(
        meshed,
        density=mesh.density,
        youngsModulus=mesh.youngs_modulus,
        poissonsRatio=mesh.poissons_ratio,
        meshOrder=mesh.element_order,
    )
    bottom, flange = (
        elements.GetNodesInPlane([0.0, 0.0, height], [0.0, 0.0, 1.0])
        for height in (0.0, mesh.length)
    )
    elements.ComputeHurtyCraigBamptonModes(
        [bottom, flange], nEigenModes=mesh.internal_modes, timerTreshold=_NEVER
    )
    return elements, bottom, flange


def reduced(mesh: SocketMesh) -> Socket:
    """Mesh and reduce the socket; the flange's coordinates are those on the cylinder's axis."""
    elements, _, flange = finite_elements(mesh)
    modes, mass = elements.modeBasis["matrix"], elements.GetMassMatrix()
    eccentricity = elements.GetNodePositionsAsArray()[flange].mean(axis=0)
    eccentricity[2] -= mesh.length
    basis = modes @ _from_axis(eccentricity, mesh.internal_modes)
    # a unit displacement of all nodes along each axis: M times it is the weight per gravity
    moved = np.tile(np.eye(3), (elements.NumberOfNodes(), 1))
    return Socket(
        mesh,
        basis.T @ (mass @ basis),
        basis.T @ (elements.GetStiffnessMatrix() @ basis),
        basis.T @ (mass @ moved),
        elements.NumberOfNodes(),
    )


def _cylinder(mesh: SocketMesh) -> Any:
    """Return the closed hollow cylinder as Netgen's geometry."""
    from netgen.csg import CSGeometry, Cylinder, Plane, Pnt, Vec

    def piece(radius: float, low: float, high: float) -> Any:
        axis = Pnt(0, 0, 0), Pnt(0, 0, mesh.length)
        below, above = Plane(Pnt(0, 0, low), Vec(0, 0, -1)), Plane(Pnt(0, 0, high), Vec(0, 0, 1))
        return Cylinder(*axis, radius) * below * above

    cavity = piece(mesh.radius - mesh.wall, mesh.bottom, mesh.length - mesh.top)
    geometry = CSGeometry()
    geometry.Add(piece(mesh.radius, 0.0, mesh.length) - cavity)
    return geometry


def _from_axis(eccentricity: FloatArray, internal_modes: int) -> FloatArray:
    """Return the matrix from coordinates of the flange on the axis to those of exudyn's modes.

    exudyn's flange point is the mean of the flange's nodes, ``eccentricity`` (in m, shape (3,))
    away from the axis: it moves by u + theta x e. Its rotation modes turn by minus theta.
    """
    x, y, z = eccentricity
    result = np.diag([1.0] * 3 + [-1.0] * 3 + [1.0] * internal_modes)
    result[:3, 3:FLANGE] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    return result


def main() -> None:
    """Run the command line: mesh, reduce and write the file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--element-size", type=float, default=SocketMesh.element_size)
    parser.add_argument("--element-order", type=int, default=SocketMesh.element_order)
    parser.add_argument("--file", type=Path, default=FILE)
    arguments = parser.parse_args()
    mesh = SocketMesh(element_size=arguments.element_size, element_order=arguments.element_order)
    reduced(mesh).write(arguments.file)


if __name__ == "__main__":
    main()
