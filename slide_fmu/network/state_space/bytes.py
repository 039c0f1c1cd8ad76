"""The bytes of a state-space network; the contract is in ``slide_fmu/network/bytes.py``.

The second reader is the C runtime, ``slide_fmu/fmu/runtime/network/cell_reading.c``.
"""

from __future__ import annotations

import struct
from dataclasses import fields

from slide_fmu.core.byte_reader import Reader, indices_bytes
from slide_fmu.features.sets import decode_features, encode_features
from slide_fmu.network.activations import ACTIVATIONS
from slide_fmu.network.state_space.cell import (
    CELL_ACTIVATIONS,
    GATED,
    MIXED_UNITS,
    Cell,
    Roles,
    cell_shapes,
)
from slide_fmu.network.state_space.network import StateSpace

UNITS = (*ACTIVATIONS, GATED, MIXED_UNITS)
"""Units of cells; their order is their number."""


def encode_state_space(network: StateSpace) -> bytes:
    """Write the bytes of a network that follow its kind."""
    cell, roles = network.cell, network.roles
    head = encode_features(network.features)
    head += struct.pack(
        "<IIIII", network.n_samples, network.n_out, *cell.e.shape, network.n_values
    )
    head += struct.pack("<II", UNITS.index(cell.activation), network.turned)
    head += b"".join(indices_bytes(getattr(roles, field.name)) for field in fields(roles))
    return head + b"".join(array.astype("<f4").tobytes() for array in cell.arrays().values())


def decode_state_space(section: Reader, n_inputs: int) -> StateSpace:
    """Read what follows the kind of a network.

    Raises:
        ValueError: the bytes are no state-space network on so many inputs.
    """
    features = decode_features(section, n_inputs)
    n_samples, n_out, n, units, values = (section.u32() for _ in range(5))
    number, turned = section.u32(), section.u32()
    if number >= len(UNITS) or UNITS[number] not in CELL_ACTIVATIONS:
        expected = [UNITS.index(name) for name in CELL_ACTIVATIONS]
        raise ValueError(f"units {number} of a cell; expected one of {expected}")
    roles = Roles(*(section.indices() for _ in fields(Roles)))
    shapes = cell_shapes(roles, UNITS[number], n, units, values * (1 + len(roles.readout)))
    arrays = {name: section.f32(*shape) for name, shape in shapes.items()}
    cell = Cell(**arrays, activation=UNITS[number])
    return StateSpace(cell, n_samples, n_out, features, roles, turned)
