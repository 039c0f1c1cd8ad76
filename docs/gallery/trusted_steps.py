"""
# When to trust an FMU

The released Duffing FMU says at every step what its error stays below in 95 % of the steps, and
whether it knows such inputs. Here both stand beside the true error.
"""

# mkdocs_gallery_thumbnail_path = 'tutorials/results/trusted_steps.png'
import fmpy
import matplotlib.pyplot as plt
import numpy as np

from mbs_models.oscillators import DuffingOscillator

# %%
# A force is drawn anew for each step. In the second half it is 1.6 times as large as its range.
step, count = 0.03, 3000
times = step * np.arange(count)
force = np.random.default_rng(20260800).uniform(-1000, 1000, count)
force[count // 2 :] *= 1.6

# %%
# The truth comes from the model, and the rest from the FMU. Its parameter `confidence` is the
# probability with which the error stays below the bound.
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
# Usual forces are within the domain, and few of their errors exceed the bound. Of the forces that
# are too large, the FMU flags nearly all, whatever their errors are.
usual, large = filled & (times < times[count // 2]), times > times[count // 2] + 20
print(f"usual force, errors above the bound: {100 * np.mean((error > bound)[usual]):.2f} %")
print(f"usual force, not in the domain: {100 * np.mean(~known[usual]):.2f} %")
print(f"large force, in the domain: {100 * np.mean(known[large]):.2f} %")

# %%
# The bound follows the error. Where the novelty is above 1, the bound is not calibrated.
_, (upper, lower) = plt.subplots(2, sharex=True, layout="constrained")
upper.semilogy(times[filled], error[filled], "k.", ms=2, label="error")
upper.semilogy(times[filled], bound[filled], "C1", lw=1, label="error bound, 95 %")
upper.set(ylabel="m", ylim=(1e-7, 1))
upper.legend(loc="lower right")
lower.semilogy(times[filled], found["novelty"][filled])
lower.set(xlabel="time / s", ylabel="novelty")
plt.savefig("trusted_steps.png")
print("picture: trusted_steps.png")

# %%
# --8<-- "docs/tutorials/results/trusted_steps.md"
