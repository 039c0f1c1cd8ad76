"""
# Run an FMU, and know when to trust it

An FMU runs in FMPy with one call. This tutorial runs two, and measures them against their models.
One has an error bound: it says at every step how large its error may be.
"""

# mkdocs_gallery_thumbnail_path = 'tutorials/results/1_released_fmu.png'
import fmpy
import matplotlib.pyplot as plt
import numpy as np

import slide_fmu as slide
from mbs_models.oscillators import DuffingOscillator
from mbs_models.slider_crank import SliderCrank

# %%
# `plain` is the usual call: u(t) is set, then a step is done. `report` prints a relative error.


def plain(fmu, t, u, names, outputs, **start):
    table = np.rec.fromarrays([t, *u.T], names=["time", *names])
    steps = {"stop_time": t[-1], "output_interval": t[1]}
    return fmpy.simulate_fmu(fmu, input=table, output=outputs, start_values=start, **steps)


def report(name, found, true):
    print(f"{name}: {100 * np.sqrt(np.mean((found - true) ** 2) / np.mean(true**2)):.3f} %")


# %%
# The crank of the slider-crank moves within each step. The plain call does not say how, so the
# FMU predicts it. `slide.simulate` knows the whole motion, and gives the FMU each value at the end
# of its step ([more](../../use_an_fmu.md)). Errors count once the window of 208 samples is filled.
t, fmu = 0.03125 * np.arange(600), "fmus/slider_crank/slider_crank.fmu"
angle = 4 * t + 0.8 * np.sin(2.5 * t)
u = np.stack([np.cos(angle), np.sin(angle)], axis=1)
true = SliderCrank(step=0.03125, elements=10, substeps=20).simulate(u[1:])[208:, 0]
found = plain(fmu, t, u, ["director_x", "director_y"], ["deflection"])["deflection"]
report("slider_crank, plain", found[208:], true)
report("slider_crank, simulate", slide.simulate(fmu, t, u)[208:, 0], true)

# %%
# A random force on the Duffing oscillator is held over each step, so nothing is predicted. In the
# second half it is 1.6 times as large as the FMU's range. `confidence` is the share of samples
# whose error stays below the bound. Where `trusted` is false, a step may be wrong
# ([more](../../trust.md)): there the picture is grey.
t, names = 0.03 * np.arange(3000), ["position", "position_error_bound", "trusted"]
force = np.random.default_rng(20260800).uniform(-1000, 1000, (3000, 1))
force[1500:] *= 1.6
true = DuffingOscillator(step=0.03, substeps=12).simulate(force[:-1])[:, 0]
found = plain("fmus/duffing/duffing.fmu", t, force, ["force"], names, confidence=0.95)
position, bound, grey = found["position"], found["position_error_bound"], found["trusted"] < 0.5
error, usual = np.abs(position - true), slice(300, 1500)
report("duffing, plain", position[usual], true[usual])
print(f"usual force, errors above the bound: {100 * np.mean((error > bound)[usual]):.2f} %")
print(f"usual force, not trusted: {100 * np.mean(grey[usual]):.2f} %")
print(f"large force, trusted: {100 * np.mean(~grey[1520:]):.2f} %")
plt.style.use("docs/tutorials/plots.mplstyle")
plt.fill_between(t, 1e-6, 0.1, where=grey, color="0.5", alpha=0.3, lw=0)
plt.semilogy(t, error, ".", color="0.6", ms=4, label="error")
plt.semilogy(t, bound, "C1", lw=1.2, label="error bound, 95 %")
plt.gca().set(xlabel="time / s", ylabel="m", xlim=(9, 90), ylim=(1e-6, 1))
plt.legend(loc="upper left", ncols=2, markerscale=3)
plt.savefig("released_fmu.png")
print("picture: released_fmu.png")

# %%
# --8<-- "docs/tutorials/results/1_released_fmu.md"
