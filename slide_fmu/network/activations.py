"""Activations of networks are defined by name, value and slope, once for numpy and torch.

The functions take the array and its namespace (``numpy`` or ``torch``). They use only functions
that both have under the same name and with the same positional arguments. Only numpy is imported
here.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

Array = Any
"""An array of numpy or a tensor of torch; results have the data type of the arguments."""
Namespace = Any
"""The module whose functions take the arrays: ``numpy`` or ``torch``."""

CLIPPED = 8.0
"""Mixed hidden units cube their arguments between plus and minus this limit, and so stay bounded
like tanh units. In training the arguments are about 1. The C runtime has the limit in
``kernel/cell_equation.h``."""

_ROOT, _CUBIC = math.sqrt(2 / math.pi), 0.044715


@dataclass(frozen=True)
class Activation:
    """An Activation works element by element, on arrays of any shape.

    Attributes:
        value: a(z), a function of the arguments z and their namespace.
        slope: da/dz, a function of the arguments z, the value a(z), and their namespace.
    """

    value: Callable[[Array, Namespace], Array]
    slope: Callable[[Array, Array, Namespace], Array]


def _bend(z: Array, xp: Namespace) -> Array:
    """Return the hyperbolic tangent inside ``gelu``."""
    return xp.tanh(_ROOT * (z + _CUBIC * (z * z * z)))


def _gelu_slope(z: Array, _value: Array, xp: Namespace) -> Array:
    bend = _bend(z, xp)
    return 0.5 * (1 + bend) + 0.5 * z * (1 - bend * bend) * _ROOT * (1 + 3 * _CUBIC * z * z)


def _is_cubic(z: Array, xp: Namespace) -> Array:
    """Return which mixed hidden units are cubic: every second one, from the first on."""
    return xp.cumsum(xp.ones_like(z.real), -1) % 2 == 1


def _mixed(z: Array, xp: Namespace) -> Array:
    clipped = xp.clip(z, -CLIPPED, CLIPPED)
    return xp.where(_is_cubic(z, xp), clipped * clipped * clipped, xp.tanh(z))


def _mixed_slope(z: Array, value: Array, xp: Namespace) -> Array:
    cubic_slope = xp.where(abs(z) <= CLIPPED, 3 * z * z, 0.0)
    return xp.where(_is_cubic(z, xp), cubic_slope, 1 - value * value)


ACTIVATIONS: dict[str, Activation] = {
    "identity": Activation(lambda z, _xp: z, lambda z, _value, xp: xp.ones_like(z)),
    "relu": Activation(
        lambda z, xp: xp.where(z > 0, z, 0.0),
        lambda z, _value, xp: xp.where(z > 0, xp.ones_like(z), 0.0),
    ),
    "elu": Activation(
        lambda z, xp: xp.where(z > 0, z, xp.expm1(xp.clip(z, None, 0.0))),
        lambda z, value, xp: xp.where(z > 0, 1.0, value + 1),
    ),
    "tanh": Activation(lambda z, xp: xp.tanh(z), lambda _z, value, _xp: 1 - value * value),
    "gelu": Activation(lambda z, xp: 0.5 * z * (1 + _bend(z, xp)), _gelu_slope),
    "cubic": Activation(lambda z, _xp: z * z * z, lambda z, _value, _xp: 3 * z * z),
}
"""The activations by name; their order is their number in the payload.

``elu`` is that of Clevert et al. (2016) with alpha = 1; ``gelu`` is the form with the hyperbolic
tangent (Hendrycks and Gimpel, 2016).
"""

MIXED = Activation(_mixed, _mixed_slope)
"""The activation of mixed hidden units along the last axis: clipped cube and tanh alternate."""
