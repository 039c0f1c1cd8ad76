"""Ask an FMU with an error bound, in fmpy, how far off it is, and whether it knows its inputs."""

import sys

import fmpy
import numpy as np

STEP = 0.015625  # s
time = STEP * np.arange(800)
shape = np.random.default_rng(3).uniform(-1, 1, len(time))

for amplitude in (900.0, 2500.0):  # N; the range of the training ends at 1000 N
    signals = np.empty(len(time), dtype=[("time", float), ("force", float)])
    signals["time"], signals["force"] = time, amplitude * shape
    result = fmpy.simulate_fmu(
        sys.argv[1],
        stop_time=time[-1],
        output_interval=STEP,
        input=signals,
        start_values={"confidence": 0.99},
        output=["position", "position_error_bound", "in_domain", "novelty", "error_bound_filled"],
    )
    result = result[result["error_bound_filled"] >= 1]  # before, it does not know enough
    known = result["in_domain"].astype(bool)
    print(f"up to {amplitude:g} N: {100 * known.mean():.3g} % of the steps are in the domain")
    print(f"  the largest novelty is {result['novelty'].max():.3g}")
    print(f"  a usual bound is {np.median(result['position_error_bound']):.2g} m")
    print(f"  a usual position is {np.median(np.abs(result['position'])):.2g} m")
