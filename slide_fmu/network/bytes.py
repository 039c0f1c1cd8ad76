"""The byte contract of a network and its features inside a surrogate file (``payload.py``).

Each family writes and reads its own bytes (``feed_forward/bytes.py``, ``state_space/bytes.py``);
here is the choice of the family. The second reader is the C runtime,
``slide_fmu/fmu/runtime/bytes/network_view.c`` with the files it includes; both reject the same
bytes. All numbers are little-endian.

    network  := u32 kind (1)  features  u32 n_samples  u32 n_layers  ages  layer*
                u32 has_skip  [f32 skip[n_values][n_first]]
              | u32 kind (2)  features  u32 n_samples  u32 n_out  u32 n_states  u32 n_units
                u32 n_values  u32 units  u32 turned  role[6]
                f32 A[n_states][n_states]  f32 B[n_states][n_drive]  f32 E[n_states][n_units]
                f32 W[n_units][n_arguments]  f32 V[n_units][n_products]
                f32 C[n_rows][n_states]  f32 D[n_rows][n_static]  f32 d0[n_rows]
              | u32 kind (3)  as kind 1, weights and skip of f16
    layer    := u32 n_in  u32 n_out  u32 activation  f32 weights[n_out][n_in]  f32 bias[n_out]
    ages     := u32 count  u32 age[count]
    role     := u32 count  u32 feature[count]     drive, static, gated, schedule, readout, turn
    features                                          see slide_fmu/features/sets.py

Kind 1, feed-forward: the first layer takes the features of some of the newest n_samples inputs,
all of a sample together: those of the ages, 0 the newest, which fall from n_samples - 1; of all
n_samples, oldest first, where the count of the ages is 0.
Kind 3, the same with weights of IEEE 754 binary16: an odd number of them is followed by two bytes
of padding.
Kind 2, state space (``state_space/equations.py``): n_states, n_values >= 1; units 3 tanh, 5 cubic,
6 gated.
n_arguments = n_states + n_drive + 1, of gated units n_schedule + 1; n_products = n_states +
n_gated of gated units, else V is absent and n_gated = n_schedule = 0; n_rows = n_values (1 +
n_readout). n_turn is 2 where turned > 0, else 0; turned needs gated units, and 2 turned <=
n_states. The features of a role are indices into those chosen.
Activations: 0 identity, 1 relu, 2 elu, 3 tanh, 4 gelu (the form with tanh), 5 cubic.
"""

from __future__ import annotations

from slide_fmu.core.byte_reader import Reader
from slide_fmu.network.base import Network
from slide_fmu.network.families import FAMILIES, family_of


def encode_network(network: Network) -> bytes:
    """The bytes of a network.

    Raises:
        TypeError: the network belongs to no registered family.
    """
    return family_of(network).encode(network)


def decode_network(section: Reader, n_inputs: int) -> Network:
    """Read a network.

    Args:
        section: bytes that begin with those of a network.
        n_inputs: number of input channels.

    Raises:
        ValueError: the bytes are no network on so many inputs.
    """
    kind = section.u32()
    for family in FAMILIES:
        if kind in family.kinds:
            return family.kinds[kind](section, n_inputs)
    known = ", ".join(
        f"{number} ({family.name})" for family in FAMILIES for number in family.kinds
    )
    raise ValueError(f"network of kind {kind}; expected one of {known}")
