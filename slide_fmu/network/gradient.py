"""How the values of networks move with their features: reverse mode, in float64."""

from __future__ import annotations

import numpy as np

from slide_fmu.features.base import PullBack
from slide_fmu.network.base import Float32Array, Network
from slide_fmu.network.families import family_of


def pull_back_block(network: Network, features: Float32Array, n_out: int) -> PullBack:
    """Reverse mode of ``Network.block`` after its features.

    Args:
        network: of any family.
        features: of input windows, shape (B, n_in, n_features).
        n_out: samples of an output window.

    Returns:
        A function from weights of the values, shape (B, n_out, n_outputs), to the gradient of
        their weighted sum with respect to the features, shape (B, n_in, n_features).

    Raises:
        TypeError: the network belongs to no registered family.
    """
    return family_of(network).pull_back(network, features.astype(np.float64), n_out)
