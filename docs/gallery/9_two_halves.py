"""
# Couple a car in two halves

A quarter car is cut between its spring and its body. A surrogate learns the lower half. Its FMU
runs together with the FMU of the upper half. The body is light, so the method matters.
"""

# mkdocs_gallery_thumbnail_path = 'tutorials/results/9_two_halves.png'
import subprocess
import sys

import matplotlib.pyplot as plt
import numpy as np

import slide_fmu as slide

sys.path.append("docs/tutorials")
import whole_car

# %%
# The lower half sees the road and the body, and answers with a force: it need not integrate a mass
# ([where to cut](../../coupled.md)).
learnt = slide.run("docs/tutorials/lower_half.toml")

# %%
# The upper half is a body of 40 kg. `slide-fmu reference` writes its model itself as an FMU.
upper = "runs/upper_half.fmu"
command = ["slide_fmu", "reference", "docs/tutorials/upper_half.toml", "-o", upper]
subprocess.run([sys.executable, "-m", *command], check=True, capture_output=True)

# %%
# A rough road begins after half a second. Newton's method repeats each step until force and
# position agree. Explicit steps continue from former values. The truth is the car without a cut.
t = whole_car.STEP * np.arange(251)
late = np.clip(t - 0.5, 0, None)
road = 0.01 * np.sin(5 * late) + 0.006 * np.sin(11 * late)
true = whole_car.position_of_the_body(road)


def coupled(**options):
    return slide.couple(
        {"lower": learnt.fmu, "upper": upper},
        [("lower.force", "upper.force"), ("upper.position", "lower.body")],
        step=whole_car.STEP, stop=t[-1], inputs={"lower.road": (t, road)}, **options,
    )["upper.position"]  # fmt: skip


# %%
# Errors of the body's position, relative to its standard deviation:
newton, explicit = coupled(), coupled(method="gauss_seidel")
for name, found in {"newton": newton, "gauss_seidel": explicit}.items():
    print(f"{name}: {100 * np.std(found - true) / np.std(true):.1f} %")
plt.style.use("docs/tutorials/plots.mplstyle")
plt.plot(t, 1e3 * explicit, "C1", lw=1, label="explicit steps")
plt.plot(t, 1e3 * true, "0.6", lw=6, label="whole car")
plt.plot(t, 1e3 * newton, "C0", label="Newton")
plt.gca().set(xlabel="time / s", ylabel="position of the body / mm", xlim=(0, 4), ylim=(-40, 55))
plt.legend(ncols=3, loc="upper left", handlelength=1.2, columnspacing=1.2)
plt.savefig("runs/two_halves.png")
print("picture: runs/two_halves.png")

# %%
# --8<-- "docs/tutorials/results/9_two_halves.md"
