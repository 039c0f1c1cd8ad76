"""
# Quarter car as an FMU

A model that is an FMU needs no line of Python: its model description says what it takes and gives.
"""

# mkdocs_gallery_thumbnail_path = 'tutorials/results/car_as_fmu.png'
import subprocess
import sys
import tomllib
from pathlib import Path

from pythonfmu import FmuBuilder

import slide_fmu as slide

# %%
# Any tool may have written the FMU. This one is made here by PythonFMU, of a file with the class
# of its slave. It is an FMU of FMI 2.0 for co-simulation, which holds its inputs over each step.

folder = Path("runs", "car_model")
folder.mkdir(parents=True, exist_ok=True)
FmuBuilder.build_FMU("docs/tutorials/quarter_car_slave.py", dest=folder)

# %%
# `slide-fmu init` reads the model description, simulates the FMU for some seconds and writes a
# recipe in which every line is commented. Only the range of the road must be told, since the
# FMU does not say it. At a command line it is `slide-fmu init QuarterCar.fmu
# --input road=-0.05..0.05 -o car.toml`.

command = ["init", folder / "QuarterCar.fmu", "--input", "road=-0.05..0.05", "--step", "0.01"]
place = folder / "car.toml"
subprocess.run([sys.executable, "-m", "slide_fmu", *command, "-o", place, "--force"], check=True)
recipe = tomllib.loads(place.read_text())

# %%
# `slide-fmu run car.toml` goes on from there by itself, and takes longer. Here the sizes are
# given, and the bound of the error, which the recipe asks for, is left out.

sys.path.append(str(folder))  # where the recipe finds the FMU
recipe |= {"name": "car_as_fmu", "bound": None}
recipe["window"] |= {"n_in": 640, "n_out": 128, "remaining_amplitude": 0.01}
recipe["data"] |= {"train": 12, "validation": 3, "duration": 12.0, "burn_in": 7.0}
network = {"order": 4, "hidden": 20}
training = {"starts": 2, "iterations": 50, "expert": {"part": 2, "kept": 1}}
learnt = slide.learn(**recipe, network=network, training=training, validation={"trajectories": 4})

# %%
# Errors on four unseen motions, relative to the root mean square of each output:

for name, error in learnt.errors.items():
    print(f"{name}: {100 * error:.2f} %")
print("picture:", learnt.report.with_name("side_by_side.png"))

# %%
# --8<-- "docs/tutorials/results/car_as_fmu.md"
#
# Above the road, in the middle body acceleration of both FMUs, below the error.
