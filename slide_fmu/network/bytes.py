"""Network families are registered here, one row each, with the byte contract of their networks.

To add a family: write a package next to ``feed_forward`` and ``state_space`` (its final class of
``Network``, its byte layout, its gradient) and one row of ``FAMILIES``. Add its fit in
``slide_fmu.fitting.network``, its recipe's tables in ``slide_fmu.recipe.learning``, its C in
``slide_fmu/fmu/runtime``. The second reader of the bytes is the C runtime,
``slide_fmu/fmu/runtime/network/network.c`` with the readers in its table; both reject the same
bytes. All numbers are little-endian.

    network  := u32 kind (1)  features  u32 n_samples  u32 n_layers  ages  layer*
                u32 has_skip  [f32 skip[n_values][n_first]]
              | u32 kind (2)  features  u32 n_samples  u32 n_out  u32 n_states  u32 n_units
                u32 n_values  u32 units  u32 turned  role[6]
                f32 A[n_states][n_states]  f32 B[n_states][n_drive]  f32 E[n_states][n_units]
                f32 W[n_units][n_arguments]  f32 V[n_units][n_products]
                f32 C[n_rows][n_states]  f32 D[n_rows][n_static]  f32 d0[n_rows]
    layer    := u32 n_in  u32 n_out  u32 activation  f32 weights[n_out][n_in]  f32 bias[n_out]
    ages     := u32 count  u32 age[count]
    role     := u32 count  u32 feature[count]     drive, static, gated, schedule, readout, turn
    features                                          see slide_fmu/features/sets.py

Kind 1, feed-forward: the first layer takes the features of some of the newest n_samples inputs,
with all features of a sample together. The ages say which, 0 being the newest; they fall from
n_samples - 1. If the count of the ages is 0, all n_samples are taken, oldest first.
Kind 3 was kind 1 with weights of float16; it is no longer written, and refused.
Kind 2, state space (``state_space/equations.py``): n_states, n_values >= 1. The field ``units`` is
the kind of the hidden units: 3 tanh, 5 cubic, 6 gated, 7 mixed (cubic and tanh alternate,
cubic first), plus 256 for every sub-step of a sample beyond the first; there are at most 16.
n_arguments = n_states + n_drive + 1, with gated units n_schedule + 1; n_products = n_states +
n_gated with gated units; otherwise V is absent and n_gated = n_schedule = 0; n_rows = n_values (1
+ n_readout). n_turn is 2 if turned > 0, else 0; turned needs gated units, and 2 turned <=
n_states. The features of a role are indices into the chosen features.
If a cell follows physical parameters, its weights here are the constant term; the other terms
stand in a section of their own (slide_fmu/surrogate/payload.py).
Activations: 0 identity, 1 relu, 2 elu, 3 tanh, 4 gelu (the form with tanh), 5 cubic.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from slide_fmu.core.byte_reader import Reader
from slide_fmu.core.signals import FloatArray
from slide_fmu.features.base import PullBack
from slide_fmu.network.base import Network
from slide_fmu.network.feed_forward.bytes import decode_feed_forward, encode_feed_forward
from slide_fmu.network.feed_forward.gradient import pull_back_layers
from slide_fmu.network.feed_forward.network import FeedForward
from slide_fmu.network.state_space.bytes import decode_state_space, encode_state_space
from slide_fmu.network.state_space.gradient import pull_back_cells
from slide_fmu.network.state_space.network import StateSpace


@dataclass(frozen=True)
class Family:
    """A Family is one row of the registry of network families.

    Attributes:
        name: for people.
        kind: number in surrogate files.
        network: the final class.
        encode: writes the bytes of a network that follow its kind.
        decode: reads them, from the bytes and the number of input channels.
        pull_back: reverse mode of ``Network.block`` after its features. It takes the network, the
            features of input windows in float64, shape (B, n_in, n_features), and n_out. It
            returns a function from weights of the values, shape (B, n_out, n_outputs), to the
            gradient of their weighted sum with respect to the features.
    """

    name: str
    kind: int
    network: type[Network]
    encode: Callable[[Any], bytes]
    decode: Callable[[Reader, int], Network]
    pull_back: Callable[[Any, FloatArray, int], PullBack]


FAMILIES = (
    Family(
        "feed-forward", 1, FeedForward, encode_feed_forward, decode_feed_forward, pull_back_layers
    ),
    Family("state space", 2, StateSpace, encode_state_space, decode_state_space, pull_back_cells),
)
"""All families."""


def family_of(network: Network) -> Family:
    """Find the family that a network belongs to.

    Raises:
        TypeError: its family is not registered.
    """
    for family in FAMILIES:
        if type(network) is family.network:
            return family
    names = [family.network.__name__ for family in FAMILIES]
    raise TypeError(f"network of type {type(network).__name__}; expected one of {names}")


def encode_network(network: Network) -> bytes:
    """Write the bytes of a network."""
    family = family_of(network)
    return struct.pack("<I", family.kind) + family.encode(network)


def decode_network(section: Reader, n_inputs: int) -> Network:
    """Read a network with ``n_inputs`` inputs from bytes that start with it.

    Raises:
        ValueError: the bytes are not a network with ``n_inputs`` inputs.
    """
    kind = section.u32()
    for family in FAMILIES:
        if kind == family.kind:
            return family.decode(section, n_inputs)
    expected = " or ".join(f"{family.kind} ({family.name})" for family in FAMILIES)
    raise ValueError(f"network of kind {kind}; expected {expected}: export it from its recipe")
