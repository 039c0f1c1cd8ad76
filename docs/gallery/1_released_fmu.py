"""
# Run a released FMU

An FMU runs in FMPy with one call. This tutorial runs two, and measures them against their models.
"""

# mkdocs_gallery_thumbnail_path = 'tutorials/results/1_released_fmu.png'
import fmpy
import matplotlib.pyplot as plt
import numpy as np

import slide_fmu as slide
from mbs_models.oscillators import DuffingOscillator
from mbs_models.slider_crank import SliderCrank

# %%
# `plain` is the usual call: u(t) is set, then a step is done. `report` prints relative errors. It
# leaves out the first four seconds, in which the windows fill.


def plain(fmu, t, u, names, output):
    table = np.rec.fromarrays([t, *u.T], names=["time", *names])
    return fmpy.simulate_fmu(fmu, stop_time=t[-1], output_interval=t[1], input=table)[output]


def report(name, true, **ways):
    for way, found in ways.items():
        error = np.sqrt(np.mean((found - true)[128:] ** 2) / np.mean(true[128:] ** 2))
        print(f"{name}, {way}: {100 * error:.3f} %")


# %%
# The force on the Duffing oscillator is held over each step. So both ways give the same.
t = 0.03 * np.arange(400)
force, fmu = 300 * np.sin(6 * t)[:, None], "fmus/duffing/duffing.fmu"
true = DuffingOscillator(step=0.03, substeps=12).simulate(force[:-1])[:, 0]
late, found = plain(fmu, t, force, ["force"], "position"), slide.simulate(fmu, t, force)[:, 0]
report("duffing", true, plain=late, simulate=found)

# %%
# The crank of the slider-crank moves within each step. The plain call does not say how, so the
# FMU predicts it. `slide.simulate` knows the whole motion, and gives the FMU each value at the end
# of its step ([more](../../use_an_fmu.md)).
t, fmu = 0.03125 * np.arange(400), "fmus/slider_crank/slider_crank.fmu"
angle = 4 * t + 0.8 * np.sin(2.5 * t)
u = np.stack([np.cos(angle), np.sin(angle)], axis=1)
true = SliderCrank(step=0.03125, elements=10, substeps=20).simulate(u[1:])[:, 0]
late = plain(fmu, t, u, ["director_x", "director_y"], "deflection")
found = slide.simulate(fmu, t, u)[:, 0]
report("slider_crank", true, plain=late, simulate=found)
plt.style.use("docs/tutorials/plots.mplstyle")
_, (upper, lower) = plt.subplots(2, sharex=True)
upper.plot(t, 1e3 * true, "0.6", lw=6, label="model")
upper.plot(t, 1e3 * found, "C0", label="FMU")
upper.set(xlim=(6, 8), ylim=(-50, 40), ylabel="deflection / mm")
upper.legend(loc="lower left")
lower.plot(t, 1e3 * (late - true), "C1", label="plain call")
lower.plot(t, 1e3 * (found - true), "C0", label="simulate")
lower.set(xlabel="time / s", ylabel="error / mm", ylim=(-0.15, 0.15))
lower.legend(ncols=2, loc="lower left")
plt.savefig("released_fmu.png")
print("picture: released_fmu.png")

# %%
# --8<-- "docs/tutorials/results/1_released_fmu.md"
