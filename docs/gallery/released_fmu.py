"""
# A released FMU in FMPy

The FMUs of this project run in any importer. One thing must be known of inputs that move: what the
value means that is set before a step.
"""

# mkdocs_gallery_thumbnail_path = 'tutorials/results/released_fmu.png'
import fmpy
import matplotlib.pyplot as plt
import numpy as np

import slide_fmu as slide
from mbs_models.oscillators import DuffingOscillator
from mbs_models.slider_crank import SliderCrank

# %%
# Two ways to run an FMU, from inputs u (N, inputs) at times t, and the error against the model:


def plain(fmu, t, u, names, output):  # u(t) is set, then a step is done
    table = np.rec.fromarrays([t, *u.T], names=["time", *names])
    found = fmpy.simulate_fmu(fmu, stop_time=t[-1], output_interval=t[1], input=table)
    return found[output]


def tell(name, found, true):  # after the first four seconds, when the windows are filled
    error = np.sqrt(np.mean((found - true)[128:] ** 2) / np.mean(true[128:] ** 2))
    print(f"{name}: {100 * error:.3f} %")


# %%
# The force on the Duffing oscillator is held over each step. What is set at its begin is all
# that acts in it, so `fmpy.simulate_fmu` and `slide_fmu.simulate` give the same.
t = 0.03 * np.arange(400)
force, fmu = 300 * np.sin(6 * t)[:, None], "fmus/duffing/duffing.fmu"
true = DuffingOscillator(step=0.03, substeps=12).simulate(force[:-1])[:, 0]
tell("duffing, plain", plain(fmu, t, force, ["force"], "position"), true)
tell("duffing, simulate", slide.simulate(fmu, t, force)[:, 0], true)

# %%
# The crank of the slider-crank moves within each step, and its FMU takes what is set as the angle
# that is reached by the end of the step: right for set points that are known ahead. But
# `fmpy.simulate_fmu` sets u(t) and then steps from t to t + h, so the angle, and with it all
# outputs, are one step late. `slide_fmu.simulate` sets u(t + h) ([more](../../moving_inputs.md)).

t, fmu = 0.03125 * np.arange(400), "fmus/slider_crank/slider_crank.fmu"
angle = 4 * t + 0.8 * np.sin(2.5 * t)
u = np.stack([np.cos(angle), np.sin(angle)], axis=1)
true = SliderCrank(step=0.03125, elements=10, substeps=20).simulate(u[1:])[:, 0]
late = plain(fmu, t, u, ["director_x", "director_y"], "deflection")
found = slide.simulate(fmu, t, u)[:, 0]
tell("slider_crank, plain", late, true)
tell("slider_crank, simulate", found, true)
_, (upper, lower) = plt.subplots(2, sharex=True, layout="constrained")
upper.plot(t, true, "k", t, found, "--", t, late, ":")
upper.set(xlim=(6, 8), ylabel="deflection / m", title="model (black), simulate, plain (dotted)")
lower.plot(t, found - true, "C1--", t, late - true, "C2:")
lower.set(xlabel="time / s", ylabel="error / m")
plt.savefig("released_fmu.png")
print("picture: released_fmu.png")

# %%
# --8<-- "docs/tutorials/results/released_fmu.md"
