"""
# Know when to trust an FMU

An FMU with an error bound says at every step how large its error may be, and whether the step can
be trusted. Here both stand next to the true error.
"""

# mkdocs_gallery_thumbnail_path = 'tutorials/results/4_trusted_steps.png'
import fmpy
import matplotlib.pyplot as plt
import numpy as np

from mbs_models.oscillators import DuffingOscillator

# %%
# A random force acts on the Duffing oscillator. In the second half it is 1.6 times as large as the
# FMU's range.
step, count = 0.03, 3000
times = step * np.arange(count)
force = np.random.default_rng(20260800).uniform(-1000, 1000, count)
force[count // 2 :] *= 1.6

# %%
# The model gives the truth, the FMU the rest. Its parameter `confidence` is the share of samples
# whose error stays below the bound. Its parameter `position_error_tolerance` is the largest bound
# that you accept; at the start it follows from the usual errors.
true = DuffingOscillator(step=step, substeps=12).simulate(force[:-1, None])[:, 0]
found = fmpy.simulate_fmu(
    "fmus/duffing/duffing.fmu",
    stop_time=times[-1],
    output_interval=step,
    input=np.rec.fromarrays([times, force], names=["time", "force"]),
    start_values={"confidence": 0.95},
    output=["position", "position_error_bound", "trusted", "in_domain", "error_bound_filled"],
)
error, bound = np.abs(found["position"] - true), found["position_error_bound"]
trusted, filled = found["trusted"] > 0.5, found["error_bound_filled"] >= 1

# %%
# In the first half few errors exceed the bound, and few steps are not trusted. In the second half
# the FMU reports that it does not know the force.
usual, large = filled & (times < times[count // 2]), times > times[count // 2] + 20
print(f"usual force, errors above the bound: {100 * np.mean((error > bound)[usual]):.2f} %")
print(f"usual force, not trusted: {100 * np.mean(~trusted[usual]):.2f} %")
print(f"large force, trusted: {100 * np.mean(trusted[large]):.2f} %")

# %%
# The bound follows the error. Where `trusted` is false, a step may be wrong
# ([more](../../trust.md)).
plt.style.use("docs/tutorials/plots.mplstyle")
_, axes = plt.subplots()
axes.fill_between(
    times, 0, 1, where=~trusted & filled, color="0.85", lw=0, transform=axes.get_xaxis_transform()
)
axes.semilogy(times[filled], error[filled], ".", color="0.6", ms=4, label="error")
axes.semilogy(times[filled], bound[filled], "C1", lw=1.2, label="error bound, 95 %")
axes.set(xlabel="time / s", ylabel="m", ylim=(1e-6, 20))
axes.legend(loc="upper left", ncols=2, markerscale=3)
plt.savefig("trusted_steps.png")
print("picture: trusted_steps.png")

# %%
# --8<-- "docs/tutorials/results/4_trusted_steps.md"
