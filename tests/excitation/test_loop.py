"""The table of a loop names signals and partners, and says what its motions are."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from slide_fmu.core.signals import Signal
from slide_fmu.excitation.loop import LEAST_ALONE, LEAST_OUTER, LoopRecipe, Partner

BODY = (Signal("body", "m", -0.1, 0.1), Signal("road", "m", -0.1, 0.1))
FORCE = (Signal("force", "N", -1.0, 1.0),)
CAR: dict[str, Any] = {"output": "force", "input": "body", "weight": 0.3, "mass": (12.0, 400.0)}


def test_motions_are_described_with_their_partners() -> None:
    loop = LoopRecipe(**CAR, damping=(5.0, 5.0))
    assert loop.described(BODY, 0.01) == (
        "in a loop with a mass of 12 to 400 kg and a damping of 5 N.s/m: force moves it, body is "
        "its answer, and an outer force acts on it; these and other inputs are drawn as in the "
        "other kinds"
    )
    assert loop.settings() == {
        "output": "force", "input": "body", "mass": "12.0 .. 400.0", "damping": "5.0 .. 5.0"
    }  # fmt: skip


def test_causality_follows_from_the_units() -> None:
    found = LoopRecipe(**CAR).interface(BODY, FORCE)
    assert (found.force_out, found.turning, found.input, found.output) == (True, False, 0, 0)
    turned = LoopRecipe(output="angle", input="moment", weight=1.0, stiffness=(1.0, 9.0))
    angle, moment = Signal("angle", "deg", -9.0, 9.0), Signal("moment", "N.m", -1.0, 1.0)
    found = turned.interface((moment,), (angle,))
    assert (found.force_out, found.turning, found.output_unit) == (False, True, np.pi / 180)
    assert "a stiffness of 1 to 9 N.m/rad: angle deforms it" in turned.described((moment,), 0.01)


def test_units_that_are_no_force_and_displacement_are_refused() -> None:
    with pytest.raises(ValueError, match="expected a force and a displacement, or a moment"):
        LoopRecipe(**CAR).interface((Signal("body", "m/s", -1.0, 1.0),), FORCE)


def test_partners_are_drawn_evenly_in_the_logarithm() -> None:
    rng, loop = np.random.default_rng(0), LoopRecipe(**CAR, stiffness=(0.0, 10.0))
    partners = [loop.drawn_partner(rng, alone=False) for _ in range(2000)]
    masses = np.array([partner.mass for partner in partners])
    assert masses.min() >= 12.0
    assert masses.max() <= 400.0
    assert np.median(masses) == pytest.approx(np.sqrt(12.0 * 400.0), rel=0.1)
    assert np.median([p.stiffness for p in partners]) == pytest.approx(5.0, rel=0.1)
    outer = np.array([partner.outer for partner in partners])
    shares = outer[outer < 1.0]
    assert len(shares) == pytest.approx(1000, rel=0.1)
    assert shares.min() > LEAST_OUTER
    assert np.median(shares) == pytest.approx(np.sqrt(LEAST_OUTER), rel=0.3)
    assert min(loop.drawn_partner(rng, alone=True).outer for _ in range(100)) >= LEAST_ALONE
    ends = [partner.mass for partner in LoopRecipe(**CAR).typical_partners()]
    assert ends == pytest.approx([12.0, np.sqrt(12.0 * 400.0), 400.0])


def test_response_of_a_partner_is_that_of_its_equation() -> None:
    turn = np.array([1.0, 10.0])
    found = Partner(2.0, 8.0, 0.5).response(turn)
    np.testing.assert_allclose(found, 1 / (8.0 - 2.0 * turn**2 + 0.5j * turn))
    np.testing.assert_allclose(Partner(0.0, 8.0, 0.5).response(turn), -8.0 - 0.5j * turn)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"mass": (0.0, 3.0)}, "expected a smallest mass above 0"),
        ({"mass": (0.0, 0.0)}, "no partner; expected a range of mass"),
        ({"mass": (3.0, 1.0)}, "smaller one first"),
        ({"weight": 0.0}, "greater than 0"),
    ],
)
def test_tables_without_a_partner_are_refused(values: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        LoopRecipe(**CAR | values)
