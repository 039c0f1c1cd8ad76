"""Feature sets are registered here, with the bytes of the features that a network takes.

To add a set: write its module (a final class of ``Features``) and add it to ``SETS``; in the C
runtime add a file that reads and forms the same features, and its lines in ``feature_set.h``
and ``.c``.

    features := u32 set  parameters  u32 count  u32 signal[count]  f64 offset[count]
                f64 scale[count]                  feature = (signal - offset) / scale
    set 1, differences  := u32 order                             order <= 2
    set 4, chain motion := f64 step  f64 law[4]  f64 middle[n]  f64 half_range[n]
                           f64 prismatic[n]  f64 theta[n]  f64 alpha[n]  f64 steps[n][3]
                           f64 masses[n]  f64 centres[n][3]  f64 inertias[n][3][3]
                           f64 gravity[3]  f64 tool[3]
                           n = n_inputs; step > 0; prismatic 0 or 1; all finite
    set 5, director     := u32 kind[n]  f64 middle[n]  f64 half_range[n]        all finite
                           kind 0 other, 1 angle, 2 cosine with 3 sine behind it; an angle is
                           middle + half_range * input in rad

Sets 2 and 3 were former layouts of sets 5 and 4, and are refused; 6 is the next number.

The law has the weights of the newest and the oldest set point in the position, and of the newest
in rate and acceleration; the others follow (``drive_law.py``).

The signals of a set and their order are its ``blocks``. All numbers are little-endian.
"""

from __future__ import annotations

import struct

from slide_fmu.core.byte_reader import Reader, indices_bytes
from slide_fmu.core.scaling import Affine
from slide_fmu.features.base import FeatureOffer, Features
from slide_fmu.features.chain_motion import ChainMotion
from slide_fmu.features.differences import Differences
from slide_fmu.features.director import Director
from slide_fmu.features.feature_map import FeatureMap

SETS: tuple[type[Features], ...] = (Differences, Director, ChainMotion)
"""All sets."""

LINEAR_NAMES = tuple(name for kind in SETS if kind.linear for name in kind.NAMES)
"""Names of all features that change their sign with the inputs."""


def feature_set(names: tuple[str, ...], offered: FeatureOffer) -> Features:
    """Make the set that contains all these signals, at least one, for the inputs of a system.

    Raises:
        ValueError: names are unknown or from several sets, or the system lacks what the set needs.
    """
    for kind in SETS:
        if set(names) <= set(kind.NAMES):
            return kind.of_system(names, offered)
    lists = "; ".join(f"{', '.join(kind.NAMES)} ({kind.TITLE})" for kind in SETS)
    raise ValueError(f"features {list(names)}; expected names of one set: {lists}")


def encode_features(features: FeatureMap) -> bytes:
    """Write the bytes of the features that a network takes.

    Raises:
        TypeError: their set is not registered.
    """
    kind = features.features
    if type(kind) not in SETS:
        known = [known.__name__ for known in SETS]
        raise TypeError(f"features of type {type(kind).__name__}; expected one of {known}")
    head = struct.pack("<I", kind.NUMBER) + kind.parameters() + indices_bytes(features.chosen)
    parts = (features.scaling.offset, features.scaling.scale)
    return head + b"".join(part.astype("<f8").tobytes() for part in parts)


def decode_features(section: Reader, n_inputs: int) -> FeatureMap:
    """Read the features that a network takes.

    Raises:
        ValueError: the bytes are not features of ``n_inputs`` inputs.
    """
    number = section.u32()
    readers = {kind.NUMBER: kind.read for kind in SETS}
    if number not in readers:
        raise ValueError(f"features of set {number}; expected one of {sorted(readers)}")
    features = readers[number](section, n_inputs)
    chosen = section.indices()
    scaling = Affine(section.f64(len(chosen)), section.f64(len(chosen)))
    return FeatureMap(features, chosen, scaling)
