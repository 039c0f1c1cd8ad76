"""The reduced socket: its file, beam theory, its spring, and exudyn's own floating frame."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.spatial.transform import Rotation

from mbs_models.robot_6r.flange import euler_of, moment_of, rotation_of, vector_of
from mbs_models.robot_6r.socket import FILE, FLANGE, Socket, SocketMesh
from mbs_models.robot_6r.socket_spring import SocketSpring
from slide_fmu.core.signals import FloatArray
from tests.refusals import refused

SOCKET = Socket.read().symmetric()
DAMPING = 8e-3
SPRING = SocketSpring.of(SOCKET.stiffness[:FLANGE, :FLANGE], DAMPING)


def test_file_belongs_to_the_default_mesh() -> None:
    socket = Socket.read()
    assert socket.mesh == SocketMesh()
    assert socket.mass.shape == (14, 14)
    assert socket.nodes > 10_000
    assert FILE.stat().st_size < 20_000


def test_changed_file_is_refused(tmp_path: Path) -> None:
    content = json.loads(FILE.read_text())
    content["mesh"]["youngs_modulus"] = 2e9
    changed = tmp_path / "socket.json"
    changed.write_text(json.dumps(content))
    with refused(ValueError, "checksum"):
        Socket.read(changed)


def test_socket_that_is_written_is_read_again(tmp_path: Path) -> None:
    path = tmp_path / "socket.json"
    SOCKET.write(path)
    again = Socket.read(path)
    assert np.array_equal(again.stiffness, SOCKET.stiffness)
    assert again.mesh == SOCKET.mesh


def test_matrix_of_another_shape_is_named() -> None:
    with refused(ValueError, "weight of shape"):
        dataclasses.replace(SOCKET, weight=np.zeros((6, 3)))


def test_the_mesh_is_symmetric_but_for_a_little() -> None:
    found, cleaned = Socket.read().stiffness, SOCKET.stiffness
    scale = np.sqrt(np.diag(cleaned))
    assert np.max(np.abs(found - cleaned) / np.outer(scale, scale)) < 1e-3


def test_socket_is_as_soft_as_its_beam() -> None:
    """A hollow beam with solid ends, which turn little: by a Timoshenko beam of the same parts."""
    mesh = SocketMesh()
    inner = mesh.radius - mesh.wall
    shear_modulus = mesh.youngs_modulus / (2.0 * (1.0 + mesh.poissons_ratio))
    flexibility = np.zeros((4, 4))  # of u_x, theta_y under force and moment; of u_z; of theta_z
    for length, hole, above in (
        (mesh.bottom, 0.0, mesh.length - mesh.bottom),
        (mesh.length - mesh.top - mesh.bottom, inner, mesh.top),
        (mesh.top, 0.0, 0.0),
    ):
        area = np.pi * (mesh.radius**2 - hole**2)
        bending = mesh.youngs_modulus * np.pi / 4.0 * (mesh.radius**4 - hole**4)
        shear = shear_modulus * area * (0.53 if hole else 0.89)
        far = above + length
        flexibility[0, 0] += (far**3 - above**3) / (3.0 * bending) + length / shear
        flexibility[0, 1] += (far**2 - above**2) / (2.0 * bending)
        flexibility[1, 1] += length / bending
        flexibility[2, 2] += length / (mesh.youngs_modulus * area)
        flexibility[3, 3] += length / (shear_modulus * np.pi / 2.0 * (mesh.radius**4 - hole**4))
    flexibility[1, 0] = flexibility[0, 1]
    found = np.linalg.inv(SOCKET.stiffness[:FLANGE, :FLANGE])
    pick = [0, 4, 2, 5]
    assert found[np.ix_(pick, pick)] == pytest.approx(flexibility, rel=0.06, abs=1e-12)


def test_socket_carries_its_mass_and_weight() -> None:
    mesh = SocketMesh()
    inner = mesh.radius - mesh.wall
    hollow = mesh.length - mesh.top - mesh.bottom
    mass = mesh.density * np.pi * (mesh.radius**2 * mesh.length - inner**2 * hollow)
    # the flange carries its solid top and less than half of the tube, the ground carries the rest
    assert 0.45 * mass < SOCKET.weight[2, 2] < 0.65 * mass
    assert SOCKET.weight[0, 0] == pytest.approx(SOCKET.weight[1, 1], rel=1e-4)
    assert np.all(np.linalg.eigvalsh(SOCKET.mass) > 0.0)
    frequencies = np.sqrt(
        eigh(SOCKET.stiffness[FLANGE:, FLANGE:], SOCKET.mass[FLANGE:, FLANGE:])[0]
    )
    assert np.min(frequencies) > 2.0 * np.pi * 700.0


def test_rotations_of_the_flange_are_those_of_scipy() -> None:
    rng = np.random.default_rng(0)
    for _ in range(20):
        euler, theta = rng.uniform(-0.1, 0.1, 3), rng.uniform(-0.03, 0.03, 3)
        turn = Rotation.from_euler("XYZ", euler)
        assert rotation_of(euler) == pytest.approx(turn.as_matrix(), abs=1e-15)
        assert vector_of(rotation_of(euler)) == pytest.approx(turn.as_rotvec(), abs=1e-14)
        found = Rotation.from_euler("XYZ", euler_of(theta)).as_rotvec()
        assert found == pytest.approx(theta, abs=np.linalg.norm(theta) ** 3)
        torque = rng.uniform(-1.0, 1.0, 3)
        moment = moment_of(theta, torque)
        assert moment + 0.5 * np.cross(theta, moment) == pytest.approx(torque)
    assert np.array_equal(vector_of(np.eye(3)), np.zeros(3))


def place(rng: np.random.Generator, size: float) -> FloatArray:
    """Displacement and Euler angles of a flange that turns by up to ``size`` rad."""
    return size * np.concatenate([rng.uniform(-0.1, 0.1, 3), rng.uniform(-1.0, 1.0, 3)])


def energy(where: FloatArray) -> float:
    """Of the socket, for displacement and Euler angles: quadratic in the rotation vector."""
    theta = Rotation.from_euler("XYZ", where[3:]).as_rotvec()
    s = np.concatenate([where[:3], theta])
    return float(0.5 * s @ SOCKET.stiffness[:FLANGE, :FLANGE] @ s)


def generalized(where: FloatArray, rates: FloatArray) -> FloatArray:
    """Forces of exudyn's spring on displacement and Euler angles."""
    a, b = where[3:5]
    axes = Rotation.from_euler("XYZ", [a, b, 0.0]).as_matrix()
    turn_x = Rotation.from_euler("X", a).as_matrix()
    to_omega = np.column_stack([np.eye(3)[0], turn_x[:, 1], axes[:, 2]])
    omega = to_omega @ rates[3:]
    force = SPRING.exudyn_force()
    found = np.array(
        force(None, 0.0, 0, where[:3], where[3:], rates[:3], omega, None, None, None, None, None)
    )
    return -np.concatenate([found[:3], to_omega.T @ found[3:]])


def test_exact_spring_has_the_energy_of_the_rotation_vector() -> None:
    rng, size, eps = np.random.default_rng(1), 0.02, 1e-6
    for _ in range(10):
        where = place(rng, size)
        slope = [energy(where + eps * e) - energy(where - eps * e) for e in np.eye(FLANGE)]
        found = generalized(where, np.zeros(FLANGE))
        scale = np.abs(SOCKET.stiffness[:FLANGE, :FLANGE]) @ np.abs(where)
        assert np.all(np.abs(found + np.array(slope) / (2.0 * eps)) < 2.0 * size**2 * scale)


def test_fast_spring_is_the_exact_one_to_the_second_order() -> None:
    def error(size: float) -> float:
        rng = np.random.default_rng(2)
        differences = []
        for _ in range(10):
            where, rates = place(rng, size), 20.0 * place(rng, size)
            linear = -SOCKET.stiffness[:FLANGE, :FLANGE] @ (where + DAMPING * rates)
            fast = linear + SPRING.beyond_linear(where.tolist(), rates.tolist())
            exact = generalized(where, rates)
            differences.append(np.abs(fast - exact) / np.max(np.abs(exact)))
        return float(np.max(differences))

    assert error(0.02) < 2e-3
    # what is left is of the third order in forces of the first order
    assert 3.5 < error(0.02) / error(0.01) < 4.5


def test_coarse_mesh_gives_almost_the_same() -> None:
    pytest.importorskip("ngsolve", reason="needs the extra 'mesh'")
    from mbs_models.robot_6r.socket_mesh import reduced

    coarse = reduced(SocketMesh(element_size=0.05))
    assert coarse.nodes < 3000
    fine, found = (np.diag(np.linalg.inv(s.stiffness[:FLANGE, :FLANGE])) for s in (SOCKET, coarse))
    assert found == pytest.approx(fine, rel=0.01)
    assert coarse.mass[:3, :3] == pytest.approx(SOCKET.mass[:3, :3], abs=0.003)
