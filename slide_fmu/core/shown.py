"""Values that messages show are written as Python does, but numbers of numpy as plain ones."""

from __future__ import annotations

import math
import sys
from typing import Any


def shown(value: object, longest: float = math.inf) -> str:
    """Write a value: ``[0.5]`` also where it is ``[np.float64(0.5)]``.

    The text is cut after a number of characters.
    """
    text = repr(_plain(value))
    return text if len(text) <= longest else f"{text[: int(longest) - 3]}..."


def _plain(value: Any) -> Any:
    """Return a value with plain numbers in place of numpy's, in lists and tables, too."""
    numpy: Any = sys.modules.get("numpy")  # whoever has a value of it has loaded it
    if numpy is not None and isinstance(value, numpy.generic):
        return value.item()
    if type(value) in (list, tuple, set, frozenset):
        return type(value)(map(_plain, value))
    if type(value) is dict:
        return {_plain(key): _plain(one) for key, one in value.items()}
    return value
