"""Units as FMI 2.0 declares them (section 2.2.2 of the standard)."""

from __future__ import annotations

import difflib
import re

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

PREFIXES = ("", "n", "u", "m", "c", "d", "da", "h", "k", "M", "G")
"""SI prefixes; every symbol of ``PREFIXED`` may have one."""
# fmt: off
PREFIXED = (
    "m", "g", "s", "A", "K", "mol", "cd", "rad", "sr", "Hz", "N", "Pa", "J", "W", "C", "V", "F",
    "Ohm", "S", "Wb", "T", "H", "lm", "lx", "bar", "l", "L", "eV", "Wh", "VA", "var",
)
PLAIN = (
    "1", "%", "deg", "rev", "rpm", "degC", "degF", "degRk", "min", "h", "d", "t", "ppm", "in",
    "ft", "mi", "lb", "lbf", "psi", "hp", "cal", "kcal", "atm", "mmHg", "dB",
)
# fmt: on
"""Symbols of units with and without prefixes: of the SI, and of those that FMUs have beside."""

FACTOR = re.compile(r"([A-Za-z%_]+|1)\^?([-+]?\d+)?")
"""A symbol, and its exponent if it has one."""


NO_UNIT = "1"
"""What FMI calls the unit of a number that has none."""


def behind(unit: str) -> str:
    """Return what stands behind a number: a blank and its unit, or nothing where it has none."""
    return "" if unit == NO_UNIT else f" {unit}"


def require_unit(name: str, unit: str) -> None:
    """Refuse the unit of a signal that is no product of known symbols, as ``"N.m"`` is.

    Factors are joined by ``.``, ``*`` or ``/``, exponents follow as ``s2``, ``s-2`` or ``s^2``.

    Raises:
        ValueError: a symbol is unknown; the message suggests others.
    """
    for factor in re.split(r"[.*/]", re.sub(r"[()\s]", "", unit)):
        match = FACTOR.fullmatch(factor)
        if match is None or not _is_known(match[1]):
            raise ValueError(
                f"signal {name!r}: unit {unit!r}; expected known units, but {factor!r} is none: "
                f"write {' or '.join(_nearest(factor))}, or '1' for a number without unit"
            )


def _is_known(symbol: str) -> bool:
    return symbol in PLAIN or any(
        symbol.startswith(prefix) and symbol[len(prefix) :] in PREFIXED for prefix in PREFIXES
    )


def _nearest(symbol: str) -> list[str]:
    """Return known units whose symbol or name is like a text."""
    word = symbol.lower()
    named = [
        unit for name, unit in NAMES.items() if (name and word.startswith(name)) or name == word
    ]
    known = [*BASE_UNITS, *PLAIN, *PREFIXED]
    near = difflib.get_close_matches(symbol, known, n=3, cutoff=0.5)
    return [repr(unit) for unit in dict.fromkeys([*named, *near])][:3] or [
        "a product such as 'N.m'"
    ]


NAMES = {
    "newton": "N",
    "nm": "N.m",
    "met": "m",
    "sec": "s",
    "degree": "deg",
    "celsius": "degC",
    "°c": "degC",
    "°": "deg",
    "radian": "rad",
    "kilog": "kg",
    "pascal": "Pa",
    "volt": "V",
    "watt": "W",
    "amp": "A",
    "kelvin": "K",
    "-": "1",
    "": "1",
}
"""What people write in place of symbols, in small letters."""
