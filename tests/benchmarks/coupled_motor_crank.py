"""Coupled runs of a motor and a flexible slider-crank, cut at the motor's shaft.

The surrogate's recipe needs an hour; ``coupled_crank.toml`` needs a few minutes, and errs more:

    slide-fmu run tests/own_models/systems/coupled_crank_large.toml
    PYTHONPATH=. python tests/benchmarks/coupled_motor_crank.py \\
        --surrogate runs/coupled_crank_large/coupled_crank_large.fmu --json -
"""

from __future__ import annotations

from functools import partial

from tests.benchmarks.coupled_systems import measure, parser_of
from tests.benchmarks.figures_out import measure_and_write
from tests.own_models.systems.motor_crank import MOTOR_CRANK

if __name__ == "__main__":
    measure_and_write(parser_of(__doc__), partial(measure, MOTOR_CRANK))
