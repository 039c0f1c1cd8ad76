"""
# Data from several processes

Simulations are most of the work where the model is slow. Here two workers of a Dask cluster make
the trajectories of a recipe. Workers on other machines do the same, if they see the same disk.
"""

# mkdocs_gallery_thumbnail_path = 'tutorials/results/many_machines.png'
import json
import subprocess
import sys
import time
from pathlib import Path

import fmpy
import matplotlib.pyplot as plt
import numpy as np

from mbs_models.oscillators import DuffingOscillator

# %%
# On a cluster a scheduler and workers are there already. Here they are two programs more.
recipe, meeting = "docs/tutorials/duffing_small.toml", Path("scheduler.json")
dask, file = [sys.executable, "-m", "dask"], ["--scheduler-file", str(meeting)]
quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
place = ["--host", "127.0.0.1", "--no-dashboard"]
programs = [subprocess.Popen([*dask, "scheduler", "--port", "0", *place, *file], **quiet)]
while not meeting.exists():
    time.sleep(0.1)
workers = [*dask, "worker", "--nworkers", "2", "--nthreads", "1", *place, *file]
programs.append(subprocess.Popen(workers, **quiet))

# %%
# Trajectories are the same to the byte, whoever makes them. When a worker dies, others make what
# is missing. Then `slide-fmu run` finds all data there, trains, and writes the FMU.
address = json.loads(meeting.read_text())["address"].replace("tcp://", "dask://")
for arguments in (["generate", recipe, "--executor", address], ["run", recipe]):
    subprocess.run([sys.executable, "-m", "slide_fmu", *arguments], check=True, **quiet)
for program in programs:
    program.terminate()

# %%
# The FMU beside the model, under a force that nothing has seen:
times, force = 0.03 * np.arange(800), np.random.default_rng(20260900).uniform(-1000, 1000, 800)
signals = np.rec.fromarrays([times, force], names=["time", "force"])
fmu = "runs/duffing_small/duffing_small.fmu"
found = fmpy.simulate_fmu(fmu, stop_time=times[-1], output_interval=0.03, input=signals)
true = DuffingOscillator(step=0.03, substeps=12, damping=16.0).simulate(force[:-1, None])[:, 0]
error, kept = found["position"] - true, found["window_filled"] >= 1
print(f"position: {100 * np.sqrt(np.mean(error[kept] ** 2)) / np.std(true[kept]):.3f} %")
plt.plot(times, true, "k", times, found["position"], "C1--")
plt.gca().set(xlabel="time / s", ylabel="position / m", xlim=(15, 20), title="FMU dashed")
plt.savefig("many_machines.png")
print("picture: many_machines.png")

# %%
# --8<-- "docs/tutorials/results/many_machines.md"
