"""The network families, each registered in one row.

A family joins with a package beside ``feed_forward`` and ``state_space`` (its final class of
``Network``, its byte layout, its gradient) and one row of ``FAMILIES``. Its fit joins in
``slide_fmu.learn.family``, its recipe's tables in ``slide_fmu.recipe.learning``, its C in
``slide_fmu/fmu/runtime``.
"""

from __future__ import annotations

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
    """A Family is what the package has to know of a network family.

    Attributes:
        name: for people.
        kind: number in surrogate files.
        network: the final class.
        encode: the bytes of a network, which begin with the kind.
        decode: the reader of what follows the kind: of the bytes and the number of input channels.
        pull_back: reverse mode of ``Network.block`` after its features. It takes the network, the
            features of input windows in float64, shape (B, n_in, n_features), and n_out; it gives
            a function from weights of the values, shape (B, n_out, n_outputs), to the gradient of
            their weighted sum with respect to the features.
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
        TypeError: it belongs to none that is registered.
    """
    for family in FAMILIES:
        if type(network) is family.network:
            return family
    names = [family.network.__name__ for family in FAMILIES]
    raise TypeError(f"network of type {type(network).__name__}; expected one of {names}")
