"""Physical parameters in a surrogate file have bytes in the section PARA and rows in META.

The contract is in ``payload.py``; the second reader is the C runtime,
``slide_fmu/fmu/runtime/network/parameters.c``.
"""

from __future__ import annotations

import json
import struct
from dataclasses import asdict

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.byte_reader import Reader
from slide_fmu.core.parameters import Parameter, Transform
from slide_fmu.network.base import Network
from slide_fmu.network.state_space.bytes import decode_terms, encode_terms
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.network.state_space.polynomial import CellPolynomial

TRANSFORMS: tuple[Transform, ...] = ("linear", "log", "reciprocal")
"""Transforms; their positions are the numbers in the file."""

PARAMETER_ROW = np.dtype(
    [("low", "<f8"), ("high", "<f8"), ("start", "<f8"), ("transform", "<u4"), ("zero", "<u4")]
)


def parameter_row(parameter: Parameter) -> dict[str, str | float | None]:
    """Return the row of a parameter in META."""
    row = asdict(parameter)
    del row["transform"]
    return row


def encode_parameters(polynomial: CellPolynomial) -> bytes:
    """Write the content of PARA."""
    parameters = polynomial.basis.parameters
    rows = [(p.low, p.high, p.start_value, TRANSFORMS.index(p.transform), 0) for p in parameters]
    head = struct.pack("<I", len(rows)) + np.array(rows, PARAMETER_ROW).tobytes()
    return head + encode_terms(polynomial)


def decode_parameters(section: Reader, network: Network, text: str) -> StateSpace:
    """Return the network, whose constant term was read already, with all terms; ``text`` is META.

    Raises:
        ValueError: section and META are not parameters of this network.
    """
    if not isinstance(network, StateSpace):
        kind = type(network).__name__
        raise ValueError(f"parameters of a {kind}; expected a StateSpace")
    rows = np.frombuffer(section.take(PARAMETER_ROW.itemsize * section.u32()), PARAMETER_ROW)
    if len(rows) == 0 or rows["transform"].max() >= len(TRANSFORMS):
        raise ValueError(
            f"{len(rows)} parameters with transforms {rows['transform'].tolist()}; expected at "
            f"least one, and transforms below {len(TRANSFORMS)}"
        )
    with_terms = decode_terms(section, network, _parameters(text, rows))
    section.done()
    return with_terms


def _parameters(text: str, rows: NDArray[np.void]) -> tuple[Parameter, ...]:
    """Return the parameters from META and from their rows."""
    try:
        described = json.loads(text)["parameters"]
        parameters = tuple(
            Parameter(**given, transform=TRANSFORMS[row["transform"]])
            for given, row in zip(described, rows, strict=True)
        )
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise ValueError(f"metadata of the parameters is damaged: {error!r}") from error
    numbers = [(p.low, p.high, p.start_value) for p in parameters]
    expected = [(low, high, start) for low, high, start, *_ in rows.tolist()]
    if numbers != expected:
        raise ValueError(
            f"by their metadata, parameters have low, high and start {numbers}; expected "
            f"{expected}"
        )
    return parameters
