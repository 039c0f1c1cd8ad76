"""Tables of a recipe with which an oscillator and its error bound are learnt in a second."""

from __future__ import annotations

from typing import Any

LEARNT_SOON: dict[str, Any] = {
    "network": {"order": 2, "hidden": 6},
    "training": {
        "starts": 1,
        "iterations": 10,
        "expert": {"start_iterations": 5, "kept": 1, "kept_iterations": 5},
    },
    "bound": {
        "expert": {
            "short_span": 0.05,
            "long_span": 0.25,
            "hidden": [8],
            "steps": 1000,
            "companion": {"hidden": 9, "iterations": 14},
        }
    },
}
