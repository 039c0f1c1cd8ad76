"""Baselines are other models trained on the same trajectories, for ``slide-fmu compare``.

All of them simulate freely: they get inputs, and outputs only at the start of a trajectory.
"""
