"""Baselines: other models that learn from the same trajectories, for ``slide-fmu compare``.

All of them simulate freely: they are given inputs, and outputs at the start of a record alone.
"""
