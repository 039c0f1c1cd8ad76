"""
# Leave a mass open, and find it in a record

An oscillator carries a load of 1 to 3 kg. One FMU serves all of them: the mass is its parameter.
And a measured record shows which mass it was made with.
"""

# mkdocs_gallery_thumbnail_path = 'tutorials/results/6_open_mass.png'
import fmpy
import matplotlib.pyplot as plt
import numpy as np

import slide_fmu as slide
from mbs_models.oscillators import DuffingOscillator

# %%
# The table `parameters` declares the mass, an argument of the model. Each trajectory has a mass of
# its own. The response follows its reciprocal most evenly ([more](../../parameters.md)).
MODEL = {"substeps": 12, "damping": 16.0}
TUNED = {"part": 3, "kept": 1, "kept_iterations": 15}
new_at_every_sample = [{"kind": "held_random", "weight": 1.0}]
learnt = slide.learn(
    {"model": "mbs_models.oscillators:DuffingOscillator", "parameters": MODEL},
    "open_mass",
    parameters={"mass": {"range": [1.0, 3.0], "unit": "kg", "transform": "reciprocal"}},
    window={"step": 0.03, "n_in": 236, "n_out": 60},
    data={"train": 40, "validation": 8, "duration": 20.0, "excitation": new_at_every_sample},
    network={"order": 2, "hidden": 12},
    training={"starts": 2, "iterations": 40, "expert": TUNED},
    validation={"trajectories": 8},
)

# %%
# An importer sets the mass like any other parameter. The same force acts on three masses that no
# training saw. The errors count from where the window is filled:
t, rng = 0.03 * np.arange(600), np.random.default_rng(3)
force = rng.uniform(-800, 800, len(t))
table = np.rec.fromarrays([t, force], names=["time", "force"])
plt.style.use("docs/tutorials/plots.mplstyle")
_, panel = plt.subplots()
for number, mass in enumerate((1.2, 1.7, 2.8)):
    true = DuffingOscillator(step=0.03, mass=mass, **MODEL).simulate(force[:-1, None])[:, 0]
    values = {"start_values": {"mass": mass}, "stop_time": t[-1], "output_interval": t[1]}
    found = fmpy.simulate_fmu(learnt.fmu, input=table, **values)["position"]
    print(f"{mass} kg: {100 * np.std((found - true)[236:]) / np.std(true[236:]):.3f} %")
    panel.plot(t, true, "0.6", lw=6, label=None if number else "model")
    panel.plot(t, found, f"C{number}", label=f"FMU, {mass} kg")
panel.set(xlim=(10, 11), ylim=(-0.95, 1.25), xlabel="time / s", ylabel="position / m")
panel.legend(loc="upper left", ncols=2)
plt.savefig("open_mass.png")

# %%
# Now the other way round: a record of the last one, with a noise of 1 %. Which mass was it?
# `slide-fmu calibrate` does this with files, and writes the value for an SSP.
noisy = true[1:] + 0.01 * np.std(true) * rng.normal(size=len(true) - 1)
fit = slide.calibrate(learnt.fmu, force[:-1, None], noisy[:, None]).parameters[0]
print(f"\nmass {fit.value:.4f} kg, between {fit.low:.4f} and {fit.high:.4f} with 95 % certainty")
print("picture: open_mass.png")

# %%
# --8<-- "docs/tutorials/results/6_open_mass.md"
