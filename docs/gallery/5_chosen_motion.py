"""
# Move a robot without ringing

A robot on a flexible socket brings a part from one place to another. It shall stand still there to
a tenth of a millimetre, as early as it can. The surrogate tries hundreds of motions in the time of
one simulation, and so it finds a good one.
"""

# mkdocs_gallery_thumbnail_path = 'tutorials/results/5_chosen_motion.png'
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from slide_fmu.apps.motion import read_task
from slide_fmu.apps.motion.solve import solve

# %%
# The task is a file of a few lines: both places, the tolerance, and the limits of the drives.
#
# ```toml
# --8<-- "docs/tutorials/pick_and_place.toml"
# ```
task = read_task(Path("docs/tutorials/pick_and_place.toml"))
solved = solve(Path("fmus/robot_6r/robot_6r.fmu"), task, verify=True)

# %%
# `slide-fmu motion FMU TASK --verify` does the same, and writes the set points too. From these
# times on the tool stays within the tolerance, says the reference model. The fastest move within
# the limits rings. Input shapers, the usual remedy, make it ring less. The optimised move is
# earliest:
reference = solved.figures().reference
for move in reference.baselines:
    print(f"{move.name}: {move.settled_s:.3f} s")
print(f"{solved.optimised.move.name}: {reference.move.settled_s:.3f} s")

# %%
# The surrogate's prediction of the optimised move, compared with the reference model:
predicted, true = solved.optimised.move.outputs, solved.truths[0]
error = np.linalg.norm(predicted - true, axis=1)
relative = 100 * np.sqrt(np.mean(error**2) / np.mean(np.sum(true**2, axis=1)))
print(f"error of the prediction: {relative:.2f} %")

# %%
# Distance of the tool from rest by the reference model, on a logarithmic axis. The grey line is
# the tolerance.
plt.style.use("docs/tutorials/plots.mplstyle")
_, panel = plt.subplots()
time = solved.optimised.response.step * (1 + np.arange(len(predicted)))
for move, truth, colour in zip(solved.moves[:3], solved.truths, ("C0", "C1", "C2"), strict=False):
    panel.semilogy(time, 1e3 * np.linalg.norm(truth, axis=1), colour, label=move.name)
panel.axhline(1e3 * task.tolerance, color="0.5", lw=1.5)
panel.set(xlim=(0.8, 2.2), ylim=(1e-3, 20), xlabel="time / s", ylabel="distance from rest / mm")
panel.legend()
plt.savefig("chosen_motion.png")
print("picture: chosen_motion.png")

# %%
# --8<-- "docs/tutorials/results/5_chosen_motion.md"
