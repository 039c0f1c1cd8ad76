"""Coupled runs of a hydraulic cylinder and the flexible boom that it lifts, cut in its rod.

The surrogate's recipe needs a few CPU-minutes:

    slide-fmu run tests/own_models/systems/boom.toml
    PYTHONPATH=. python tests/benchmarks/coupled_boom.py --surrogate runs/boom/boom.fmu --json -
"""

from __future__ import annotations

from functools import partial

from tests.benchmarks.coupled_systems import measure, parser_of
from tests.benchmarks.figures_out import measure_and_write
from tests.own_models.systems.boom_cylinder import BOOM_CYLINDER

if __name__ == "__main__":
    measure_and_write(parser_of(__doc__), partial(measure, BOOM_CYLINDER))
