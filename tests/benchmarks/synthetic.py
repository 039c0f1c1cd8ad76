"""Networks with random weights are timed where no FMU has the size that is asked for."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from slide_fmu.core.scaling import Affine
from slide_fmu.core.signals import Signal
from slide_fmu.core.window import Window
from slide_fmu.features.differences import Differences
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.network.feed_forward.network import FeedForward, Layer
from slide_fmu.surrogate.surrogate import Surrogate


def synthetic_robot() -> Surrogate:
    """Make a surrogate of a robot with random weights.

    It has in one network 720-374-374-374-180, ELU, as many weights (616 thousand) as three
    networks 720-180-180-180-60, one for each output as for the paper's robot: six inputs, three
    outputs, a window of 120 samples and a block of 60.
    """
    rng, sizes = np.random.default_rng(0), (720, 374, 374, 374, 180)
    layers = tuple(
        Layer(
            rng.normal(0, columns**-0.5, (rows, columns)).astype(np.float32),
            rng.normal(0, 0.1, rows).astype(np.float32),
            "identity" if rows == sizes[-1] else "elu",
        )
        for columns, rows in pairwise(sizes)
    )
    inputs = tuple(Signal(f"u{i}", "rad", -1.0, 1.0, hold="first_order") for i in range(6))
    outputs = tuple(Signal(f"y{i}", "m", -1.0, 1.0) for i in range(3))
    network = FeedForward(layers, 120, FeatureMap(Differences(6)))
    scaling_in, scaling_out = (Affine.of_channels([0.0] * n, [1.0] * n) for n in (6, 3))
    window = Window(0.005, 120, 60)
    scalings = scaling_in, scaling_out
    return Surrogate("synthetic_robot", window, inputs, outputs, *scalings, network)
