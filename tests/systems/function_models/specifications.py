"""The models of the tests and of the tutorials, with ranges as a recipe gives them."""

from __future__ import annotations

from pathlib import Path

from slide_fmu.systems.declared import Parameter, SignalTable
from slide_fmu.systems.specification import Specification

HERE = Path(__file__).parent
TUTORIALS = Path(__file__).parents[3] / "docs" / "tutorials"

Ranges = dict[str, tuple[float, float]]


def specification(
    path: Path, inputs: Ranges, outputs: Ranges, step: float | None, **parameters: Parameter
) -> Specification:
    """A model in a file, with the ranges of its signals."""
    tables = (
        {name: SignalTable(range=ends) for name, ends in ranges.items()}
        for ranges in (inputs, outputs)
    )
    return Specification(str(path), parameters, step, "function", *tables)


def quarter_car(**parameters: Parameter) -> Specification:
    """Second order, four states, the road under a first-order hold."""
    outputs = {
        "body_acceleration": (-20.0, 20.0),
        "suspension_travel": (-0.1, 0.1),
        "tyre_deflection": (-0.05, 0.05),
    }
    path = TUTORIALS / "quarter_car_function.py"
    return specification(path, {"road": (-0.05, 0.05)}, outputs, 0.01, **parameters)


def thermal_masses(**parameters: Parameter) -> Specification:
    """First order, three states, two heaters that are held."""
    inputs = {"left_heater": (0.0, 500.0), "right_heater": (0.0, 500.0)}
    outputs = {name: (250.0, 650.0) for name in ("left", "middle", "right")}
    path = TUTORIALS / "thermal_masses_function.py"
    return specification(path, inputs, outputs, 10.0, **parameters)


def integrator() -> Specification:
    """It never forgets."""
    path = HERE / "integrator.py"
    return specification(path, {"inflow": (-1.0, 1.0)}, {"level": (-10.0, 10.0)}, 0.1)


def bistable() -> Specification:
    """Two positions of rest, between which forces within the range can choose."""
    path = HERE / "bistable.py"
    return specification(path, {"force": (-60.0, 60.0)}, {"position": (-2.0, 2.0)}, 0.02)


def bouc_wen() -> Specification:
    """Hysteresis."""
    path = HERE / "bouc_wen.py"
    return specification(path, {"force": (-6.0, 6.0)}, {"position": (-0.2, 0.2)}, 0.02)


def first_order_lag(**parameters: Parameter) -> Specification:
    """A whole simulation, whose file gives the ranges."""
    return specification(HERE / "first_order_lag.py", {}, {}, 0.02, **parameters)
