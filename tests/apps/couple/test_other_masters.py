"""Other masters run the quarter car in two halves as ``slide-fmu couple`` does.

libcosim, Ecos and FMPy step all components at once, with held values: the method ``jacobi`` with
``zero``. None of them has Gauss-Seidel or implicit steps.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.acceptance.importers import needs
from tests.marks import needs_app

pytestmark = [pytest.mark.extended, needs_app("reference")]

STOP = 1.0
ROUNDING = 1e-12
"""Part of a range: libcosim counts its time in nanoseconds, so its steps differ by rounding."""

NAMES = [pytest.param(name, marks=needs(name)) for name in ("libcosimpy", "ecospy", "fmpy")]


@pytest.mark.parametrize("name", NAMES)
def test_other_master_gives_the_same_as_explicit_steps(
    halves: dict[str, Path], tmp_path: Path, name: str
) -> None:
    """From implicit steps it differs by the error of first order that explicit ones have."""
    from tests.own_models.halves.other_masters import MASTERS, OUTPUTS, ours, write_car_ssp

    distances = []
    for step in (0.01, 0.005):
        ssp = write_car_ssp(tmp_path / "car.ssp", halves, step, STOP)
        run = ssp, OUTPUTS, step, round(STOP / step)
        found = MASTERS[name](*run)
        same = ours(*run, moving=["lower"], method="jacobi", extrapolation="zero")
        size = np.ptp(same, axis=0)
        assert np.all(size > 0)
        assert np.all(np.abs(found - same) < ROUNDING * size)
        implicit = ours(*run, moving=["lower"])
        distances.append(np.max(np.abs(found - implicit) / size, axis=0))
    assert distances[0] / distances[1] == pytest.approx(2, rel=0.25)
