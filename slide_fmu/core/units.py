"""Units as FMI 2.0 declares them (section 2.2.2 of the standard)."""

from __future__ import annotations

BASE_UNITS: dict[str, dict[str, str]] = {
    "1": {},
    "m": {"m": "1"},
    "mm": {"m": "1", "factor": "0.001"},
    "s": {"s": "1"},
    "kg": {"kg": "1"},
    "rad": {"rad": "1"},
    "deg": {"rad": "1", "factor": "0.017453292519943295"},
    "N": {"kg": "1", "m": "1", "s": "-2"},
    "kN": {"kg": "1", "m": "1", "s": "-2", "factor": "1000"},
    "N.m": {"kg": "1", "m": "2", "s": "-2"},
    "m/s": {"m": "1", "s": "-1"},
    "rad/s": {"rad": "1", "s": "-1"},
    "m/s2": {"m": "1", "s": "-2"},
    "rad/s2": {"rad": "1", "s": "-2"},
    "Pa": {"kg": "1", "m": "-1", "s": "-2"},
}
"""SI exponents and factor of common units; others are declared by name alone."""
