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
    *(model.f, model.g), inputs=heaters, outputs=blocks, start=model.start,
    parameters=model.parameters, step=10.0,
)  # fmt: skip

# %%
# The window is found by the program: 240 samples, since the blocks remember for half an hour. The
# other sizes are given. `slide.learn(system, "thermal_masses")` alone finds them too, within 10 to
# 20 minutes, and so does `slide-fmu run docs/tutorials/thermal_masses_function.toml`.

sizes = {"data": {"train": 8, "validation": 2}, "network": {"order": 3, "hidden": 8}}
training = {"starts": 2, "kept": 1, "iterations": 40}
learnt = slide.learn(
    system, "thermal_masses", **sizes, training=training, validation={"trajectories": 4}
)

# %%
# Errors on four unseen motions, related to how far each temperature varies. Then a test of our
# own: one heater works for an hour, later the other one.

for output in learnt.figures["validation"]["in range"]["outputs"]:
    print(f"{output['name']}: {100 * output['rmse_over_deviation']:.3f} %")
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
