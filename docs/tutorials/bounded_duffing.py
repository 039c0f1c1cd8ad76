"""Ask an FMU with an error bound, in fmpy, how far off it is, and at which steps to trust it."""

import sys

import fmpy
import numpy as np

STEP = 0.015625  # s
NAMES = ["position", "position_error_bound", "trusted", "in_domain", "error_bound_filled"]
time = STEP * np.arange(800)
shape = np.random.default_rng(3).uniform(-1, 1, len(time))


def run(amplitude, start_values):
    signals = np.empty(len(time), dtype=[("time", float), ("force", float)])
    signals["time"], signals["force"] = time, amplitude * shape
    result = fmpy.simulate_fmu(
        sys.argv[1],
        stop_time=time[-1],
        output_interval=STEP,
        input=signals,
        start_values=start_values,
        output=NAMES,
    )
    return result[result["error_bound_filled"] >= 1]  # before, it does not know enough


for amplitude in (900.0, 2500.0):  # N; the range of the training ends at 1000 N
    result = run(amplitude, {})
    strict = run(amplitude, {"position_error_tolerance": 1e-4})  # m
    print(
        f"up to {amplitude:g} N: {100 * result['trusted'].mean():.3g} % of the steps are trusted"
    )
    print(f"  with a tolerance of 0.1 mm, {100 * strict['trusted'].mean():.3g} % are")
    print(f"  {100 * result['in_domain'].mean():.3g} % are in the domain")
    print(f"  a usual bound is {np.median(result['position_error_bound']):.2g} m")
