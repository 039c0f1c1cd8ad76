"""
# Quarter car in exudyn

The same car as a multibody model: two masses, a spring and a tyre in an exudyn `MainSystem`.
"""

# mkdocs_gallery_thumbnail_path = 'tutorials/results/car_in_exudyn.png'
import sys
import tomllib
from pathlib import Path

import slide_fmu as slide

# %%
# The model is a file of 38 lines: a function `build` that fills the `MainSystem`, and the names of
# inputs and outputs ([the file, explained](../../own_model_exudyn.md)). An output has the name of
# a sensor. The road has no load of its name: user functions read it, and its rate.

MODELS = "docs/tutorials"
sys.path.append(MODELS)
recipe = tomllib.loads(Path(MODELS, "quarter_car_exudyn.toml").read_text())

# %%
# The program integrates over each sample step, finds the equilibrium on which the car begins, and
# linearizes: the eigenvalues say how long the car remembers the road. By default they also set the
# window, and the sizes of data and network are searched: `slide-fmu run
# docs/tutorials/quarter_car_exudyn.toml` does so, and takes longer. Here all sizes are given, and
# small.

recipe["name"] = "car_in_exudyn"
recipe["window"] |= {"n_in": 768, "n_out": 128}
learnt = slide.learn(
    **recipe,
    data={"train": 12, "validation": 3, "duration": 14.0, "burn_in": 5.0},
    network={"order": 4, "hidden": 20},
    training={"starts": 2, "iterations": 50, "expert": {"part": 2, "kept": 1}},
    validation={"trajectories": 4},
)

# %%
# The FMU that came out needs neither exudyn nor Python. On four motions that no training saw, its
# errors, relative to the root mean square of each output, are:

for name, error in learnt.errors.items():
    print(f"{name}: {100 * error:.2f} %")
print("picture:", learnt.report.with_name("side_by_side.png"))

# %%
# --8<-- "docs/tutorials/results/car_in_exudyn.md"
#
# Above the road, in the middle body acceleration of exudyn and FMU, below the error, of a usual
# motion and of the worst one.
