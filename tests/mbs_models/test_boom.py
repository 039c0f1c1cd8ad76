"""The boom against statics and beam theory, the cylinder against oil, both against the whole."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from mbs_models.boom import cylinder
from mbs_models.boom.boom import (
    BENDING_STIFFNESS,
    EYE,
    FOOT,
    GRAVITY,
    LENGTH,
    STIFFNESS,
    TUBE_MASS,
    Boom,
)
from slide_fmu.memory.modes import spectrum
from tests.own_models.systems.boom_cylinder import BOOM_CYLINDER, LOAD
from tests.own_models.systems.cut_machine import relative_error

TIP_PART = 33 / 140
"""Part of the mass of a clamped beam that acts at its tip (Rayleigh)."""


def test_force_at_rest_holds_the_weight() -> None:
    boom = Boom()
    state = boom.rest_state(np.array([1.5]))
    boom.set_state(state)
    force = float(boom.output()[0])
    assert force == pytest.approx(LOAD, abs=1.0)
    place = np.array([k * EYE for k in range(5)]) + state.coordinates[0:20:4]
    height = state.coordinates[5]
    along = np.array([place[1] - FOOT[0], height - FOOT[1]])
    arm = (place[1] * along[1] - height * along[0]) / np.hypot(*along)
    weight = np.trapezoid(place, dx=EYE) * TUBE_MASS + 100.0 * place[-1]
    assert force * arm == pytest.approx(weight * GRAVITY, rel=2e-3)


def test_first_mode_is_that_of_beam_and_rod() -> None:
    boom = Boom(load=400.0)
    state = boom.rest_state(np.array([2**0.5]))  # the boom is level
    modes = spectrum(boom.linearize(state)).modes
    swing = min(mode.natural_frequency for mode in modes)
    arm, overhang = 0.5**0.5 * EYE, LENGTH - EYE
    gives = (LENGTH / arm) ** 2 / STIFFNESS + overhang**2 * LENGTH / (3 * BENDING_STIFFNESS)
    mass = 400.0 + TIP_PART * TUBE_MASS * LENGTH
    assert swing == pytest.approx((gives * mass) ** -0.5, rel=0.06)


def test_closed_valve_leaves_oil_as_a_spring() -> None:
    p = SimpleNamespace(**{**cylinder.parameters, "leakage": 0.0, "load": LOAD})
    x = np.array(cylinder.start(None, p))
    assert cylinder.f(x, [LOAD, 0.0], p) == pytest.approx([0.0] * 6, abs=1e-9)
    x[1] = 0.01
    rates = cylinder.f(x, [LOAD, 0.0], p)
    areas = cylinder.BORE_AREA, cylinder.ROD_AREA
    volumes = (
        cylinder.DEAD_VOLUME + areas[0] * (1.5 - cylinder.SHORTEST),
        cylinder.DEAD_VOLUME + areas[1] * (cylinder.LONGEST - 1.5),
    )
    stiffness = sum(p.bulk_modulus * a**2 / v for a, v in zip(areas, volumes, strict=True))
    assert areas[0] * rates[2] - areas[1] * rates[3] == pytest.approx(-0.01 * stiffness)


@pytest.mark.extended
def test_halves_follow_the_whole_machine(tmp_path: Path) -> None:
    partner, step, stop = BOOM_CYLINDER.partners["piston 20 kg"], 0.01, 1.5
    command = BOOM_CYLINDER.drive(partner, 1, stop)
    true = BOOM_CYLINDER.whole(partner, command, step, stop)
    run = BOOM_CYLINDER.run(tmp_path, {}, partner, command, step, stop)
    for name, values in true.items():
        assert relative_error(run[f"partner.{name}"], values) < 0.02
