"""Numbers beside an axis fit there, however small or large they are."""

from __future__ import annotations

import json
import subprocess

import pytest

from slide_fmu.core.web.packing import MODULES
from tests.node import node

FITS = 7
"""So many full characters have room; a raised one, a dot or a decimal point takes half of it."""
NARROW = "⁰¹²³⁴⁵⁶⁷⁸⁹⁻·."


def ticks(low: float, high: float) -> list[str]:
    """Texts of the ticks between two values."""
    return answer(
        "axes.js", "linearTicks", f"linearTicks([{low}, {high}], 5).map(({{ text }}) => text)"
    )


def answer(module: str, name: str, call: str) -> list[str]:
    """What an expression gives that calls a function of a module."""
    script = (
        f"import {{ {name} }} from {json.dumps((MODULES / module).as_uri())};"
        f"console.log(JSON.stringify({call}));"
    )
    done = subprocess.run(
        [node(), "--input-type=module", "-e", script], capture_output=True, text=True, check=True
    )
    found: list[str] = json.loads(done.stdout)
    return found


@pytest.mark.parametrize(
    ("ends", "texts"),
    [
        ((0.0, 2e-5), ["0", "0.5·10⁻⁵", "1.0·10⁻⁵", "1.5·10⁻⁵", "2.0·10⁻⁵"]),
        (
            (-1e-5, 1e-5),
            ["\N{MINUS SIGN}1.0·10⁻⁵", "\N{MINUS SIGN}0.5·10⁻⁵", "0", "0.5·10⁻⁵", "1.0·10⁻⁵"],
        ),
        ((0.0, 5e6), ["0", "1·10⁶", "2·10⁶", "3·10⁶", "4·10⁶", "5·10⁶"]),
        ((-1500.0, 1500.0), ["\N{MINUS SIGN}1000", "0", "1000"]),
        ((10.0, 10.002), ["10.0000", "10.0005", "10.0010", "10.0015", "10.0020"]),
    ],
)
def test_labels_of_an_axis_fit_beside_it(ends: tuple[float, float], texts: list[str]) -> None:
    found = ticks(*ends)
    assert found == texts
    assert max(sum(0.5 if c in NARROW else 1.0 for c in text) for text in found) <= FITS


def test_places_of_a_logarithmic_axis_have_prefixes_where_the_unit_may() -> None:
    call = "[1e-3, 1e-5, 2e-7, 1, 5e4].map((v) => placeText(v, 'm'))"
    assert answer("units.js", "placeText", call) == ["1 mm", "10 µm", "200 nm", "1 m", "50 km"]
    units = "['1', '%', 'N.m', 'mm'].map((unit) => placeText(1e-5, unit))"
    assert answer("units.js", "placeText", units) == [None] * 4
