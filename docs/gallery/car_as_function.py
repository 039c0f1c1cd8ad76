"""
# Quarter car as a Python function

A quarter of a car drives over a road: a body on a spring with a bump stop and an asymmetric
damper, a wheel, and a tyre. Whoever can write this as x' = f(x, u, p) needs nothing else.
"""

# mkdocs_gallery_thumbnail_path = 'tutorials/results/car_as_function.png'
import sys
import tomllib
from pathlib import Path

import slide_fmu as slide

# %%
# The model is a file of 35 lines: the functions f and g, and the names and units of the road and
# of three outputs ([the file, explained](../../own_model_function.md)). Its recipe adds the ranges
# and the sample step. Both lie in one folder.

MODELS = "docs/tutorials"
sys.path.append(MODELS)
recipe = tomllib.loads(Path(MODELS, "quarter_car_function.toml").read_text())

# %%
# By default the program finds everything else: how long the car remembers the road, how many
# motions it must see, and how large the network has to be. `slide-fmu run
# docs/tutorials/quarter_car_function.toml` does so, and takes longer. Here these sizes are given
# and small: the network sees 7.68 s of the road, 12 motions teach it, and 3 decide which of its
# versions is kept.

recipe["name"] = "car_as_function"
recipe["window"] |= {"n_in": 768, "n_out": 128}
learnt = slide.learn(
    **recipe,
    data={"train": 12, "validation": 3, "duration": 12.0, "burn_in": 5.0},
    network={"order": 4, "hidden": 20},
    training={"starts": 2, "iterations": 50, "expert": {"part": 2, "kept": 1}},
    validation={"trajectories": 4},
)

# %%
# The call has simulated the motions, trained the network and written an FMU. Then it has measured
# the FMU on four new motions that no training saw. These are the errors, relative to the root mean
# square of each output:

for name, error in learnt.errors.items():
    print(f"{name}: {100 * error:.2f} %")
print("picture:", learnt.report.with_name("side_by_side.png"))

# %%
# --8<-- "docs/tutorials/results/car_as_function.md"
#
# Above the road, in the middle body acceleration of model and FMU, below the error, of a usual
# motion and of the worst one. The FMU and its report lie beside the picture.
