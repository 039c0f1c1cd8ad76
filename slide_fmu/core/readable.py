"""Numbers and times become texts with three digits and a unit, for tables that people read.

Units of ``PREFIXED`` have a prefix, so that the number lies between 1 and 1000. All others have
none: numbers without a unit, per cent, degrees, units with a prefix of their own as mm and kg,
and compound ones such as N.m and m/s. Their numbers are plain decimals.
"""

from __future__ import annotations

import math

from slide_fmu.core.units import behind

UNITS = ((1e-6, "µs"), (1e-3, "ms"), (1.0, "s"))
"""Units of short times in s, the smallest first."""


PREFIXES = ((1e-9, "n"), (1e-6, "µ"), (1e-3, "m"), (1.0, ""), (1e3, "k"), (1e6, "M"))
"""Factors and prefixes of units, the smallest first."""

PREFIXED = frozenset(("m", "N", "s", "Pa", "V", "A", "W", "J", "Hz", "rad"))
"""Units that may have a prefix, as on pages (``core/web/modules/units.js``)."""
ONLY_SMALLER = frozenset(("s", "rad"))
"""Of these, units that have no prefix for thousands."""

LEAST_DECIMAL, FIRST_POWER = 1e-6, 1e15
"""Numbers between these are plain decimals; others have a power of ten, such as 1.9·10⁻⁷."""
GROUPED = 1e4
"""Whole numbers are written in groups of thousands from here on."""
RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def duration(seconds: float) -> str:
    """Write a time with three digits, in the largest unit in which it is at least 1."""
    factor, unit = next((u for u in reversed(UNITS) if seconds >= 0.9995 * u[0]), UNITS[0])
    return f"{number(seconds / factor)} {unit}"


def quantity(value: float, unit: str, digits: int = 3) -> str:
    """Write a value and its unit, with a prefix where the unit may have one."""
    size = abs(float(f"{value:.{digits}g}"))
    largest = 1.0 if unit in ONLY_SMALLER else math.inf
    fitting = [p for p in PREFIXES if p[0] <= min(size * (1 + 1e-9), largest)]
    if unit not in PREFIXED or not 0 < size < math.inf:
        return f"{decimal(value, digits)}{behind(unit)}"
    factor, prefix = fitting[-1] if fitting else PREFIXES[0]
    return f"{decimal(value / factor, digits)} {prefix}{unit}"


def decimal(value: float, digits: int = 3) -> str:
    """Write a number as a plain decimal, and without zeros at its end.

    Only numbers below ``LEAST_DECIMAL`` and from ``FIRST_POWER`` on have a power of ten.
    """
    rounded = float(f"{value:.{digits}g}")
    size = abs(rounded)
    if size == 0 or not math.isfinite(size):
        return f"{abs(rounded) if size == 0 else rounded:g}"
    if not LEAST_DECIMAL <= size < FIRST_POWER:
        part, power = f"{value:.{digits - 1}e}".split("e")
        return f"{_short(part)}·10{str(int(power)).translate(RAISED)}"
    text = _short(f"{rounded:.{max(0, digits - 1 - math.floor(math.log10(size)))}f}")
    return text if "." in text else _grouped(int(text))


def _grouped(count: int) -> str:
    """Return a whole number, in groups of thousands if it is large."""
    return f"{count:,}".replace(",", " ") if abs(count) >= GROUPED else str(count)


def _short(text: str) -> str:
    """Return a decimal without zeros at its end."""
    return text.rstrip("0").rstrip(".") if "." in text else text


def number(value: float) -> str:
    """Write a number with three digits, without an exponent, in groups of thousands.

    Whole numbers below a million keep all their digits.
    """
    rounded = float(f"{value:.3g}")
    if rounded == 0:
        return "0"
    if rounded >= 100 or value == int(value):
        count = int(value) if value == int(value) < 1e6 else round(rounded)
        return _grouped(count)
    return f"{rounded:.{2 - math.floor(math.log10(rounded))}f}"


def ratio_text(value: float) -> str:
    """Write a ratio with three digits; large ones have no exponent: 1870 or 37 600."""
    return decimal(value)
