"""
# Would a simpler model do?

Before a network is trusted, one should know what simpler models are worth: on the same data, with
the same time to learn, measured on the same motions.
"""

# mkdocs_gallery_thumbnail_path = 'tutorials/results/simpler_models.png'
import json
import subprocess
import sys
from pathlib import Path

import matplotlib.pyplot as plt

# %%
# The recipe is that of an oscillator with a spring that hardens, under a random force. It gives
# all sizes, so that its network learns in seconds:
#
# ```toml
# --8<-- "docs/tutorials/duffing_small.toml"
# ```
#
# `slide-fmu compare` makes the data and trains this network, unless both are there. Then it trains
# models of six other kinds, here for 12 s of CPU time each instead of as long as the own network
# took. It needs `pip install 'slide-fmu[compare]'`, prints a table, and writes a report.

RECIPE = "docs/tutorials/duffing_small.toml"
command = ["compare", RECIPE, "--budget", "12", "--json", "found.json"]
subprocess.run([sys.executable, "-m", "slide_fmu", *command], check=True)
models = json.loads(Path("found.json").read_text())["models"]

# %%
# The error is that of free simulation: a model is given the force alone, and never a true position
# on its way. It is related to the standard deviation of the position, so that the mean alone would
# err by 100 %. All linear models agree: so much of this motion is out of reach of any of them.
# Where one were nearly as good as the best model, the command would say that it does.

for model in models:
    model["error"] = 100 * model["outputs"][0]["rmse_over_deviation"]
    size = f"{model['structure']}, {model['parameters']} parameters"
    print(f"{model['title']}: {model['error']:.3g} %\n    {size}, {model['cpu_seconds']:.2g} s")

# %%
# In the picture a model is worth its place if no other one lies further down and to the left of
# it. NARX does well because its terms are polynomials, and so is this spring. GRU and feed-forward
# network would get better with more time: the table says that the budget has cut them short.
# [How to read a comparison](../../compare.md) has more.

_, axes = plt.subplots(layout="constrained")
for model, mark in zip(models, "os^v<>D", strict=True):
    axes.loglog(model["parameters"], model["error"], mark, label=model["title"], alpha=0.8)
axes.set(xlabel="parameters", ylabel="error of the position / %")
axes.legend(loc="lower right")
plt.savefig("simpler_models.png")
print("picture: simpler_models.png")

# %%
# --8<-- "docs/tutorials/results/simpler_models.md"
