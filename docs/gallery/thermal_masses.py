"""
# Three thermal masses from Python

Nothing here moves: three blocks in a row, heated at both ends, conduct and radiate heat. Systems
of first order are as welcome as mechanical ones, and `slide.learn` takes them as Python objects.
"""

# mkdocs_gallery_thumbnail_path = 'tutorials/results/thermal_masses.png'
import sys

import matplotlib.pyplot as plt
import numpy as np

import slide_fmu as slide

sys.path.append("docs/tutorials")
import thermal_masses_function as model

# %%
# The rates of the temperatures are `f(x, u, p)`, the outputs `g(x, u, p)`: functions of your own,
# here of a module; in a notebook they may stand in a cell. The signals get their ranges.

heaters = [slide.Signal(name, unit, 0, 500) for name, unit in model.inputs.items()]
blocks = [slide.Signal(name, unit, 250, 650) for name, unit in model.outputs.items()]
system = slide.FunctionSystem(
    model.f, model.g, inputs=heaters, outputs=blocks, start=model.start,
    parameters=model.parameters, step=10.0,
)  # fmt: skip

# %%
# By default a mix of noise, sines and steps is taught. These heaters are switched, so steps in
# the whole range are taught here. The window is found, the sizes are given; without them
# `slide.learn` finds these too, which takes longer.

steps = {"kind": "steps", "weight": 1.0, "amplitude": [0.9, 1.0], "duration": [60.0, 2000.0]}
data = {"train": 12, "validation": 3, "duration": 9000.0, "excitation": [steps]}
training = {"starts": 2, "iterations": 40, "expert": {"kept": 1}}
sizes = {"data": data, "network": {"order": 3, "hidden": 8}, "training": training}
learnt = slide.learn(system, "thermal_masses", **sizes, validation={"trajectories": 4})

# %%
# Errors on four unseen records, related to how far each temperature varies. Then a test of our
# own: one heater works for an hour, later the other one. The error stays below 0.4 K.

for output in learnt.figures["validation"]["in range"]["outputs"]:
    print(f"{output['name']}: {100 * output['relative_rmse']:.3f} %")
hours = np.arange(1, 1441) / 360
heat = np.stack([400 * (abs(hours - 0.6) < 0.5), 300 * (abs(hours - 2.5) < 0.5)], axis=1)
true, found = system.simulate(heat)[1:], learnt.surrogate.predict_newest(heat)
_, (upper, lower) = plt.subplots(2, sharex=True, layout="constrained")
upper.plot(hours, true, "k", hours, found, "--")
upper.set(ylabel="temperature / K", title="three blocks (black) and surrogate (dashed)")
lower.plot(hours, found - true)
lower.set(ylabel="error / K", xlabel="time / h")
plt.savefig("runs/thermal_masses/heaters.png")
print("picture: runs/thermal_masses/heaters.png")

# %%
# --8<-- "docs/tutorials/results/thermal_masses.md"
