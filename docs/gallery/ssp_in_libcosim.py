"""
# An FMU beside its model in libcosim

A system of several FMUs is one file too, by the standard SSP. This tutorial writes one of a
surrogate, its reference model and the inputs of both, and runs it in libcosim.
"""

# mkdocs_gallery_thumbnail_path = 'tutorials/results/ssp_in_libcosim.png'
import subprocess
import sys

import matplotlib.pyplot as plt
import numpy as np
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
from libcosimpy.CosimObserver import CosimObserver

# %%
# The inputs are unseen ones. The reference is the model as FMU; it needs this Python environment.
write = ["ssp", "fmus/duffing/duffing.fmu", "-o", "duffing.ssp", "--seed", "20260700"]
subprocess.run([sys.executable, "-m", "slide_fmu", *write], check=True, stdout=subprocess.DEVNULL)

# %%
# libcosim counts its time in nanoseconds. The communication step is that of the FMU.
log_output_level(CosimLogLevel.ERROR)
step = 0.03  # s
execution = CosimExecution.from_ssp_file("duffing.ssp", round(1e9 * step))
observer = CosimObserver.create_last_value()
execution.add_observer(observer)


def place(component, name):
    index = execution.slave_index_from_instance_name(component)
    all_of_it = execution.slave_variables(index)
    return index, [next(v.reference for v in all_of_it if v.name.decode() == name)]


# %%
# All three FMUs step side by side. Outputs count from `window_filled` = 1 on.
both = place("reference", "position"), place("surrogate", "position")
places = (*both, place("surrogate", "window_filled"))
rows = []
for _ in range(900):
    execution.step()
    rows.append([observer.last_real_values(*found)[0] for found in places])
true, found, filled = np.array(rows).T
error, kept = found - true, filled >= 1
print(f"position: {100 * np.sqrt(np.mean(error[kept] ** 2)) / np.std(true[kept]):.3f} %")

# %%
# Over the ten seconds that are drawn, the FMU gives what the model gives:
_, panel = plt.subplots(layout="constrained")
panel.plot((t := step * np.arange(1, 901)), true, "k", t, found, "C1--")
panel.set(xlabel="time / s", ylabel="position / m", xlim=(15, 25), title="FMU dashed")
plt.savefig("ssp_in_libcosim.png")
print("picture: ssp_in_libcosim.png")

# %%
# --8<-- "docs/tutorials/results/ssp_in_libcosim.md"
