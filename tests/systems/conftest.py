"""FMUs of the user, each built once."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.own_models.lag import build_lag
from tests.own_models.quarter_car import build_in_c, build_in_python
from tests.own_models.tank import build_tank


@pytest.fixture(scope="session")
def fmu_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("fmus")


@pytest.fixture(scope="session")
def car(fmu_folder: Path) -> str:
    """The quarter car in C, for both interfaces."""
    return str(build_in_c(fmu_folder / "car.fmu", co_simulation=True))


@pytest.fixture(scope="session")
def slope_car(fmu_folder: Path) -> str:
    """The quarter car in C, for model exchange, which tells directional derivatives."""
    return str(build_in_c(fmu_folder / "slope_car.fmu", slopes=True))


@pytest.fixture(scope="session")
def python_car(fmu_folder: Path) -> str:
    """The quarter car in Python, for co-simulation, without units and ranges."""
    return str(build_in_python(fmu_folder / "python_car.fmu"))


@pytest.fixture(scope="session")
def trap(fmu_folder: Path) -> str:
    """A quarter car that fails, crashes and does not reset, in C, for both interfaces."""
    return str(build_in_c(fmu_folder / "trap.fmu", co_simulation=True, traps=True))


@pytest.fixture(scope="session")
def tank(fmu_folder: Path) -> str:
    """A tank with events, for model exchange by FMI 3.0."""
    return str(build_tank(fmu_folder / "tank.fmu"))


@pytest.fixture(scope="session")
def lag(fmu_folder: Path) -> str:
    """A lag for co-simulation by FMI 3.0, with signals of single precision."""
    return str(build_lag(fmu_folder / "lag.fmu"))
