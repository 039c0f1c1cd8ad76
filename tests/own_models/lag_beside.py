"""A lag that lies beside its recipe, in two files; for workers that do not see their folder.

Its method takes one motion at a time. Motions that are simulated at once would be one job, for one
worker.
"""

from __future__ import annotations

from pathlib import Path

MODEL = """
from own_rate import RATE

inputs = {"drive": "m"}
outputs = {"level": "m"}
start = [0.0]
method = "LSODA"  # one motion at a time: one trajectory is one job

def f(x, u, p):
    return [RATE * (u[0] - x[0])]

def g(x, u, p):
    return [x[0]]
"""

RECIPE = """
name = "lag"
description = "A lag beside its recipe"

[system]
kind = "function"
model = "own_lag.py"

[system.inputs]
drive = { range = [-1.0, 1.0] }

[system.outputs]
level = { range = [-1.0, 1.0] }

[window]
step = 0.1
n_in = 64
n_out = 8

[data]
seed = 7
duration = 8.0
burn_in = 4.0
train = 5
validation = 3

[[data.excitation]]
kind = "held_random"
weight = 1.0

[network]
family = "feed_forward"
hidden = []
bias = false

[training]
steps = 40
batch = 32
learning_rate = 3e-3
expert.validate_every = 10
"""


def write_lag(folder: Path, rate: float = 2.0) -> Path:
    """Write the model and its recipe into a folder, and return the recipe's place."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "own_rate.py").write_text(f"RATE = {rate}\n", encoding="utf-8")
    (folder / "own_lag.py").write_text(MODEL, encoding="utf-8")
    recipe = folder / "lag.toml"
    recipe.write_text(RECIPE, encoding="utf-8")
    return recipe
