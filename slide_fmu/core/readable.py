"""Numbers and times become texts with three digits and a unit, for tables that people read."""

from __future__ import annotations

import math

from slide_fmu.core.units import behind

UNITS = ((1e-6, "µs"), (1e-3, "ms"), (1.0, "s"))
"""Units of short times in s, the smallest first."""


PREFIXES = ((1e-9, "n"), (1e-6, "µ"), (1e-3, "m"), (1.0, ""), (1e3, "k"), (1e6, "M"))
"""Factors and prefixes of units, the smallest first."""

PREFIXED = frozenset(("m", "N", "s", "Pa", "V", "A", "W", "J", "Hz", "rad"))
"""Units that may have a prefix."""


def duration(seconds: float) -> str:
    """Write a time with three digits, in the largest unit in which it is at least 1."""
    factor, unit = next((u for u in reversed(UNITS) if seconds >= 0.9995 * u[0]), UNITS[0])
    return f"{number(seconds / factor)} {unit}"


def quantity(value: float, unit: str) -> str:
    """Write a value with three digits and its unit, with a prefix where the unit may have one."""
    fitting = [(f, prefix) for f, prefix in PREFIXES if abs(value) >= 0.9995 * f]
    if unit not in PREFIXED or not fitting:
        return f"{value:.3g}{behind(unit)}"
    factor, prefix = fitting[-1]
    return f"{value / factor:.3g} {prefix}{unit}"


def number(value: float) -> str:
    """Write a number with three digits, without an exponent, in groups of thousands.

    Whole numbers below a million keep all their digits.
    """
    rounded = float(f"{value:.3g}")
    if rounded == 0:
        return "0"
    if rounded >= 100 or value == int(value):
        count = int(value) if value == int(value) < 1e6 else round(rounded)
        return f"{count:,}".replace(",", " ")
    return f"{rounded:.{2 - math.floor(math.log10(rounded))}f}"


def ratio_text(value: float) -> str:
    """Write a ratio with three digits; large ones have no exponent: 1870 or 37 600."""
    rounded = float(f"{value:.3g}")
    if not 1e3 <= rounded < 1e15:
        return f"{rounded:.3g}"
    return f"{rounded:.0f}" if rounded < 1e4 else number(rounded)
