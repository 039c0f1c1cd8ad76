"""
# Learn a robot from its URDF

Two drives turn and lift an arm on a flexible base. How far does the base put the load off? The
forces on the base follow from the geometry and the masses, and the URDF has both.
"""

# mkdocs_gallery_thumbnail_path = 'tutorials/results/7_arm_from_urdf.png'
import sys
import tomllib
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import slide_fmu as slide

sys.path.append("docs/tutorials")
from two_link_arm import TwoLinkArm

# %%
# The recipe names the model (a class, with the arm in exudyn), the URDF, and how the drives follow
# their set points. The training moves from point to point.

recipe = tomllib.loads(Path("docs/tutorials/two_link_arm.toml").read_text())

# %%
# The network sees forces and moments of the arm on its base, and the arm's inertia and momentum
# ([what they are](../../robots.md)). A recipe that names nothing tries these and simpler choices.
# `slide-fmu run docs/tutorials/two_link_arm.toml` does so, and takes longer.

network = {
    "order": 8, "hidden": 12, "units": "gated", "drive": ["wrench_change"], "static": ["wrench"],
    "gated": ["turned_wrench_change"], "schedule": ["turned_inertia", "turned_momentum"],
    "readout": ["position"],
}  # fmt: skip
recipe["window"] |= {"n_in": 256, "n_out": 96}
few = {"train": 8, "validation": 2, "beyond": 0, "duration": 16.0, "burn_in": 2.0}
recipe |= {"data": recipe["data"] | few, "validation": {"trajectories": 4}}
expert = {"part": 3, "start_iterations": 12, "kept": 1, "kept_iterations": 20}
training = {"starts": 2, "expert": expert}
learnt = slide.learn(**recipe, network=network, training=training | {"iterations": 40})

# %%
# Errors on four unseen motions, relative to the root mean square. Then one turn of our own, with
# the load lifted: the surrogate knows how the base rings after it.

for name, error in learnt.errors.items():
    print(f"{name}: {100 * error:.2f} %")
t = 0.01 * np.arange(1, 401)
way = np.clip((t - 1.0) / 0.9, 0, 1)
points = np.stack([2 * way**2 * (3 - 2 * way) - 1, 0.2 + 0.4 * way**2 * (3 - 2 * way)], axis=1)
true = TwoLinkArm(step=0.01).simulate(points)[1:]
plt.style.use("docs/tutorials/plots.mplstyle")
plt.plot(t, 1e3 * true[:, :2], "0.6", lw=6, label=["exudyn", None])
plt.plot(t, 1e3 * learnt.surrogate.predict_newest(points)[:, :2], label=["x", "y"])
plt.gca().set(xlim=(0.8, 3), xlabel="time / s", ylabel="deviation of the load / mm")
plt.legend(loc="upper right")
plt.savefig("arm.png")
print("picture: arm.png")

# %%
# --8<-- "docs/tutorials/results/7_arm_from_urdf.md"
