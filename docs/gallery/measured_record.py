"""
# A record from a test bench

A machine has been measured, and nobody has a model of it: there is a file with times, the force on
a mount and the travel of the mount, with some noise. That is enough for a surrogate FMU.
"""

# mkdocs_gallery_thumbnail_path = 'tutorials/results/measured_record.png'

import numpy as np

import slide_fmu as slide

# %%
# This stands in for the test bench: a mass of 1 kg on a spring that hardens, shaken by a random
# force for 100 s, with a noise of 1 % of the travel. The file has a line for every 10 ms.

STEP, PARTS = 0.01, 10
rng = np.random.default_rng(1)
force = 20 * np.convolve(rng.normal(size=10_000), np.hanning(12), "same")
travel, x, v = np.empty(10_000), 0.0, 0.0
for k, f in enumerate(force):
    for part in range(PARTS):  # the force moves in a straight line from sample to sample
        now = f + (force[k - 1] - f) * (1 - part / PARTS) if k else f
        v += STEP / PARTS * (now - 6 * v - 400 * x - 2e4 * x**3)
        x += STEP / PARTS * v
    travel[k] = x
noisy = travel + 0.01 * travel.std() * rng.normal(size=len(travel))
table = np.stack([STEP * np.arange(len(force)), force, noisy], axis=1)
np.savetxt("bench.csv", table, "%.9g", ",", "\n", "time [s],force [N],travel [m]", comments="")

# %%
# The recipe names the file and the columns. `slide-fmu init bench.csv --input force --output
# travel` writes one like it, with the ranges that it finds, and `slide-fmu run` does the rest.
# Here the size of the network is given, which saves the search for it.

force_range, travel_range = {"range": [-160.0, 160.0]}, {"range": [-0.3, 0.3]}
signals = {"inputs": {"force": force_range}, "outputs": {"travel": travel_range}}
learnt = slide.learn(
    {"kind": "record", "model": "bench.csv", **signals},
    "measured_record",
    window={"step": STEP, "remaining_amplitude": 0.001},
    network={"order": 2, "hidden": 6},
)

# %%
# The last 15 % of the record were kept for the measurement. The error there is hardly more than
# the noise of the sensor, and beside the truth, which only this tutorial knows, it is much less:

[output] = learnt.figures["validation"]["in range"]["outputs"]
print(f"measured: {100 * output['relative_rmse']:.3g} %")
print(f"noise: {100 * output['relative_noise_floor']:.3g} %")
found = learnt.surrogate.predict_newest(force[1:, None])[-1500:, 0]
error = np.sqrt(np.mean((found - travel[-1500:]) ** 2)) / travel.std()
print(f"truth: {100 * error:.3g} %")
print(f"picture: {learnt.fmu.with_name('side_by_side.png')}")

# %%
# --8<-- "docs/tutorials/results/measured_record.md"
