"""
# A motion that does not ring

A robot on a flexible socket shall move a part from one place to another, and stand still there: to
a tenth of a millimetre, as early as it can. The simulation of the socket takes seconds for one
motion; the surrogate answers hundreds of them in that time, and so it can choose.
"""

# mkdocs_gallery_thumbnail_path = 'tutorials/results/chosen_motion.png'
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from slide_fmu.apps.motion import read_task
from slide_fmu.apps.motion.solve import solve

# %%
# The task is a file of a few lines: both places, how still is still, and what the drives can do.
#
# ```toml
# --8<-- "docs/tutorials/pick_and_place.toml"
# ```
task = read_task(Path("docs/tutorials/pick_and_place.toml"))
solved = solve(Path("fmus/robot_6r/robot_6r.fmu"), task, verify=True)

# %%
# On the command line this is `slide-fmu motion FMU TASK --verify`, which also writes set points.
# Times are those from which on the tool stays within the tolerance, by the reference model. The
# fastest move within the limits rings. Behind input shapers, which are usual against ringing, it
# rings less, and arrives later. The optimised one is the earliest:
reference = solved.figures().reference
for move in reference.baselines:
    print(f"{move.name}: {move.settled_s:.3f} s")
print(f"{solved.found.move.name}: {reference.move.settled_s:.3f} s")

# %%
# What the surrogate predicted for the optimised move, beside the truth:
predicted, true = solved.found.move.outputs, solved.truths[0]
error = np.linalg.norm(predicted - true, axis=1)
relative = 100 * np.sqrt(np.mean(error**2) / np.mean(np.sum(true**2, axis=1)))
print(f"error of the prediction: {relative:.2f} %")

# %%
# Distance of the tool from rest, on a logarithmic axis: solid as predicted, dashed the truth.
_, panel = plt.subplots(layout="constrained")
time = solved.found.response.step * (1 + np.arange(len(predicted)))
for index, (move, truth) in enumerate(zip(solved.moves[:3], solved.truths, strict=False)):
    panel.semilogy(time, np.linalg.norm(move.outputs, axis=1), f"C{index}", label=move.name)
    panel.semilogy(time, np.linalg.norm(truth, axis=1), f"C{index}--")
panel.axhline(task.tolerance, color="black")
panel.set(xlim=(0, 2.2), ylim=(1e-6, 3e-2), xlabel="time / s", ylabel="distance from rest / m")
panel.legend()
plt.savefig("chosen_motion.png")
print("picture: chosen_motion.png")

# %%
# --8<-- "docs/tutorials/results/chosen_motion.md"
