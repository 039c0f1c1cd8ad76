"""
# Know when to trust an FMU

An FMU with an error bound says at every step how large its error may be, and whether it knows such
inputs. Here both stand next to the true error.
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
# whose error stays below the bound.
true = DuffingOscillator(step=step, substeps=12).simulate(force[:-1, None])[:, 0]
found = fmpy.simulate_fmu(
    "fmus/duffing/duffing.fmu",
    stop_time=times[-1],
    output_interval=step,
    input=np.rec.fromarrays([times, force], names=["time", "force"]),
    start_values={"confidence": 0.95},
    output=["position", "position_error_bound", "in_domain", "novelty", "error_bound_filled"],
)
error, bound = np.abs(found["position"] - true), found["position_error_bound"]
known, filled = found["in_domain"] > 0.5, found["error_bound_filled"] >= 1

# %%
# In the first half few errors exceed the bound. In the second half the FMU reports that it does
# not know the force.
usual, large = filled & (times < times[count // 2]), times > times[count // 2] + 20
print(f"usual force, errors above the bound: {100 * np.mean((error > bound)[usual]):.2f} %")
print(f"usual force, not in the domain: {100 * np.mean(~known[usual]):.2f} %")
print(f"large force, in the domain: {100 * np.mean(known[large]):.2f} %")

# %%
# The bound follows the error. Where the novelty is above 1, the bound is not calibrated
# ([more](../../trust.md)).
plt.style.use("docs/tutorials/plots.mplstyle")
_, (upper, lower) = plt.subplots(2, sharex=True, height_ratios=[2, 1])
upper.semilogy(times[filled], error[filled], ".", color="0.6", ms=4, label="error")
upper.semilogy(times[filled], bound[filled], "C1", lw=1.2, label="error bound, 95 %")
upper.set(ylabel="m", ylim=(1e-6, 20))
upper.legend(loc="upper left", ncols=2, markerscale=3)
lower.semilogy(times[filled], found["novelty"][filled], lw=1.5)
lower.axhline(1, color="C4", lw=1.5, ls="--")
lower.set(xlabel="time / s", ylabel="novelty")
plt.savefig("trusted_steps.png")
print("picture: trusted_steps.png")

# %%
# --8<-- "docs/tutorials/results/4_trusted_steps.md"
