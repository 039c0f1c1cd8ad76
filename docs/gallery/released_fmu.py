"""
# A released FMU in FMPy

Of [inputs that move](../../moving_inputs.md) the FMU forecasts what it is not told.
"""

# mkdocs_gallery_thumbnail_path = 'tutorials/results/released_fmu.png'
import fmpy
import matplotlib.pyplot as plt
import numpy as np

import slide_fmu as slide
from mbs_models.oscillators import DuffingOscillator
from mbs_models.slider_crank import SliderCrank

# %%
# The plain way to run an FMU, from inputs u (N, inputs) at times t, and the error of any way:


def plain(fmu, t, u, names, output):  # u(t) is set, then a step is done
    table = np.rec.fromarrays([t, *u.T], names=["time", *names])
    return fmpy.simulate_fmu(fmu, stop_time=t[-1], output_interval=t[1], input=table)[output]


def tell(name, true, **ways):  # after the first four seconds, when the windows are filled
    for way, found in ways.items():
        error = np.sqrt(np.mean((found - true)[128:] ** 2) / np.mean(true[128:] ** 2))
        print(f"{name}, {way}: {100 * error:.3f} %")


# %%
# The force on the Duffing oscillator is held over each step, so both ways give the same.
t = 0.03 * np.arange(400)
force, fmu = 300 * np.sin(6 * t)[:, None], "fmus/duffing/duffing.fmu"
true = DuffingOscillator(step=0.03, substeps=12).simulate(force[:-1])[:, 0]
late, found = plain(fmu, t, force, ["force"], "position"), slide.simulate(fmu, t, force)[:, 0]
tell("duffing", true, plain=late, simulate=found)

# %%
# The crank of the slider-crank moves within each step. `fmpy.simulate_fmu` sets u(t), then steps
# from t to t + h: the FMU forecasts what the crank does within the step. `slide_fmu.simulate`
# knows the whole motion: it sets u(t + h), and says so to the FMU by `inputs_at_step_end` = 1.
t, fmu = 0.03125 * np.arange(400), "fmus/slider_crank/slider_crank.fmu"
angle = 4 * t + 0.8 * np.sin(2.5 * t)
u = np.stack([np.cos(angle), np.sin(angle)], axis=1)
true = SliderCrank(step=0.03125, elements=10, substeps=20).simulate(u[1:])[:, 0]
late = plain(fmu, t, u, ["director_x", "director_y"], "deflection")
found = slide.simulate(fmu, t, u)[:, 0]
tell("slider_crank", true, plain=late, simulate=found)
_, (upper, lower) = plt.subplots(2, sharex=True, layout="constrained")
upper.plot(t, true, "k", t, found, "--", t, late, ":")
upper.set(ylim=(-0.05, 0.04), ylabel="deflection / m", title="model black, plain call dotted")
lower.plot(t, found - true, "C0--", t, late - true, "C1:")
lower.set(xlim=(6, 8), xlabel="time / s", ylabel="error / m")
plt.savefig("released_fmu.png")
print("picture: released_fmu.png")

# %%
# --8<-- "docs/tutorials/results/released_fmu.md"
