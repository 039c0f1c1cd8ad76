"""How fine the mesh of the socket must be: flange flexibility over element size and order.

Usage (needs the extra ``mesh``):

    python tests/benchmarks/socket_mesh_study.py --json - [--sizes 0.05 0.02 0.012 0.009]

For each mesh: nodes, diagonal of the flange's flexibility (lateral, axial, bending, torsion; the
mean of x and y), its deviation from the finest quadratic mesh, the mass that the flange feels
and the lowest internal frequency. ``kept`` is the file of the package.
"""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np
from figures_out import write_figures
from scipy.linalg import eigh

from mbs_models.robot_6r.socket import FLANGE, Socket, SocketMesh
from mbs_models.robot_6r.socket_mesh import reduced

ORDERS = (1, 2)


def figures(socket: Socket) -> dict[str, Any]:
    """What the robot feels of a socket."""
    flange, internal = slice(0, FLANGE), slice(FLANGE, None)
    flexibility = np.diag(np.linalg.inv(socket.symmetric().stiffness[flange, flange]))
    squares = eigh(
        socket.stiffness[internal, internal], socket.mass[internal, internal], eigvals_only=True
    )
    return {
        "element_size": socket.mesh.element_size,
        "element_order": socket.mesh.element_order,
        "nodes": socket.nodes,
        "flexibility": dict(
            zip(
                ("lateral", "axial", "bending", "torsion"),
                flexibility[[0, 2, 3, 5]].tolist(),
                strict=True,
            )
        ),
        "mass": float(np.mean(np.diag(socket.mass)[:3])),
        "lowest_frequency_hz": float(np.sqrt(squares[0]) / (2.0 * np.pi)),
    }


def study(sizes: list[float]) -> dict[str, Any]:
    """All meshes against the finest quadratic one."""
    meshes = [
        figures(reduced(SocketMesh(element_size=size, element_order=order)))
        for order in ORDERS
        for size in sorted(sizes, reverse=True)
    ]
    kept, finest = figures(Socket.read()), meshes[-1]["flexibility"]
    for found in [*meshes, kept]:
        found["deviation"] = {
            name: value / finest[name] - 1.0 for name, value in found["flexibility"].items()
        }
    return {"kept": kept, "meshes": meshes}


def main() -> None:
    """Print or write the result."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", default="-")
    parser.add_argument("--sizes", type=float, nargs="+", default=[0.05, 0.02, 0.012, 0.008])
    arguments = parser.parse_args()
    write_figures(study(arguments.sizes), arguments.json)


if __name__ == "__main__":
    main()
