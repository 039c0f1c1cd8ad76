"""Units as FMI 2.0 declares them (section 2.2.2 of the standard)."""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pint

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
"""SI exponents and factor of common units; other units are declared by name only."""

# fmt: off
COMMON = frozenset((
    "1", "%", "nm", "um", "mm", "cm", "m", "km", "ms", "s", "min", "h", "g", "kg", "t", "mrad",
    "rad", "deg", "N", "kN", "MN", "Pa", "kPa", "MPa", "bar", "J", "kJ", "W", "kW", "V", "A",
    "Ohm", "K", "degC", "degF", "degRk", "Hz", "rpm", "rev", "var", "L",
))
# fmt: on
"""Symbols accepted without pint, and symbols of FMUs that pint does not know. Pint knows all
others, but its list of units is long and slow to read."""

PINT_BASES = {
    "kilogram": "kg",
    "meter": "m",
    "second": "s",
    "ampere": "A",
    "kelvin": "K",
    "mole": "mol",
    "candela": "cd",
    "radian": "rad",
}
"""Symbols of SI base units, by pint's names."""

NOT_MEANT = {"1", "%", "Hz", "var"}
"""Symbols that no definition by base units means: several quantities have such units."""

FACTOR = re.compile(r"([A-Za-z%_]+|1)\^?([-+]?\d+)?")
"""A symbol, and its exponent if there is one."""


EXAMPLES = "'m', 'rad', 'kN', 'N.m' or 'm/s2'"
"""Units that a message names where it does not know another one."""

PREFIXES = ("k", "M", "m", "kilo", "mega", "milli")
"""Prefixes that users write before the name of a unit in full, as in kNewton."""

SAME_FACTOR = 1e-4
"""FMUs round the factors of their units to this part."""

NO_UNIT = "1"
"""FMI's name for the unit of a dimensionless number."""


def behind(unit: str) -> str:
    """Return the text after a number: a blank and its unit, or nothing if it has none."""
    return "" if unit == NO_UNIT else f" {unit}"


def labelled(label: str, unit: str, between: str = " / ") -> str:
    """Return a label with its unit, such as ``force / N``; the label alone if there is no unit."""
    return label if unit in ("", NO_UNIT) else f"{label}{between}{unit}"


def ratio(unit: str, over: str) -> str:
    """Return the unit of a quotient, such as ``m/N``."""
    if over == NO_UNIT:
        return unit
    return f"{unit}/{over}" if "/" not in over else f"{unit}/({over})"


def are_other(first: str | None, second: str | None) -> bool:
    """Tell whether two units are known and differ."""
    return first != second and not {None, "", NO_UNIT} & {first, second}


def require_unit(name: str, unit: str) -> None:
    """Refuse a signal's unit that is not a product of known symbols, such as ``"N.m"``.

    Factors are joined by ``.``, ``*`` or ``/``, exponents follow as ``s2``, ``s-2`` or ``s^2``.

    Raises:
        ValueError: a symbol is unknown; the message suggests others.
    """
    for factor in re.split(r"[.*/]", re.sub(r"[()\s]", "", unit)):
        match = FACTOR.fullmatch(factor)
        if match is None or not _is_known(match[1]):
            refused = {repr(NO_UNIT), repr(factor)}
            meant = [each for each in _nearest(factor) if each not in refused]
            known = f"{' or '.join(meant)}, or " if meant else ""
            raise ValueError(
                f"signal {name!r}: unit {unit!r}; expected known units, such as {EXAMPLES}, but "
                f"{factor!r} is none: write {known}'1' for a number without unit"
            )


def is_known_unit(unit: str) -> bool:
    """Tell whether a unit is a product of known symbols, as of ``require_unit``."""
    try:
        require_unit("", unit)
    except ValueError:
        return False
    return True


def unit_of_bases(
    exponents: Mapping[str, int], factor: float = 1.0, offset: float = 0.0
) -> str | None:
    """Return a known unit by its definition in FMI: exponents of SI base units by their symbols.

    A value in the unit is ``factor`` times it plus ``offset`` in base units. It is None if no
    known unit is defined so.
    """
    powers = {base: power for base, power in exponents.items() if power}
    for name, attributes in BASE_UNITS.items():
        bases = {base: int(power) for base, power in attributes.items() if base != "factor"}
        same = math.isclose(factor, float(attributes.get("factor", 1.0)), rel_tol=SAME_FACTOR)
        if name != NO_UNIT and bases == powers and same and not offset:
            return name
    for name in sorted(COMMON - NOT_MEANT):
        bases, own_factor, own_offset = _definition(name)
        same = math.isclose(factor, own_factor, rel_tol=SAME_FACTOR)
        if bases == powers and same and math.isclose(offset, own_offset, abs_tol=SAME_FACTOR):
            return name
    if factor != 1.0 or offset or not powers:
        return None
    over = [f"{base}{power if power > 1 else ''}" for base, power in powers.items() if power > 0]
    under = [
        f"{base}{-power if power < -1 else ''}" for base, power in powers.items() if power < 0
    ]
    return "/".join([".".join(over) or NO_UNIT, *under])


def _is_known(symbol: str) -> bool:
    """Return whether a text is the symbol of a unit; a name in full is not."""
    if symbol in COMMON:
        return True
    short = None if symbol.lower() in NAMES else _symbol_of(symbol)
    if short is None or (symbol.endswith("s") and _symbol_of(symbol[:-1]) == short):
        return False  # pint reads the plural of a symbol too, as in lbs
    return len(symbol) <= len(short) + 1  # as um for µm, or l for L


def _symbol_of(text: str) -> str | None:
    """Return the symbol of a unit given by symbol or name; None if pint does not know it."""
    try:
        return f"{_registry().Unit(text):~}"
    except Exception:  # pint's parser fails in many ways on texts that are no units
        return None


@cache
def _definition(symbol: str) -> tuple[dict[str, int], float, float]:
    """Return exponents, factor and offset of a common symbol; none of one that pint has not."""
    try:
        one, zero = (_registry().Quantity(value, symbol).to_base_units() for value in (1.0, 0.0))
        bases = {PINT_BASES[name]: int(f"{power:g}") for name, power in one.unit_items()}
    except Exception:  # pint raises errors of many types
        return {}, math.nan, math.nan
    return bases, float(one.magnitude - zero.magnitude), float(zero.magnitude)


@cache
def _registry() -> pint.UnitRegistry[float]:
    """Return all units that pint knows."""
    import pint  # slow to import, and rarely needed

    return pint.UnitRegistry()


def _nearest(symbol: str) -> list[str]:
    """Return known units whose symbol or name is similar to a text."""
    word = symbol.lower()
    named = [
        unit for name, unit in NAMES.items() if (name and word.startswith(name)) or name == word
    ]
    named += [
        prefix[0] + unit
        for prefix in PREFIXES
        for name, unit in NAMES.items()
        if len(name) > len("sec") and symbol.startswith(prefix + name.capitalize())
    ]
    short = _symbol_of(symbol)
    meant = [short] if short is not None and short.isascii() and short else []
    if not (named or meant):
        known = [*BASE_UNITS, *sorted(COMMON)]
        meant = difflib.get_close_matches(symbol, known, n=3, cutoff=0.5)
    return [repr(unit) for unit in dict.fromkeys([*named, *meant])][:3]


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
    "lbs": "lbf",
    "-": "1",
    "": "1",
}
"""Symbols for names that users write in full, in lower case."""
