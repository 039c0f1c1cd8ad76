"""These are the bytes of a state-space network; the contract is in ``slide_fmu/network/bytes.py``.

The second reader is the C runtime, ``slide_fmu/fmu/runtime/network/cell_layout.c``.
"""

from __future__ import annotations

import struct
from dataclasses import fields

import numpy as np

from slide_fmu.core.byte_reader import Reader, indices_bytes
from slide_fmu.core.parameter_basis import MOST_TERMS, ParameterBasis
from slide_fmu.core.parameters import Parameter
from slide_fmu.features.sets import decode_features, encode_features
from slide_fmu.network.state_space.cell import (
    GATED,
    MIXED_UNITS,
    MOST_SUBSTEPS,
    Cell,
    Roles,
    cell_shapes,
)
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.network.state_space.polynomial import CellPolynomial

NUMBERS = {"tanh": 3, "cubic": 5, GATED: 6, MIXED_UNITS: 7}
"""The number of each kind of hidden units in files, as in ``SlideUnits`` of the C runtime
(``kernel/kernel.h``): a new kind takes one that no kind ever had."""

HIDDEN_UNITS = {number: name for name, number in NUMBERS.items()}
"""The kind of hidden units of each number in files."""

SUBSTEP = 256
"""Added to the number of the hidden units' kind for each sub-step after the first."""

MOST_DEGREE = 16
"""Largest degree of a parameter in a file; protects against damaged files."""


def encode_state_space(network: StateSpace) -> bytes:
    """Write the bytes of a network that follow its kind."""
    cell, roles = _written(network), network.roles
    head = encode_features(network.features)
    head += struct.pack(
        "<IIIII", network.n_samples, network.n_out, *cell.e.shape, network.n_values
    )
    head += struct.pack("<II", _kind_of(cell), network.turned)
    head += b"".join(indices_bytes(getattr(roles, field.name)) for field in fields(roles))
    return head + b"".join(array.astype("<f4").tobytes() for array in cell.arrays().values())


def decode_state_space(section: Reader, n_inputs: int) -> StateSpace:
    """Read the bytes that follow the kind of a network.

    Raises:
        ValueError: the bytes are not a state-space network with ``n_inputs`` inputs.
    """
    features = decode_features(section, n_inputs)
    n_samples, n_out, n, units, values = (section.u32() for _ in range(5))
    kind, turned = section.u32(), section.u32()
    number, substeps = kind % SUBSTEP, kind // SUBSTEP + 1
    if number not in HIDDEN_UNITS:
        raise ValueError(f"units {number} of a cell; expected one of {list(HIDDEN_UNITS)}")
    if substeps > MOST_SUBSTEPS:
        raise ValueError(f"{substeps} sub-steps of a cell; expected 1 to {MOST_SUBSTEPS}")
    roles = Roles(*(section.indices() for _ in fields(Roles)))
    shapes = cell_shapes(roles, HIDDEN_UNITS[number], n, units, values * (1 + len(roles.readout)))
    arrays = {name: section.f32(*shape) for name, shape in shapes.items()}
    cell = Cell(**arrays, activation=HIDDEN_UNITS[number], substeps=substeps)
    return StateSpace(cell, n_samples, n_out, features, roles, turned)


def _kind_of(cell: Cell) -> int:
    """Return the number that encodes the kind of the hidden units and the number of sub-steps."""
    return NUMBERS[cell.activation] + SUBSTEP * (cell.substeps - 1)


def _written(network: StateSpace) -> Cell:
    """Return the cell whose weights are written: for a polynomial, its constant term."""
    return network.cell if network.polynomial is None else network.polynomial.terms[0]


def encode_terms(polynomial: CellPolynomial) -> bytes:
    """Write all terms of a polynomial except the constant one, which the network's bytes hold."""
    degrees = polynomial.basis.degrees[1:]
    head = struct.pack("<I", len(degrees)) + np.array(degrees, "<u4").tobytes()
    cells = polynomial.terms[1:]
    weights = (part for cell in cells for part in cell.arrays().values())
    return head + b"".join(part.astype("<f4").tobytes() for part in weights)


def decode_terms(
    section: Reader, network: StateSpace, parameters: tuple[Parameter, ...]
) -> StateSpace:
    """Read the bytes of ``encode_terms``; the network is the constant term, and gets the others.

    Raises:
        ValueError: the bytes are not terms of these parameters.
    """
    count = section.u32()
    if not 1 <= count < MOST_TERMS:
        raise ValueError(f"{count} terms of parameters; expected 1 to {MOST_TERMS - 1}")
    degrees = np.frombuffer(section.take(4 * count * len(parameters)), "<u4")
    if degrees.max() > MOST_DEGREE:
        raise ValueError(f"degree {degrees.max()} of a parameter; expected at most {MOST_DEGREE}")
    rows = degrees.reshape(count, len(parameters)).tolist()
    constant = (0,) * len(parameters)
    basis = ParameterBasis(parameters, (constant, *(tuple(row) for row in rows)))
    first = network.cell.arrays()
    terms = []
    for _ in range(count):
        parts = {name: section.f32(*part.shape) for name, part in first.items()}
        terms.append(network.cell.with_arrays(parts))
    weights = CellPolynomial(basis, (network.cell, *terms))
    sizes = network.n_samples, network.n_out
    return StateSpace(weights, *sizes, network.features, network.roles, network.turned)
