"""
# Compare with simpler models

Is a network needed at all? Simpler models learn from the same data in the same time, and all are
measured on the same motions.
"""

# mkdocs_gallery_thumbnail_path = 'tutorials/results/8_simpler_models.png'
import json
import subprocess
import sys
from pathlib import Path

import matplotlib.pyplot as plt

# %%
# The model is an oscillator with a hardening spring under a random force. The recipe gives all
# sizes, so that its network learns in seconds:
#
# ```toml
# --8<-- "docs/tutorials/duffing_small.toml"
# ```
#
# `slide-fmu compare` makes the data and trains this network, unless both are there. Then it trains
# models of six other kinds, each for at most the CPU time that the network took. It prints a table
# and writes a report. It needs `pip install 'slide-fmu[compare]'`.

RECIPE = "docs/tutorials/duffing_small.toml"
command = ["compare", RECIPE, "--json", "found.json"]
subprocess.run([sys.executable, "-m", "slide_fmu", *command], check=True)
models = json.loads(Path("found.json").read_text())["models"]

# %%
# A model is given the force alone, and never a true position. The error is relative to the
# standard deviation of the position: a constant would have 100 %.

for model in models:
    model["error"] = 100 * model["outputs"][0]["rmse_over_deviation"]
    size = f"{model['structure']}, {model['parameters']} parameters"
    print(f"{model['title']}: {model['error']:.3g} %\n    {size}, {model['cpu_seconds']:.2g} s")

# %%
# All linear models agree: the rest of this motion is out of reach of any of them. NARX does well
# because its terms are polynomials, and so is this spring. The table of the command also says
# whether the GRU and the feed-forward network have converged
# ([how to read a comparison](../../report.md#how-to-read-it)).

plt.style.use("docs/tutorials/plots.mplstyle")
_, axes = plt.subplots()
names = [model["title"].removeprefix("own: ") for model in models]
errors = [model["error"] for model in models]
bars = axes.barh(names, errors, color=["C0"] + ["C6"] * (len(models) - 1))
axes.bar_label(bars, [f" {error:.2g} %" for error in errors])
axes.set(xscale="log", xlim=(0.003, 200), xlabel="error of the position / %")
axes.invert_yaxis()
plt.savefig("simpler_models.png")
print("picture: simpler_models.png")

# %%
# --8<-- "docs/tutorials/results/8_simpler_models.md"
