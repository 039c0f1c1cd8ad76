"""Coupled runs of two surrogates: a car that is cut between its suspension and its wheel.

Both recipes need a few CPU-minutes:

    slide-fmu run tests/own_models/systems/car_body.toml
    slide-fmu run tests/own_models/systems/car_wheel.toml
    PYTHONPATH=. python tests/benchmarks/coupled_two_surrogates.py --json - \\
        --surrogate runs/car_body/car_body.fmu --partner runs/car_wheel/car_wheel.fmu

Either of them runs with the other half exact too. Where they have error bounds, the share of
samples is printed at which these hold in the loop.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path

from tests.benchmarks.coupled_systems import measure, parser_of
from tests.benchmarks.figures_out import measure_and_write
from tests.own_models.systems.car_in_two import CAR_IN_TWO

if __name__ == "__main__":
    parser = parser_of(__doc__)
    parser.add_argument("--partner", type=Path, help="FMU in the place of the wheel")
    measure_and_write(parser, partial(measure, CAR_IN_TWO))
