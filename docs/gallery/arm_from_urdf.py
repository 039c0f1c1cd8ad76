"""
# Two-link arm from its URDF

Two drives turn and lift an arm on a flexible base. How far does the base put the load off? The
forces on the base follow from the arm's geometry and masses, and these stand in its URDF.
"""

# mkdocs_gallery_thumbnail_path = 'tutorials/results/arm_from_urdf.png'
import sys
import tomllib
from pathlib import Path

import slide_fmu as slide

# %%
# The recipe names the model (a class, with the arm in exudyn), the URDF and the law by which the
# drives follow their set points, and the motions of the training: from point to point.

MODELS = "docs/tutorials"
sys.path.append(MODELS)
recipe = tomllib.loads(Path(MODELS, "two_link_arm.toml").read_text())

# %%
# What the network sees is named here: force and moment of the arm on its base, their change in a
# step, the arm's inertia and momentum ([what they are](../../robots.md)). A recipe that
# names nothing tries these and simpler choices and takes the best. `slide-fmu run
# docs/tutorials/two_link_arm.toml` does so, and searches for the sizes too, which takes longer.

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
# Errors of the deviation on four unseen motions, relative to its root mean square:

for name, error in learnt.errors.items():
    print(f"{name}: {100 * error:.2f} %")
print("picture:", learnt.report.with_name("side_by_side.png"))

# %%
# --8<-- "docs/tutorials/results/arm_from_urdf.md"
#
# Above the set points, in the middle the deviation along x of exudyn and FMU, below the error.
