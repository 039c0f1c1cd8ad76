"""
# Turn equations into an FMU

A quarter of a car drives over a road: a body on a spring with a bump stop and an asymmetric
damper, a wheel, and a tyre. Its equations x' = f(x, u, p) are all that a surrogate needs.
"""

# mkdocs_gallery_thumbnail_path = 'tutorials/results/2_car_as_function.png'
import sys

import matplotlib.pyplot as plt
import numpy as np

import slide_fmu as slide

sys.path.append("docs/tutorials")
import quarter_car_function as car

# %%
# The model is a short file with the functions f and g ([how to write
# one](../../own_model.md)). Here its signals get their ranges. A recipe can do the same:
# `docs/tutorials/quarter_car_function.toml`, for `slide-fmu run`.

limits = {"body_acceleration": 20.0, "suspension_travel": 0.1, "tyre_deflection": 0.05}
system = slide.FunctionSystem(
    car.f, car.g, start=car.start, parameters=car.parameters, step=0.01,
    inputs=[slide.Signal("road", "m", -0.05, 0.05, hold=car.hold)],
    outputs=[slide.Signal(n, car.outputs[n], -most, most) for n, most in limits.items()],
)  # fmt: skip

# %%
# A network knows only roads like the ones of its training: here rough roads, waves, and rest. By
# default the program finds all sizes, which takes longer. Here they are small: the network sees
# 7.68 s of the road, learns from 12 motions, and is chosen by 3 others.

roads = [
    {"kind": "filtered_random", "weight": 2, "amplitude": [0, 0.4], "angular_frequency": [1, 20]},
    {"kind": "multisine", "weight": 2, "amplitude": [0.1, 0.5], "angular_frequency": [1, 30]},
    {"kind": "rest", "weight": 1, "amplitude": [0.05, 0.3], "duration": [0.3, 2]},
]
data = {"train": 12, "validation": 3, "duration": 12.0, "burn_in": 5.0, "excitation": roads}
learnt = slide.learn(
    system, "car_as_function", data=data, validation={"trajectories": 4},
    window={"step": 0.01, "n_in": 768, "n_out": 128}, network={"order": 4, "hidden": 20},
    training={"starts": 2, "iterations": 50, "expert": {"part": 2, "kept": 1}},
)  # fmt: skip
print("FMU and report:", learnt.fmu.parent)

# %%
# Errors on four new motions, relative to the root mean square of each output. Then a test of our
# own: the car drives over a bump of 4 cm.

for name, error in learnt.errors.items():
    print(f"{name}: {100 * error:.2f} %")
t = 0.01 * np.arange(1, 301)
road = 0.02 * (1 - np.cos(2 * np.pi * np.clip((t - 0.5) / 0.4, 0, 1)))[:, None]
plt.style.use("docs/tutorials/plots.mplstyle")
plt.plot(t, system.simulate(road)[1:, 0], "0.6", lw=6, label="model")
plt.plot(t, learnt.surrogate.predict_newest(road)[:, 0], "C0", label="surrogate")
plt.gca().set(xlabel="time / s", ylabel="body acceleration / m/s²", xlim=(0.3, 2.5))
plt.legend()
plt.savefig("runs/car.png")
print("picture: runs/car.png")

# %%
# --8<-- "docs/tutorials/results/2_car_as_function.md"
