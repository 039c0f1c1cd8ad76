"""
# Learn from a record of a test bench

A mount was measured, and there is no model of it. A file with times, force and travel is enough
for an FMU.
"""

# mkdocs_gallery_thumbnail_path = 'tutorials/results/3_measured_record.png'
import matplotlib.pyplot as plt
import numpy as np

import slide_fmu as slide

# %%
# This stands in for the test bench: a mass of 1 kg on a hardening spring, shaken by a random force
# for 100 s. The sensor adds a noise of 1 %. The file has a line for every 10 ms.

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
# travel` writes one like it, and finds the ranges. Here the size of the network is given, which
# saves the search for it.

force_range, travel_range = {"range": [-160.0, 160.0]}, {"range": [-0.3, 0.3]}
signals = {"inputs": {"force": force_range}, "outputs": {"travel": travel_range}}
learnt = slide.learn(
    {"kind": "record", "model": "bench.csv", **signals},
    "measured_record",
    window={"step": STEP, "remaining_amplitude": 0.001},
    network={"order": 2, "hidden": 6},
)

# %%
# 15 % of the record were kept for the measurement, in blocks that are spread over it; the last one
# ends it. There the error is hardly larger than the noise. Compared with the truth, which this
# tutorial alone knows, it is much smaller:

[output] = learnt.figures["validation"]["in range"]["outputs"]
print(f"measured: {100 * output['relative_rmse']:.3g} %")
print(f"noise: {100 * output['relative_noise_floor']:.3g} %")
found = learnt.surrogate.predict_newest(force[1:, None])[-300:, 0]
print(f"truth: {100 * np.sqrt(np.mean((found - travel[-300:]) ** 2)) / travel.std():.3g} %")
plt.style.use("docs/tutorials/plots.mplstyle")
seconds = STEP * np.arange(-300, 0) + 100
plt.plot(seconds, 1e3 * noisy[-300:], ".", color="0.6", ms=9, label="measured")
plt.plot(seconds, 1e3 * found, "C0", label="FMU")
plt.gca().set(xlim=(97.5, 99.5), xlabel="time / s", ylabel="travel / mm")
plt.legend(loc="upper right", ncols=2)
plt.savefig("measured_record.png")
print("picture: measured_record.png")

# %%
# --8<-- "docs/tutorials/results/3_measured_record.md"
